//! `jaus judge` against peers that are right, wrong, slow and silent.
#![cfg(feature = "cli")]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests with sockets"
)]

#[path = "../cli_support/mod.rs"]
mod cli_support;
mod papers;
mod peer;
mod right;
mod safety;
mod vehicle;
#[path = "../support/vehicle_process.rs"]
mod vehicle_process;
mod wrong;
