//! Captured messages of real clients, replayed octet for octet to the reference vehicle: the
//! judging tool of a competition, and JAUS++ clients that drive a vehicle.
//!
//! Only ids are replaced: the vehicle's, and those of event streams, which a vehicle chooses. The
//! order is kept; long pauses are shortened. The captures are not part of the project; see
//! `JAUS_SHARED` in CONTRIBUTING.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests with sockets"
)]

mod capture;
mod client;
mod contest;
mod jauspp;
mod vehicle;
