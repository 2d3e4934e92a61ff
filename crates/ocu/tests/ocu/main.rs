//! The operator's station over real sockets on the loopback interface: pages that control, drive
//! and stop a vehicle, two pages at once, and hostile pages.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with sockets"
)]

mod scene;

mod base_map;
mod drive;
mod fleet;
mod handover;
mod hostile;
mod looking;
mod missing;
mod page;
mod proof;
mod stop;
mod truth;
mod users;
