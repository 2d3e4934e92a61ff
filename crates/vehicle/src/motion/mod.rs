//! The platform behind the mobility services, and the motion control that drives it.
//!
//! A real vehicle implements [`Platform`]; [`SkidSteer`] is a simulated one. A [`Pilot`] drives
//! either to its [`Goal`]: a velocity, a heading, a waypoint, a curve. Nothing here reads a clock
//! or handles messages; the services in [`mobility`](crate::mobility) do.
//!
//! A minimal implementation for a real vehicle:
//!
//! ```
//! use std::time::Instant;
//! use jaus_vehicle::motion::{Drive, Frame, Limits, Motion, Pilot, Platform, Pose};
//!
//! struct Mower {
//!     motion: Motion,
//!     limits: Limits,
//! }
//!
//! impl Platform for Mower {
//!     fn handle_time(&mut self, _now: Instant) {
//!         // Read odometry and compass into `self.motion`.
//!     }
//!     fn motion(&self) -> Motion {
//!         self.motion
//!     }
//!     fn set_pose(&mut self, pose: Pose) {
//!         self.motion.pose = pose;
//!     }
//!     fn drive(&mut self, command: Drive) {
//!         match command {
//!             Drive::Stop => { /* brake */ }
//!             Drive::Velocity(_velocity) => { /* to the motor controller */ }
//!             Drive::Effort(_effort) => { /* straight to the motors */ }
//!         }
//!     }
//!     fn limits(&self) -> Limits {
//!         self.limits
//!     }
//!     fn set_limits(&mut self, _limits: Limits) {
//!         // To the motor controller: what a client wants to be kept.
//!     }
//! }
//!
//! let mower = Mower { motion: Motion::default(), limits: Limits::default() };
//! let pilot = Pilot::new(mower, Frame::at(52.5, 13.4));
//! assert!(pilot.is_at_rest());
//! ```
//!
//! Axes follow AS6009: X forward or north, Y right or east, Z down. Angles are in radians. Yaw and
//! heading are clockwise from X, seen from above.

mod ackermann;
mod course;
mod curve;
mod deadline;
mod fence;
mod frame;
mod jump_check;
mod kinematics;
mod noise;
mod observed;
mod pilot;
mod platform;
mod reckoning;
mod skid_steer;
mod steering;
mod throttle;

#[cfg(test)]
mod tests;

pub use ackermann::Ackermann;
pub use curve::Curve;
pub use deadline::CommandDeadline;
pub use fence::{Fence, FenceConfig};
pub use frame::{Frame, GlobalPose};
pub(crate) use jump_check::{Jump, JumpCheck};
pub use kinematics::{Acceleration, Motion, Pose, Velocity, wrap};
pub(crate) use noise::Noise;
pub use observed::Observed;
pub use pilot::{Goal, Heading, Pilot, Ticket, Trouble};
pub use platform::{Drive, Effort, Limits, Platform};
pub use reckoning::{DeadReckoning, Gone, Speedometer, WheelCount};
pub use skid_steer::{SkidSteer, SkidSteerConfig};
pub use steering::Waypoint;
pub use throttle::Throttle;
