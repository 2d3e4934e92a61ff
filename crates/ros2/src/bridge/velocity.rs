//! The velocity of a `cmd_vel`, its limits, and the JAUS commands for it.

use jaus::codec::OutOfRange;
use jaus::messages::mobility::set_velocity_command::CommandType;
use jaus::messages::mobility::{SetVelocityCommand, SetWrenchEffort};

/// The contents of a geometry_msgs/Twist, in the axes of `base_link`: m/s and rad/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist {
    /// Forward, to the left, up.
    pub linear: [f64; 3],
    /// About the same axes.
    pub angular: [f64; 3],
}

/// The velocity of a ground vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Velocity {
    /// Forward, in m/s.
    pub forward: f64,
    /// Counter-clockwise seen from above, in rad/s.
    pub yaw_rate: f64,
}

/// The limits of commanded velocities. They also scale commands to a primitive driver: they are what
/// the vehicle reaches with full effort.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// The highest speed, forward and backward, in m/s.
    pub speed: f64,
    /// The highest yaw rate to both sides, in rad/s.
    pub yaw_rate: f64,
}

/// Why a velocity is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InvalidVelocity {
    /// A number is infinite or none.
    #[error("a component is not finite")]
    NotFinite,
    /// The speed is above the limit.
    #[error("the speed is above --max-speed")]
    Speed,
    /// The yaw rate is above the limit.
    #[error("the yaw rate is above --max-yaw-rate")]
    YawRate,
}

impl Velocity {
    /// Standing still.
    pub const ZERO: Self = Self {
        forward: 0.0,
        yaw_rate: 0.0,
    };

    /// The command to a primitive driver, as shares of full effort. At rest it brakes, because a
    /// vehicle without effort may roll on.
    ///
    /// # Errors
    /// A velocity above the limits.
    pub fn effort(self, limits: Limits) -> Result<SetWrenchEffort, OutOfRange> {
        let brake = if self == Self::ZERO { 100.0 } else { 0.0 };
        // Clockwise is positive in JAUS.
        let turn = -100.0 * self.yaw_rate / limits.yaw_rate;
        let mut effort = SetWrenchEffort::default();
        effort.set_propulsive_linear_effort_x_percent(100.0 * self.forward / limits.speed)?;
        effort.set_propulsive_rotational_effort_z_percent(turn)?;
        effort.set_resistive_linear_effort_x_percent(brake)?;
        effort.set_resistive_rotational_effort_z_percent(brake)?;
        Ok(effort)
    }

    /// The command to a velocity state driver: a velocity over ground.
    ///
    /// # Errors
    /// A velocity that the message cannot carry.
    pub fn command(self) -> Result<SetVelocityCommand, OutOfRange> {
        let mut command = SetVelocityCommand {
            // The velocity to drive; 1 to 3 would set limits and the default.
            command_type: CommandType(0),
            ..SetVelocityCommand::default()
        };
        command.set_velocity_x_m_per_s(self.forward)?;
        command.set_velocity_y_m_per_s(0.0)?;
        // Clockwise is positive in JAUS.
        command.set_yaw_rate_rad_per_s(-self.yaw_rate)?;
        Ok(command)
    }
}

impl Limits {
    /// What rounding may add to a number on its way.
    const ROUNDING: f64 = 1e-6;
    /// The step of an effort on the wire, 16 bits for -100 % to 100 %, as a share of the limit. A smaller
    /// velocity would move nothing, but release the brakes.
    const STEP: f64 = 2.0 / 65_535.0;

    /// The velocity of a twist. A ground vehicle uses two of the six components; the others have no
    /// effect, but have to be finite.
    ///
    /// # Errors
    /// A number that is not finite or above the limits.
    pub fn velocity(self, twist: &Twist) -> Result<Velocity, InvalidVelocity> {
        let mut all = twist.linear.iter().chain(&twist.angular);
        if !all.all(|it| it.is_finite()) {
            return Err(InvalidVelocity::NotFinite);
        }
        let [forward, ..] = twist.linear;
        let [.., yaw_rate] = twist.angular;
        let within = |value: f64, limit: f64| value.abs() <= limit * (1.0 + Self::ROUNDING);
        if !within(forward, self.speed) {
            return Err(InvalidVelocity::Speed);
        }
        if !within(yaw_rate, self.yaw_rate) {
            return Err(InvalidVelocity::YawRate);
        }
        let carried = |value: f64, limit: f64| match value.abs() < limit * Self::STEP {
            true => 0.0,
            false => value.clamp(-limit, limit),
        };
        Ok(Velocity {
            forward: carried(forward, self.speed),
            yaw_rate: carried(yaw_rate, self.yaw_rate),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::array::uniform3;
    use proptest::num;
    use proptest::prelude::*;

    use super::*;

    const LIMITS: Limits = Limits {
        speed: 2.0,
        yaw_rate: 1.5,
    };

    fn twist(forward: f64, yaw_rate: f64) -> Twist {
        Twist {
            linear: [forward, 0.0, 0.0],
            angular: [0.0, 0.0, yaw_rate],
        }
    }

    #[test]
    fn half_speed_and_a_left_turn_are_half_effort_and_a_negative_turn() {
        let velocity = LIMITS.velocity(&twist(1.0, 0.75)).unwrap();
        let effort = velocity.effort(LIMITS).unwrap();
        let close = |is: Option<f64>, expected: f64| (is.unwrap() - expected).abs() < 0.01;
        assert!(close(effort.propulsive_linear_effort_x_percent(), 50.0));
        assert!(close(
            effort.propulsive_rotational_effort_z_percent(),
            -50.0
        ));
        assert!(close(effort.resistive_linear_effort_x_percent(), 0.0));
        let command = velocity.command().unwrap();
        assert!(close(command.velocity_x_m_per_s(), 1.0));
        assert!(close(command.yaw_rate_rad_per_s(), -0.75));
    }

    #[test]
    fn a_vehicle_that_is_to_stand_brakes() {
        let effort = Velocity::ZERO.effort(LIMITS).unwrap();
        let brakes = [
            effort.resistive_linear_effort_x_percent(),
            effort.resistive_rotational_effort_z_percent(),
        ];
        assert!(brakes.iter().all(|it| it.unwrap() > 99.9), "{brakes:?}");
    }

    #[test]
    fn what_is_not_finite_or_above_the_limits_is_refused() {
        for (forward, yaw_rate, expected) in [
            (f64::NAN, 0.0, InvalidVelocity::NotFinite),
            (0.0, f64::NEG_INFINITY, InvalidVelocity::NotFinite),
            (2.01, 0.0, InvalidVelocity::Speed),
            (-2.01, 0.0, InvalidVelocity::Speed),
            (0.0, -1.51, InvalidVelocity::YawRate),
        ] {
            let refused = LIMITS.velocity(&twist(forward, yaw_rate));
            assert_eq!(refused, Err(expected), "{forward} {yaw_rate}");
        }
        let unused = Twist {
            linear: [0.0, 0.0, f64::NAN],
            ..Twist::default()
        };
        assert_eq!(LIMITS.velocity(&unused), Err(InvalidVelocity::NotFinite));
    }

    #[test]
    fn a_velocity_that_the_wire_cannot_carry_is_zero_and_brakes() {
        for (forward, yaw_rate) in [(1e-9, 0.0), (-6e-5, 4e-5), (f64::MIN_POSITIVE, -1e-12)] {
            let velocity = LIMITS.velocity(&twist(forward, yaw_rate)).unwrap();
            assert_eq!(velocity, Velocity::ZERO, "{forward} {yaw_rate}");
        }
        let zero = Velocity::ZERO.effort(LIMITS).unwrap();
        for (forward, yaw_rate) in [(6.2e-5, 0.0), (-6.2e-5, 0.0), (0.0, 4.6e-5)] {
            let effort = LIMITS.velocity(&twist(forward, yaw_rate)).unwrap();
            let effort = effort.effort(LIMITS).unwrap();
            let drives = |it: &SetWrenchEffort| {
                (
                    it.propulsive_linear_effort_x_percent(),
                    it.propulsive_rotational_effort_z_percent(),
                )
            };
            assert_ne!(drives(&effort), drives(&zero), "{forward} {yaw_rate}");
        }
    }

    #[test]
    fn a_limit_that_was_rounded_on_its_way_is_still_the_limit() {
        let rounded = LIMITS.velocity(&twist(2.000_000_1, -1.500_000_1)).unwrap();
        assert_eq!(rounded, LIMITS.velocity(&twist(2.0, -1.5)).unwrap());
        assert!(rounded.effort(LIMITS).is_ok());
    }

    proptest! {
        #[test]
        fn any_twist_is_refused_or_can_be_commanded_within_the_limits(
            linear in uniform3(num::f64::ANY),
            angular in uniform3(num::f64::ANY),
            is_small: bool,
        ) {
            let scaled = |it: f64| if is_small { it % 3.0 } else { it };
            let twist = Twist {
                linear: linear.map(scaled),
                angular: angular.map(scaled),
            };
            if let Ok(velocity) = LIMITS.velocity(&twist) {
                prop_assert!(velocity.forward.abs() <= LIMITS.speed, "{velocity:?}");
                prop_assert!(velocity.yaw_rate.abs() <= LIMITS.yaw_rate, "{velocity:?}");
                prop_assert!(velocity.effort(LIMITS).is_ok(), "{velocity:?}");
                prop_assert!(velocity.command().is_ok(), "{velocity:?}");
            }
        }
    }
}
