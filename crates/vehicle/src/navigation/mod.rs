//! Navigation: satellite positions, turn rates and wheel travel become one pose on the globe.
//!
//! | part | contents |
//! |---|---|
//! | [`Receiver`] | reads the sentences of a GNSS receiver (NMEA 0183) |
//! | [`IioImu`] | reads a gyroscope and an accelerometer of Linux's industrial I/O |
//! | [`Estimator`] | fuses them with wheel odometry, and states its own uncertainty |
//! | [`SimulatedReceiver`] | writes the sentences of a receiver |
//! | [`Navigator`] | reads, fuses, and says which pose a vehicle may rely on |
//!
//! Only the inertial measurement unit does I/O, and none reads a clock.

mod estimator;
mod imu;
mod navigator;
mod nmea;
mod simulated_receiver;
#[cfg(test)]
mod tests;

pub use estimator::{Estimate, Estimator};
pub use imu::{IioImu, ImuError, InertialSample};
pub use navigator::{NavigationLoss, Navigator, NavigatorConfig};
pub use nmea::{Course, Fix, Navigation, Quality, Receiver};
pub use simulated_receiver::SimulatedReceiver;
