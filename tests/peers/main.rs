//! Recorded exchanges with other stacks, with components of ours in the place of one party.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "../support/asked.rs"]
mod asked;
#[path = "../support/drivable.rs"]
mod drivable;
mod jauspp;
mod judge_discovery;
mod junior;
mod recognised;
#[path = "../support/recorded.rs"]
mod recorded;
#[path = "../support/stand_in.rs"]
mod stand_in;
#[path = "../support/streams.rs"]
mod streams;
mod tcp;
