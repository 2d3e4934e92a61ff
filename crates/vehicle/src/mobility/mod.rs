//! The mobility services (AS6009) of a vehicle: its sensors and drivers.
//!
//! All services of one component share one [`Vehicle`]:
//!
//! ```
//! use jaus_vehicle::mobility::Vehicle;
//! use jaus_vehicle::motion::{Frame, Pilot, SkidSteer, SkidSteerConfig};
//!
//! let rover = SkidSteer::new(SkidSteerConfig::default());
//! let vehicle = Vehicle::new(Pilot::new(rover, Frame::at(52.5, 13.4)));
//! let services = [
//!     vehicle.local_pose_sensor(),
//!     vehicle.velocity_state_sensor(),
//!     vehicle.primitive_driver(),
//! ];
//! ```
//!
//! Sensors answer any client. Only the client in control may set poses and waypoints, and commands
//! that move the vehicle also require the component to be ready. The vehicle stops when the
//! component may no longer act or another client takes control. It does not resume on its own.

mod acceleration_state_sensor;
mod behaviour;
mod clock;
mod controls;
mod exchange;
mod global_pose_sensor;
mod global_waypoint;
mod kind;
mod list_driver;
mod local_pose_sensor;
mod local_waypoint;
mod path_kinds;
mod path_segment;
mod place;
mod primitive_driver;
#[cfg(test)]
mod tests;
mod travel;
mod vector_driver;
mod vehicle;
mod velocity_state_driver;
mod velocity_state_sensor;
mod waypoint_driver;
mod waypoint_kinds;

pub use vehicle::{OnVehicle, Vehicle};

use jaus::codec::ServiceId;

/// A service in versions 1.1 and 1.0. Version 1.0 has no messages that version 1.1 lacks.
pub(crate) const fn both_versions(newest: ServiceId) -> [ServiceId; 2] {
    [newest, ServiceId { minor: 0, ..newest }]
}
