//! The planner among other components: missions from destination to arrival, on loopback. The store
//! and the stages are small fakes, so that every failure can be provoked; the vehicle is simulated.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of running nodes wait in real time and choose their own port"
)]
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failure here fails the test"
)]

mod fake;
mod missions;
mod obstacles;
mod whole;
mod whole_vehicle;
pub(crate) mod zones;
