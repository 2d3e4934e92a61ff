//! The tester: load for a communicator, measured, and a mission through the whole chain, checked
//! message by message. What the program `jaus-tester` runs.

mod alone;
pub mod figure;
mod latencies;
pub mod load;
mod mission;
pub mod plot;
pub mod steps;

pub use alone::{Alone, AloneError};
pub use latencies::Latencies;
pub use mission::MissionTest;
