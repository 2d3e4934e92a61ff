//! The generated dissector, run by Wireshark's own `tshark`.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

mod expected;
mod golden;
mod packets;
mod random;
#[path = "../support/mod.rs"]
mod support;
mod transport;
mod tshark;
