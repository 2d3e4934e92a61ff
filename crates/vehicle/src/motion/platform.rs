//! What a vehicle must be able to do so that the mobility services can drive it.

use std::time::Instant;

use super::steering::along;
use super::{Motion, Pose, Velocity};

/// A vehicle, real or simulated.
///
/// A real one reads its sensors in [`handle_time`](Self::handle_time) and writes to its actuators
/// in [`drive`](Self::drive). It keeps its own limits whatever it is commanded.
///
/// A platform MUST stop by itself when neither [`drive`](Self::drive) nor [`head`](Self::head) has
/// been called for 200 ms ([`CommandDeadline::DEFAULT`](super::CommandDeadline::DEFAULT)), outside of
/// the program that calls it: in the motor controller, or on a thread that only writes to the
/// motors. While it moves it is commanded every [`Pilot::STEP`](super::Pilot::STEP) (20 ms), so that
/// silence means that the program hangs. [`CommandDeadline`](super::CommandDeadline) keeps the time.
pub trait Platform: Send {
    /// It is `now`: reads the sensors, or moves on. While something is to be done this is called
    /// every [`Pilot::STEP`](super::Pilot::STEP).
    fn handle_time(&mut self, now: Instant);

    /// Where it is and how it moves, as of the last [`handle_time`](Self::handle_time).
    fn motion(&self) -> Motion;

    /// From now on the place where it is has this pose in the local frame.
    fn set_pose(&mut self, pose: Pose);

    /// What it is to do until the next command, and for at most the deadline above. A command that
    /// is [not finite](Drive::is_finite) must stop it.
    fn drive(&mut self, command: Drive);

    /// To keep a heading in radians clockwise from the local X axis, at a speed in metres per second,
    /// until it is told something else. Most platforms leave it at this: they are told, every
    /// [`Pilot::STEP`](super::Pilot::STEP), the velocity within `limits` that turns to the heading.
    fn head(&mut self, heading: f64, speed: f64, limits: &Limits) {
        let velocity = along(self.motion().pose.yaw, heading, speed, limits);
        self.drive(Drive::Velocity(limits.clamp(velocity)));
    }

    /// What it can do at most.
    fn limits(&self) -> Limits;

    /// From now on it keeps these limits, none of which is wider than its own.
    fn set_limits(&mut self, limits: Limits);

    /// Why it cannot drive, as text for the operator; `None` while it can.
    ///
    /// A platform with a fault stops all of its drives by itself, and reports the fault until it is
    /// gone.
    fn fault(&self) -> Option<String> {
        None
    }
}

/// What a platform is to do.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Drive {
    /// To stand still, as soon as its brakes allow.
    #[default]
    Stop,
    /// To move with a velocity along and about its own axes.
    Velocity(Velocity),
    /// To use its drives and brakes without any feedback.
    Effort(Effort),
}

impl Drive {
    /// Whether all of its numbers are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Stop => true,
            Self::Velocity(velocity) => velocity.is_finite(),
            Self::Effort(effort) => {
                let Effort {
                    forward,
                    turn,
                    brake,
                    turn_brake,
                } = *effort;
                [forward, turn, brake, turn_brake]
                    .iter()
                    .all(|share| share.is_finite())
            }
        }
    }

    /// The command, or [`Stop`](Self::Stop) in place of one that is not finite.
    #[must_use]
    pub fn or_stop(self) -> Self {
        if self.is_finite() { self } else { Self::Stop }
    }
}

/// Effort about and along the axes that a ground vehicle has, as a share of what there is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effort {
    /// Propulsion forward, -1 to 1.
    pub forward: f64,
    /// Propulsion that turns to the right, -1 to 1.
    pub turn: f64,
    /// Braking of the forward motion, 0 to 1.
    pub brake: f64,
    /// Braking of the turn, 0 to 1.
    pub turn_brake: f64,
}

/// The greatest velocity and acceleration, all positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Metres per second, forward.
    pub speed: f64,
    /// Metres per second, backward.
    pub reverse: f64,
    /// Metres per second squared, when getting faster.
    pub acceleration: f64,
    /// Metres per second squared, when getting slower.
    pub deceleration: f64,
    /// Radians per second.
    pub yaw_rate: f64,
    /// Radians per second squared.
    pub yaw_acceleration: f64,
}

impl Limits {
    /// The closest velocity that a ground vehicle with these limits can have; 0 in place of one that
    /// is not finite.
    #[must_use]
    pub fn clamp(&self, velocity: Velocity) -> Velocity {
        if !velocity.is_finite() {
            return Velocity::default();
        }
        Velocity::forward(
            velocity.x.clamp(-self.reverse, self.speed),
            velocity.yaw.clamp(-self.yaw_rate, self.yaw_rate),
        )
    }

    /// What both sets of limits allow.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        Self {
            speed: self.speed.min(other.speed),
            reverse: self.reverse.min(other.reverse),
            acceleration: self.acceleration.min(other.acceleration),
            deceleration: self.deceleration.min(other.deceleration),
            yaw_rate: self.yaw_rate.min(other.yaw_rate),
            yaw_acceleration: self.yaw_acceleration.min(other.yaw_acceleration),
        }
    }
}

impl Default for Limits {
    /// A small rover: 2 m/s forward, 1 m/s backward, 1 m/s², brakes of 2 m/s², a quarter turn a
    /// second.
    fn default() -> Self {
        Self {
            speed: 2.0,
            reverse: 1.0,
            acceleration: 1.0,
            deceleration: 2.0,
            yaw_rate: 1.5,
            yaw_acceleration: 3.0,
        }
    }
}
