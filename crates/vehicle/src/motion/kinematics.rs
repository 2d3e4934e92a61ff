//! Pose, velocity and acceleration of a vehicle, in the units and axes of AS6009.

use std::f64::consts::{PI, TAU};
use std::time::Instant;

/// Position and attitude of a vehicle in the local frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// X in metres.
    pub x: f64,
    /// Y in metres.
    pub y: f64,
    /// Z in metres, down positive.
    pub z: f64,
    /// Roll in radians about the forward axis.
    pub roll: f64,
    /// Pitch in radians about the axis to the right.
    pub pitch: f64,
    /// Yaw in radians about the downward axis; 0 points along the local X axis.
    pub yaw: f64,
}

/// Velocity of a vehicle along and about its own axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Velocity {
    /// Metres per second forward.
    pub x: f64,
    /// Metres per second to the right.
    pub y: f64,
    /// Metres per second downwards.
    pub z: f64,
    /// Radians per second about the forward axis.
    pub roll: f64,
    /// Radians per second about the axis to the right.
    pub pitch: f64,
    /// Radians per second about the downward axis. Positive turns right.
    pub yaw: f64,
}

/// Acceleration of a vehicle along and about its own axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Acceleration {
    /// Metres per second squared forward.
    pub x: f64,
    /// Metres per second squared to the right.
    pub y: f64,
    /// Metres per second squared downwards.
    pub z: f64,
    /// Radians per second squared about the forward axis.
    pub roll: f64,
    /// Radians per second squared about the axis to the right.
    pub pitch: f64,
    /// Radians per second squared about the downward axis.
    pub yaw: f64,
}

/// Pose, velocity and acceleration of a platform at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// The pose.
    pub pose: Pose,
    /// The velocity.
    pub velocity: Velocity,
    /// The acceleration.
    pub acceleration: Acceleration,
    /// Standard error of the horizontal position in metres; `None` if unknown.
    pub position_rms: Option<f64>,
    /// Standard error of the attitude in radians; `None` if unknown.
    pub attitude_rms: Option<f64>,
    /// Time of the measurement; `None` if unknown.
    pub sampled_at: Option<Instant>,
}

impl Pose {
    /// No component is known (NaN). Unknown components are omitted from reports.
    pub const UNKNOWN: Self = Self {
        x: f64::NAN,
        y: f64::NAN,
        z: f64::NAN,
        roll: f64::NAN,
        pitch: f64::NAN,
        yaw: f64::NAN,
    };

    /// A pose on the ground, facing along the local X axis.
    #[must_use]
    pub fn at(x: f64, y: f64) -> Self {
        Self {
            x,
            y,
            ..Self::default()
        }
    }

    /// Horizontal distance to a point in metres.
    #[must_use]
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        (x - self.x).hypot(y - self.y)
    }

    /// Heading to a point; 0 if it coincides with this pose.
    #[must_use]
    pub fn bearing(&self, x: f64, y: f64) -> f64 {
        (y - self.y).atan2(x - self.x)
    }
}

impl Velocity {
    /// Forward velocity in metres per second and right turn in radians per second.
    #[must_use]
    pub fn forward(x: f64, yaw: f64) -> Self {
        Self {
            x,
            yaw,
            ..Self::default()
        }
    }

    /// Whether the velocity is known to be practically zero: below 1 mm/s and 1 mrad/s. An unknown
    /// velocity (NaN) is not rest.
    #[must_use]
    pub fn is_rest(&self) -> bool {
        self.components().iter().all(|value| value.abs() < 0.001)
    }

    /// Whether any known component exceeds the limits of rest.
    #[must_use]
    pub fn is_moving(&self) -> bool {
        self.components().iter().any(|value| value.abs() >= 0.001)
    }

    /// Whether all components are known.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.components().iter().all(|value| value.is_finite())
    }

    const fn components(&self) -> [f64; 6] {
        [self.x, self.y, self.z, self.roll, self.pitch, self.yaw]
    }
}

/// Wraps an angle to -π (exclusive) to π (inclusive).
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_is_wrapped_into_half_a_turn_either_way() {
        for (angle, expected) in [
            (0.0, 0.0),
            (PI, PI),
            (-PI, PI),
            (1.5 * PI, -0.5 * PI),
            (-7.0 * PI / 2.0, PI / 2.0),
        ] {
            assert!((wrap(angle) - expected).abs() < 1e-12, "{angle}");
        }
    }

    #[test]
    fn an_unknown_velocity_is_neither_rest_nor_motion() {
        let unknown = Velocity::forward(f64::NAN, 0.0);
        assert!(!unknown.is_rest() && !unknown.is_moving() && !unknown.is_finite());
        assert!(Velocity::default().is_rest() && Velocity::default().is_finite());
        assert!(Velocity::forward(f64::NAN, 0.1).is_moving());
    }

    #[test]
    fn bearings_are_clockwise_from_the_x_axis() {
        let here = Pose::at(1.0, 1.0);
        assert!((here.bearing(1.0, 2.0) - PI / 2.0).abs() < 1e-12);
        assert!((here.distance(4.0, 5.0) - 5.0).abs() < 1e-12);
    }
}
