//! Kinematics of a vehicle with steered front wheels.

use std::f64::consts::FRAC_PI_2;

/// Geometry of a vehicle with Ackermann steering, seen as a bicycle: one wheel in the middle of each
/// axle. The steering linkage gives the two front wheels their different angles. Position and
/// speed are those of the middle of the rear axle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ackermann {
    /// Distance between the axles in metres.
    pub wheelbase: f64,
    /// Largest steering angle to either side in radians, below π/2.
    pub max_angle: f64,
}

impl Default for Ackermann {
    /// A small car: 0.5 m and 0.45 rad (26°), which turns on a radius of 1.04 m.
    fn default() -> Self {
        Self {
            wheelbase: 0.5,
            max_angle: 0.45,
        }
    }
}

impl Ackermann {
    /// Least turning radius in metres.
    #[must_use]
    pub fn turning_radius(&self) -> f64 {
        self.wheelbase / self.max_angle.clamp(0.0, FRAC_PI_2).tan()
    }

    /// The steering angle in radians for a curvature in radians per metre, right positive, or the
    /// nearest possible one.
    #[must_use]
    pub fn angle(&self, curvature: f64) -> f64 {
        let angle = (self.wheelbase * curvature).atan();
        angle.clamp(-self.max_angle, self.max_angle)
    }

    /// The curvature in radians per metre at a steering angle in radians.
    #[must_use]
    pub fn curvature(&self, angle: f64) -> f64 {
        angle.tan() / self.wheelbase
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_lock_is_the_least_turning_radius() {
        let car = Ackermann::default();
        let least = 1.0 / car.turning_radius();
        assert!((car.angle(least) - car.max_angle).abs() < 1e-12);
        assert!((car.curvature(car.max_angle) - least).abs() < 1e-12);
        assert!((car.angle(-9.0) + car.max_angle).abs() < 1e-12, "no more");
    }
}
