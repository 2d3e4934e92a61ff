//! The tool `jaus` and the programs as their users run them.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "tests with processes and sockets of their own"
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
#[cfg(target_os = "linux")]
mod load;
mod monitor;
mod network;
#[cfg(target_os = "linux")]
mod packaging;
#[cfg(target_os = "linux")]
mod parts;
mod ping;
mod record;
mod store;
#[path = "../support/mod.rs"]
mod support;
#[cfg(target_os = "linux")]
mod up;
mod vehicle;
mod watch;
