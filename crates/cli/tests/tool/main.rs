//! The tool `jaus`, run as a process.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "tests with their own processes and sockets"
)]

mod captures;
mod damage;
mod doctor;
mod doctor_peer;
mod golden;
mod interoperability;
mod jsidl;
mod jsidl_explain;
mod jsidl_make;
mod judge;
mod monitor;
mod network;
mod ping;
mod record;
#[path = "../support/mod.rs"]
mod support;
mod vehicle;
mod watch;
