//! Components of other processes on a host's node: attaching, and everything that can happen to
//! either side. Sockets lie in a directory of each test's own; no network is needed.
#![cfg(all(feature = "node", unix))]
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with sockets and processes"
)]

mod attaching;
mod listener;
mod place;
mod processes;
mod raw;
mod records;
