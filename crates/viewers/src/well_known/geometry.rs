//! Positions and rotations in the axes of JAUS (forward, right, down) and of viewers (forward, left,
//! up).

use serde_json::{Value as Json, json};

/// A position in metres, in the axes of JAUS.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vector(pub(super) [f64; 3]);

/// A rotation in the axes of JAUS: real part, then X, Y and Z.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quaternion(pub(super) [f64; 4]);

impl Vector {
    /// A point from its distance in metres, its bearing about Z and its inclination about Y, both in
    /// radians by the right-hand rule.
    pub(super) fn of_polar(range: f64, bearing: f64, inclination: f64) -> Self {
        let level = range * inclination.cos();
        Self([
            level * bearing.cos(),
            level * bearing.sin(),
            -range * inclination.sin(),
        ])
    }

    /// X, Y and Z in the axes of viewers.
    pub(super) fn turned(self) -> [f64; 3] {
        let [x, y, z] = self.0;
        // Adding 0 makes 0 of -0.
        [x, -y + 0.0, -z + 0.0]
    }

    pub(super) fn for_viewers(self) -> Json {
        let [x, y, z] = self.turned();
        json!({ "x": x, "y": y, "z": z })
    }
}

impl Quaternion {
    /// The rotation by yaw about Z, then pitch about the new Y, then roll about the new X, in radians.
    pub(super) fn of_angles(roll: f64, pitch: f64, yaw: f64) -> Self {
        let (sr, cr) = (roll / 2.0).sin_cos();
        let (sp, cp) = (pitch / 2.0).sin_cos();
        let (sy, cy) = (yaw / 2.0).sin_cos();
        Self([
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ])
    }

    pub(super) fn for_viewers(self) -> Json {
        let [w, x, y, z] = self.0;
        json!({ "x": x, "y": -y + 0.0, "z": -z + 0.0, "w": w })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn a_bearing_to_the_right_is_a_point_to_the_right_and_a_positive_inclination_points_up() {
        let close = |is: [f64; 3], expected: [f64; 3]| {
            let differs = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-12;
            assert!(!is.iter().zip(&expected).any(differs), "{is:?}");
        };
        close(Vector::of_polar(2.0, FRAC_PI_2, 0.0).0, [0.0, 2.0, 0.0]);
        close(Vector::of_polar(2.0, 0.0, FRAC_PI_2).0, [0.0, 0.0, -2.0]);
        // For viewers up is positive.
        let up = Vector::of_polar(2.0, 0.0, FRAC_PI_2);
        close(up.turned(), [0.0, 0.0, 2.0]);
    }

    #[test]
    fn without_angles_there_is_no_rotation() {
        let json = Quaternion::of_angles(0.0, 0.0, 0.0).for_viewers();
        assert_eq!(json, json!({ "x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0 }));
    }
}
