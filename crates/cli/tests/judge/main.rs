//! `jaus judge` against correct, faulty, slow and silent peers.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests with sockets"
)]

mod outputs;
mod peer;
mod replay;
mod right;
mod safety;
#[path = "../support/mod.rs"]
mod support;
mod vehicle;
mod wrong;
