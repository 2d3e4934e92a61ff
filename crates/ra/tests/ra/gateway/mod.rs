//! The gateway between RA systems and JAUS in virtual time: an RA vehicle and an RA operator on one
//! side, JAUS components on the other, and no sockets; and the running gateway on loopback.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test in virtual time"
)]

mod drivers;
mod events;
mod hostile;
mod ids;
mod jaus_vehicle;
mod knowledge;
mod lists;
mod ra_vehicle;
mod replay;
mod running;
mod safety;
mod world;
