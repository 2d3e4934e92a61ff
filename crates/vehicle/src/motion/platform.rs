//! The trait that a vehicle implements so that the mobility services can drive it.

use std::time::Instant;

use super::{GlobalPose, Motion, Pose, Velocity};

/// A vehicle, real or simulated.
///
/// An implementation for real hardware reads its sensors in [`handle_time`](Self::handle_time) and
/// writes to its actuators in [`drive`](Self::drive). It enforces its own limits, whatever the
/// command.
///
/// A platform MUST stop on its own when neither [`drive`](Self::drive) nor [`head`](Self::head) has
/// been called for 200 ms ([`CommandDeadline::DEFAULT`](super::CommandDeadline::DEFAULT)). This
/// must not depend on the calling program: implement it in the motor controller, or on a thread
/// that only writes to the motors. Commands are repeated every [`Pilot::STEP`](super::Pilot::STEP)
/// (20 ms) during motion, so silence means that the program hangs.
/// [`CommandDeadline`](super::CommandDeadline) implements the timing.
pub trait Platform: Send {
    /// Advances to time `now`: reads the sensors, or integrates. Called every
    /// [`Pilot::STEP`](super::Pilot::STEP) while there is a goal.
    fn handle_time(&mut self, now: Instant);

    /// Pose, velocity and acceleration as of the last [`handle_time`](Self::handle_time).
    fn motion(&self) -> Motion;

    /// Sets the current pose in the local frame.
    fn set_pose(&mut self, pose: Pose);

    /// A client has set the current pose on the globe. The [`Pilot`](super::Pilot) moves the local
    /// frame accordingly; only a platform with sensors of its own for it needs to know.
    fn set_global_pose(&mut self, _pose: GlobalPose) {}

    /// Sets the command until the next one, or until the deadline above. A command that is [not
    /// finite](Drive::is_finite) must stop the platform.
    fn drive(&mut self, command: Drive);

    /// Holds a heading in radians clockwise from the local X axis, at a speed in metres per second,
    /// until the next command, if the platform can do so on its own; returns whether it does. It is
    /// called every [`Pilot::STEP`](super::Pilot::STEP). By default the pilot steers instead, with
    /// velocities.
    fn head(&mut self, _heading: f64, _speed: f64) -> bool {
        false
    }

    /// The platform's own limits.
    fn limits(&self) -> Limits;

    /// Sets the limits to enforce. None is wider than the platform's own.
    fn set_limits(&mut self, limits: Limits);

    /// The fault that prevents driving, as text for the operator; `None` without a fault.
    ///
    /// A platform with a fault stops all of its drives on its own, and reports the fault until it
    /// is cleared.
    fn fault(&self) -> Option<String> {
        None
    }
}

/// A command to a platform.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Drive {
    /// Stop as fast as the brakes allow.
    #[default]
    Stop,
    /// Move with a velocity along and about the platform's axes.
    Velocity(Velocity),
    /// Control drives and brakes without feedback.
    Effort(Effort),
}

impl Drive {
    /// Whether all numbers are finite.
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

    /// Returns the command, or [`Stop`](Self::Stop) if it is not finite.
    #[must_use]
    pub fn or_stop(self) -> Self {
        if self.is_finite() { self } else { Self::Stop }
    }
}

/// Effort along and about the axes of a ground vehicle, as a fraction of the maximum.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effort {
    /// Propulsion forward, -1 to 1.
    pub forward: f64,
    /// Turning effort to the right, -1 to 1: propulsion of a vehicle that turns on the spot, and the
    /// curvature of a vehicle with steered wheels. 1 is then its least turning radius, in either
    /// direction of travel.
    pub turn: f64,
    /// Braking of the forward motion, 0 to 1.
    pub brake: f64,
    /// Braking of the turn, 0 to 1.
    pub turn_brake: f64,
}

/// Maximum velocities and accelerations, all positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Forward speed in metres per second.
    pub speed: f64,
    /// Reverse speed in metres per second.
    pub reverse: f64,
    /// Acceleration in metres per second squared.
    pub acceleration: f64,
    /// Deceleration in metres per second squared.
    pub deceleration: f64,
    /// Yaw rate in radians per second.
    pub yaw_rate: f64,
    /// Yaw acceleration in radians per second squared.
    pub yaw_acceleration: f64,
    /// Least turning radius in metres; 0 for a vehicle that turns on the spot.
    pub turning_radius: f64,
}

impl Limits {
    /// The nearest velocity within these limits for a ground vehicle; 0 if the velocity is not
    /// finite. The speed has priority over the turn.
    #[must_use]
    pub fn clamp(&self, velocity: Velocity) -> Velocity {
        if !velocity.is_finite() {
            return Velocity::default();
        }
        let speed = velocity.x.clamp(-self.reverse, self.speed);
        let fastest = match self.turns_on_the_spot() {
            true => self.yaw_rate,
            false => self.yaw_rate.min(speed.abs() / self.turning_radius),
        };
        Velocity::forward(speed, velocity.yaw.clamp(-fastest, fastest))
    }

    /// The speed that a fraction of full effort commands, -1 to 1.
    #[must_use]
    pub fn speed_at(&self, effort: f64) -> f64 {
        let full = if effort < 0.0 {
            self.reverse
        } else {
            self.speed
        };
        effort.clamp(-1.0, 1.0) * full
    }

    /// Whether the vehicle can turn without driving.
    #[must_use]
    pub fn turns_on_the_spot(&self) -> bool {
        self.turning_radius <= 0.0
    }

    /// The intersection of two sets of limits.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        Self {
            speed: self.speed.min(other.speed),
            reverse: self.reverse.min(other.reverse),
            acceleration: self.acceleration.min(other.acceleration),
            deceleration: self.deceleration.min(other.deceleration),
            yaw_rate: self.yaw_rate.min(other.yaw_rate),
            yaw_acceleration: self.yaw_acceleration.min(other.yaw_acceleration),
            turning_radius: self.turning_radius.max(other.turning_radius),
        }
    }
}

impl Default for Limits {
    /// A small rover: 2 m/s forward, 1 m/s backward, 1 m/s², brakes of 2 m/s², 1.5 rad/s. It turns on
    /// the spot.
    fn default() -> Self {
        Self {
            speed: 2.0,
            reverse: 1.0,
            acceleration: 1.0,
            deceleration: 2.0,
            yaw_rate: 1.5,
            yaw_acceleration: 3.0,
            turning_radius: 0.0,
        }
    }
}
