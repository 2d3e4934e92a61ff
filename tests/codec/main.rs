//! Message codecs: compared with each other, with independent vectors and with recordings.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod agreement;
mod captures;
mod captures_sent;
#[path = "../support/constructs.rs"]
mod constructs;
mod golden;
mod lua_captures;
mod roundtrip;
mod versions;
