//! Allocations, counted by this program's allocator: of a small message, and of a further
//! component.
#![allow(
    clippy::disallowed_methods,
    clippy::expect_used,
    clippy::unwrap_used,
    reason = "a test that cannot go on fails"
)]

mod directory;
mod endpoint;

use std::alloc::System;

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use tokio::sync::Mutex;

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Makes the tests run one at a time: the allocations of others would be counted too.
static ALONE: Mutex<()> = Mutex::const_new(());
