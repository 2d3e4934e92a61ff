//! Navigation: satellite positions, turn rates and wheel travel become one pose on the globe.
//!
//! | part | contents |
//! |---|---|
//! | [`Receiver`] | reads the sentences of a GNSS receiver (NMEA 0183) |
//! | [`IioGyro`] | reads a gyroscope of Linux's industrial I/O |
//! | [`Estimator`] | fuses them with wheel odometry, and states its own uncertainty |
//!
//! Receiver and estimator do no I/O and read no clock.

mod estimator;
mod gyro;
mod nmea;
#[cfg(test)]
mod tests;

pub use estimator::{Estimate, Estimator};
pub use gyro::{GyroError, IioGyro};
pub use nmea::{Course, Fix, Navigation, Quality, Receiver};
