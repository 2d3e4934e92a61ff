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
mod constructs;
mod controlled;
mod golden;
mod lua_captures;
mod roundtrip;
mod versions;

use jaus::codec::Registry;

/// The registries of all generated services. Those of the Reference Architecture are separate,
/// because they share codes with the others.
fn generated() -> [Registry; 2] {
    [
        jaus_vehicle::messages::registry(),
        jaus_ra::messages::registry(),
    ]
}
