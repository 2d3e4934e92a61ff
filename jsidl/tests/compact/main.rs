//! The compact form of the language (CJSIDL): reading, writing, and back.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on fails"
)]

mod mistakes;
mod productions;
mod round_trips;
