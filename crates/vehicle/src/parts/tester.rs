//! The tester: a mission through the whole chain, checked message by message, and a chart of what
//! a load measured. What the program `jaus-tester` runs.

mod alone;
pub mod figure;
mod mission;
pub mod plot;
pub mod steps;

pub use alone::{Alone, AloneError};
pub use mission::MissionTest;
