//! How to get somewhere: from where a vehicle is and where it is to be, the velocity to drive.

use std::f64::consts::FRAC_PI_3;

use super::{Limits, Pose, Velocity, wrap};

/// A place to drive to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Metres along the local X axis.
    pub x: f64,
    /// Metres along the local Y axis.
    pub y: f64,
    /// How to stand there, in radians, if it matters.
    pub heading: Option<f64>,
    /// At what distance in metres it counts as reached.
    pub tolerance: f64,
}

impl Waypoint {
    /// The tolerance of whoever does not choose one, in metres.
    pub const TOLERANCE: f64 = 0.5;
    /// The least tolerance that can be kept, in metres.
    pub const LEAST_TOLERANCE: f64 = 0.05;
    /// How exactly a heading is kept, in radians.
    pub(super) const HEADING_TOLERANCE: f64 = 0.03;

    /// A place at which any heading will do.
    #[must_use]
    pub const fn at(x: f64, y: f64) -> Self {
        Self {
            x,
            y,
            heading: None,
            tolerance: Self::TOLERANCE,
        }
    }

    /// Whether a vehicle with this pose has reached the place, not counting the heading.
    #[must_use]
    pub fn is_reached(&self, pose: &Pose) -> bool {
        pose.distance(self.x, self.y) <= self.tolerance.max(Self::LEAST_TOLERANCE)
    }
}

/// How quickly a wrong heading is put right, per second.
const TURN_GAIN: f64 = 2.0;
/// A place further to the side than this is turned to before it is driven to.
const TURN_FIRST: f64 = FRAC_PI_3;
/// The share of the brakes and of the yaw rate that is planned with; the rest makes up for errors.
const MARGIN: f64 = 0.8;

/// Turns to a heading.
pub(super) fn turn_rate(yaw: f64, heading: f64, limits: &Limits) -> f64 {
    let error = wrap(heading - yaw);
    // What can still be slowed down before the heading is reached.
    let most = (2.0 * MARGIN * limits.yaw_acceleration * error.abs()).sqrt();
    let most = most.min(limits.yaw_rate);
    (TURN_GAIN * error).clamp(-most, most)
}

/// Keeps a heading and a speed; slower as long as the heading is wrong. Stands still if any of the
/// numbers is unknown (NaN).
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

/// The heading and the speed that lead to a point: at most with a speed, so that it could stop after
/// `way` more metres. The speed is 0 if the pose is unknown (NaN).
pub(super) fn towards(
    pose: &Pose,
    (x, y): (f64, f64),
    speed: f64,
    way: f64,
    limits: &Limits,
) -> (f64, f64) {
    let heading = pose.bearing(x, y);
    let error = wrap(heading - pose.yaw);
    // `min` would ignore an unknown term, and leave the full speed.
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
