//! The tester behind `jaus test`: a mission through the whole chain, checked message
//! by message, and charts of load measurements.

pub mod figure;
mod mission;
pub mod plot;
pub mod steps;

pub use mission::MissionTest;
