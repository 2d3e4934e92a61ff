//! Conversions between the frames of JAUS and those of ROS.
//!
//! | | X | Y | Z | turns |
//! |---|---|---|---|---|
//! | local frame of JAUS (AS6009) | north | east | down | heading clockwise from north |
//! | `map` of ROS (REP 103, REP 105) | east | north | up | yaw counter-clockwise from east |
//! | vehicle, JAUS | forward | right | down | roll, pitch and yaw about these axes |
//! | `base_link`, ROS | forward | left | up | about these axes |

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A rotation of the vehicle in the axes of JAUS, in radians: first yaw about Z, then pitch about the
/// new Y, then roll about the new X.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Attitude {
    /// About the forward axis, positive if the right side is lower.
    pub roll: f64,
    /// About the axis to the right, positive if the nose is higher.
    pub pitch: f64,
    /// Clockwise from north, seen from above.
    pub yaw: f64,
}

/// The orientation of `base_link` in `map`, as a quaternion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quaternion {
    /// Component along X.
    pub x: f64,
    /// Component along Y.
    pub y: f64,
    /// Component along Z.
    pub z: f64,
    /// Real component.
    pub w: f64,
}

/// Converts a position between the local frame of JAUS and `map`. The conversion is its own inverse.
#[must_use]
pub const fn between_local_and_map([x, y, z]: [f64; 3]) -> [f64; 3] {
    // Adding 0 makes 0 of -0.
    [y, x, -z + 0.0]
}

/// Converts a vector (a velocity, or turn rates) between the axes of the vehicle in JAUS and
/// `base_link`. The conversion is its own inverse.
#[must_use]
pub const fn between_vehicle_and_base([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, -y + 0.0, -z + 0.0]
}

/// The orientation of `base_link` in `map`.
#[must_use]
pub fn orientation(attitude: Attitude) -> Quaternion {
    let (sr, cr) = (attitude.roll / 2.0).sin_cos();
    let (sp, cp) = (-attitude.pitch / 2.0).sin_cos();
    let (sy, cy) = ((FRAC_PI_2 - attitude.yaw) / 2.0).sin_cos();
    Quaternion {
        x: sr * cp * cy - cr * sp * sy,
        y: cr * sp * cy + sr * cp * sy,
        z: cr * cp * sy - sr * sp * cy,
        w: cr * cp * cy + sr * sp * sy,
    }
}

impl Quaternion {
    /// How much the length may differ from 1.
    const TOLERANCE: f64 = 0.01;

    /// The attitude of the vehicle with this orientation; `None` if this is no rotation: not finite,
    /// or not of length 1.
    #[must_use]
    pub fn attitude(self) -> Option<Attitude> {
        let Self { x, y, z, w } = self;
        let length = (x * x + y * y + z * z + w * w).sqrt();
        // False for NaN, too.
        let is_rotation = (length - 1.0).abs() <= Self::TOLERANCE;
        if !is_rotation {
            return None;
        }
        let [x, y, z, w] = [x, y, z, w].map(|it| it / length);
        let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
        let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
        let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
        Some(Attitude {
            roll,
            pitch: -pitch + 0.0,
            yaw: wrapped(FRAC_PI_2 - yaw),
        })
    }
}

/// The same angle, from -π up to but not including π.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};

    use proptest::prelude::*;

    use super::*;

    fn assert_close(is: Quaternion, [x, y, z, w]: [f64; 4]) {
        let differences = [is.x - x, is.y - y, is.z - z, is.w - w];
        let is_close = differences.iter().all(|it| it.abs() < 1e-12);
        assert!(is_close, "{is:?}");
    }

    fn heading(yaw: f64) -> Attitude {
        Attitude {
            yaw,
            ..Attitude::default()
        }
    }

    #[test]
    fn a_vehicle_that_heads_east_has_no_rotation_in_map_and_one_that_heads_north_a_left_turn() {
        assert_close(orientation(heading(FRAC_PI_2)), [0.0, 0.0, 0.0, 1.0]);
        let north = [0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2];
        assert_close(orientation(heading(0.0)), north);
        // South is a right turn from east.
        let south = [0.0, 0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2];
        assert_close(orientation(heading(PI)), south);
    }

    #[test]
    fn a_raised_nose_turns_against_the_axis_to_the_left_and_a_lowered_right_side_about_forward() {
        // Heading east, so that the rotation is that of the pitch or the roll alone.
        let (sine, cosine) = (FRAC_PI_4 / 2.0).sin_cos();
        let raised = Attitude {
            pitch: FRAC_PI_4,
            ..heading(FRAC_PI_2)
        };
        assert_close(orientation(raised), [0.0, -sine, 0.0, cosine]);
        let rolled = Attitude {
            roll: FRAC_PI_4,
            ..heading(FRAC_PI_2)
        };
        assert_close(orientation(rolled), [sine, 0.0, 0.0, cosine]);
    }

    #[test]
    fn north_is_y_east_is_x_and_down_is_negative_in_map() {
        assert_eq!(between_local_and_map([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(between_local_and_map([0.0, 2.0, 3.0]), [2.0, 0.0, -3.0]);
    }

    #[test]
    fn right_is_negative_and_a_turn_to_the_right_too_in_base_link() {
        assert_eq!(between_vehicle_and_base([1.0, 2.0, 3.0]), [1.0, -2.0, -3.0]);
        let zero = between_vehicle_and_base([0.0; 3]);
        assert!(zero.iter().all(|it| it.is_sign_positive()), "{zero:?}");
    }

    #[test]
    fn what_is_no_rotation_is_no_attitude() {
        for (x, w) in [
            (0.0, 0.0),
            (f64::NAN, 1.0),
            (f64::INFINITY, 1.0),
            (1.0, 1.0),
        ] {
            let wrong = Quaternion {
                x,
                y: 0.0,
                z: 0.0,
                w,
            };
            assert_eq!(wrong.attitude(), None, "{wrong:?}");
        }
    }

    /// Rotates a vector by the three turns of an attitude, one after the other.
    fn turned(attitude: Attitude, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (s, c) = attitude.roll.sin_cos();
        let [x, y, z] = [x, c * y - s * z, s * y + c * z];
        let (s, c) = attitude.pitch.sin_cos();
        let [x, y, z] = [c * x + s * z, y, -s * x + c * z];
        let (s, c) = attitude.yaw.sin_cos();
        [c * x - s * y, s * x + c * y, z]
    }

    /// Rotates a vector by a quaternion.
    fn rotated(by: Quaternion, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let Quaternion {
            x: a,
            y: b,
            z: c,
            w,
        } = by;
        let cross = |[a, b, c]: [f64; 3], [x, y, z]: [f64; 3]| {
            [b * z - c * y, c * x - a * z, a * y - b * x]
        };
        let t = cross([a, b, c], [x, y, z]).map(|it| 2.0 * it);
        let u = cross([a, b, c], t);
        [
            x + w * t[0] + u[0],
            y + w * t[1] + u[1],
            z + w * t[2] + u[2],
        ]
    }

    fn attitudes() -> impl Strategy<Value = Attitude> {
        (-3.1..3.1, -1.5..1.5, -3.1..3.1).prop_map(|(roll, pitch, yaw)| Attitude {
            roll,
            pitch,
            yaw,
        })
    }

    proptest! {
        #[test]
        fn an_attitude_survives_the_way_to_ros_and_back(attitude in attitudes()) {
            let back = orientation(attitude).attitude().unwrap();
            for (is, was) in [
                (back.roll, attitude.roll),
                (back.pitch, attitude.pitch),
                (back.yaw, attitude.yaw),
            ] {
                prop_assert!(wrapped(is - was).abs() < 1e-9, "{back:?}");
            }
        }

        #[test]
        fn a_point_fixed_to_the_vehicle_is_at_the_same_place_in_both_frames(
            attitude in attitudes(),
            point in [-10.0..10.0, -10.0..10.0, -10.0..10.0_f64],
        ) {
            let in_jaus = between_local_and_map(turned(attitude, point));
            let in_ros = rotated(orientation(attitude), between_vehicle_and_base(point));
            for (a, b) in in_jaus.iter().zip(in_ros) {
                prop_assert!((a - b).abs() < 1e-9, "{in_jaus:?} {in_ros:?}");
            }
        }
    }
}
