//! Steering: the heading, speed and turn rate that lead a vehicle to its target.
//!
//! A vehicle that turns on the spot does so for large heading errors. A vehicle with a least
//! turning radius turns in two arcs instead: it backs up at full lock until the rest of the turn is
//! short enough, and then drives ahead. It also backs up when its target is within the circle that
//! it cannot drive. The two arcs need about one turning radius of room on each side; a turn in one
//! wide circle would need two on one side.

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

/// Turns a vehicle to its heading. It remembers which of the two arcs of a turn it is on.
#[derive(Debug, Default)]
pub(super) struct Steering {
    is_reversing: bool,
}

impl Steering {
    /// With a larger heading error, a vehicle with a turning radius backs up first.
    const REVERSE_FROM: f64 = 1.8;
    /// With a smaller heading error, it drives ahead again.
    const REVERSE_UNTIL: f64 = 1.4;
    /// While it backs up for a near target, it leaves this much more room than necessary.
    const ROOM: f64 = 1.2;
    /// It drives at least at this fraction of the speed in a turn.
    const LEAST_SHARE: f64 = 0.5;

    /// The velocity for a heading and a speed, within the limits. The speed is reduced while the
    /// heading error is large. `distance` is that to the target in metres, if it is a point. Zero if
    /// any input is unknown (NaN).
    pub(super) fn along(
        &mut self,
        yaw: f64,
        heading: f64,
        speed: f64,
        distance: f64,
        limits: &Limits,
    ) -> Velocity {
        let error = wrap(heading - yaw);
        if !error.is_finite() || !speed.is_finite() {
            return Velocity::default();
        }
        let turn = turn_rate(yaw, heading, limits);
        let share = if limits.turns_on_the_spot() {
            if error.abs() > TURN_FIRST {
                0.0
            } else {
                error.cos()
            }
        } else if self.reverses(error, distance, limits) {
            -1.0
        } else {
            error.cos().max(Self::LEAST_SHARE)
        };
        limits.clamp(Velocity::forward(speed * share, turn))
    }

    /// Decides between backing up and driving ahead.
    fn reverses(&mut self, error: f64, distance: f64, limits: &Limits) -> bool {
        // The diameter of the circle through a target at this angle is its distance by the sine.
        let least = 2.0 * limits.turning_radius * error.sin().abs();
        let (most, room) = match self.is_reversing {
            true => (Self::REVERSE_UNTIL, Self::ROOM),
            false => (Self::REVERSE_FROM, 1.0),
        };
        let must = error.abs() > most || distance < room * least;
        self.is_reversing = must && limits.reverse > 0.0;
        self.is_reversing
    }
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
        let velocity = Steering::default().along(f64::NAN, 0.0, 2.0, 1.0, &limits);
        assert_eq!(velocity, Velocity::default());
        let (_, speed) = towards(&Pose::default(), (5.0, 0.0), 2.0, f64::INFINITY, &limits);
        assert_eq!(speed, 2.0);
    }
}
