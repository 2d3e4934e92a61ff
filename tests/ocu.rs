//! The operator's station over real sockets on the loopback interface: pages that control, drive
//! and stop a vehicle, two of them at once, and hostile ones.
#![cfg(feature = "web")]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with sockets"
)]

#[path = "ocu/scene.rs"]
mod scene;

#[path = "ocu/drive.rs"]
mod drive;
#[path = "ocu/hostile.rs"]
mod hostile;
#[path = "ocu/looking.rs"]
mod looking;
#[path = "ocu/missing.rs"]
mod missing;
