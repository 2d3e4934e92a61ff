//! Steering: the heading, speed and turn rate that lead a vehicle to its target.

use std::f64::consts::FRAC_PI_3;

use super::{Limits, Pose, Velocity, wrap};

/// A waypoint in the local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// X in metres.
    pub x: f64,
    /// Y in metres.
    pub y: f64,
    /// Final heading in radians, if required.
    pub heading: Option<f64>,
    /// Distance in metres at which the waypoint counts as reached.
    pub tolerance: f64,
}

impl Waypoint {
    /// Default tolerance in metres.
    pub const TOLERANCE: f64 = 0.5;
    /// The smallest achievable tolerance in metres.
    pub const LEAST_TOLERANCE: f64 = 0.05;
    /// Heading accuracy in radians.
    pub(super) const HEADING_TOLERANCE: f64 = 0.03;

    /// A waypoint with any final heading.
    #[must_use]
    pub const fn at(x: f64, y: f64) -> Self {
        Self {
            x,
            y,
            heading: None,
            tolerance: Self::TOLERANCE,
        }
    }

    /// Whether a vehicle with this pose has reached the waypoint, ignoring the heading.
    #[must_use]
    pub fn is_reached(&self, pose: &Pose) -> bool {
        pose.distance(self.x, self.y) <= self.tolerance.max(Self::LEAST_TOLERANCE)
    }
}

/// Proportional gain from heading error to turn rate, per second.
const TURN_GAIN: f64 = 2.0;
/// With a larger heading error, the vehicle turns on the spot before it drives.
const TURN_FIRST: f64 = FRAC_PI_3;
/// Fraction of braking and yaw rate used for planning. The rest is reserve for errors.
const MARGIN: f64 = 0.8;

/// The turn rate towards a heading.
pub(super) fn turn_rate(yaw: f64, heading: f64, limits: &Limits) -> f64 {
    let error = wrap(heading - yaw);
    // The rate from which the turn can still stop at the heading.
    let most = (2.0 * MARGIN * limits.yaw_acceleration * error.abs()).sqrt();
    let most = most.min(limits.yaw_rate);
    (TURN_GAIN * error).clamp(-most, most)
}

/// The velocity for a heading and a speed, reduced while the heading error is large. Zero if any
/// input is unknown (NaN).
pub(crate) fn along(yaw: f64, heading: f64, speed: f64, limits: &Limits) -> Velocity {
    let error = wrap(heading - yaw);
    if !error.is_finite() || !speed.is_finite() {
        return Velocity::default();
    }
    let share = if error.abs() > TURN_FIRST {
        0.0
    } else {
        error.cos()
    };
    Velocity::forward(speed * share, turn_rate(yaw, heading, limits))
}

/// The heading and speed towards a point. The speed is at most `speed`, and low enough to stop
/// after `way` metres. It is 0 if the pose is unknown (NaN).
pub(super) fn towards(
    pose: &Pose,
    (x, y): (f64, f64),
    speed: f64,
    way: f64,
    limits: &Limits,
) -> (f64, f64) {
    let heading = pose.bearing(x, y);
    let error = wrap(heading - pose.yaw);
    // `min` would ignore a NaN operand and keep the full speed.
    if !error.is_finite() || speed.is_nan() || way.is_nan() {
        return (heading, 0.0);
    }
    let stoppable = (2.0 * MARGIN * limits.deceleration * way).sqrt();
    // The speed at which the circle through the point can be driven.
    let turnable = pose.distance(x, y) * MARGIN * limits.yaw_rate / (2.0 * error.sin().abs());
    let speed = speed.min(stoppable).min(turnable);
    (heading, speed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_pose_gives_no_speed() {
        let limits = Limits::default();
        for pose in [
            Pose {
                x: f64::NAN,
                ..Pose::default()
            },
            Pose {
                y: f64::NAN,
                ..Pose::default()
            },
            Pose {
                yaw: f64::NAN,
                ..Pose::default()
            },
        ] {
            let (_, speed) = towards(&pose, (5.0, 0.0), 2.0, 5.0, &limits);
            assert_eq!(speed, 0.0, "{pose:?}");
        }
        let velocity = along(f64::NAN, 0.0, 2.0, &limits);
        assert_eq!(velocity, Velocity::default());
        let (_, speed) = towards(&Pose::default(), (5.0, 0.0), 2.0, f64::INFINITY, &limits);
        assert_eq!(speed, 2.0);
    }
}
