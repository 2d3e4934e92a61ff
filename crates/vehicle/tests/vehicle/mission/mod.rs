//! The planner among other components: missions from the destination to the arrival, on loopback.
//! The store and the stages are small fakes here, so that each thing that can go wrong can be made
//! to go wrong; the vehicle drives in a simulation.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of running nodes wait in real time, and choose a port of their own"
)]
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "what fails here fails the test"
)]

mod fake;
mod missions;
mod whole;
