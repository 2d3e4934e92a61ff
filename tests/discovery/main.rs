//! Discovery between components in virtual time: who finds whom, when, and with how many packets.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test"
)]

mod answers;
mod finding;
mod profiles;
mod rubbish;
mod traffic;
mod world;
