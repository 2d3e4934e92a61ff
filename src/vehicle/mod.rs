//! What moves: the platform behind the mobility services, and the motion control over it.
//!
//! A real vehicle implements [`Platform`]; [`SkidSteer`] is a simulated one. A [`Pilot`] drives
//! either to its [`Goal`]: a velocity, a heading, a waypoint, a curve. Nothing here reads a clock
//! or knows a message; the services in [`service::mobility`](crate::service::mobility) do the
//! talking.
//!
//! Axes are those of AS6009: X forward or north, Y to the right or east, Z down; angles are in
//! radians, yaw and heading clockwise from X, seen from above.

mod curve;
mod frame;
mod motion;
mod pilot;
mod platform;
mod random;
mod skid_steer;
mod steering;

#[cfg(test)]
mod tests;

pub use curve::Curve;
pub use frame::{Frame, GlobalPose};
pub use motion::{Acceleration, Motion, Pose, Velocity, wrap};
pub use pilot::{Goal, Pilot, Ticket};
pub use platform::{Drive, Effort, Limits, Platform};
pub use skid_steer::{SkidSteer, SkidSteerConfig};
pub use steering::Waypoint;
