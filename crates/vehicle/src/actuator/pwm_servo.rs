//! A steering servo on a PWM output of Linux: the pulse length sets the angle.

use std::time::{Duration, Instant};

use super::{PwmOutput, SimulatedServo, Steering};

/// Parameters of a steering servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoConfig {
    /// Pulse length straight ahead.
    pub centre: Duration,
    /// Change of the pulse length at the largest angle to the right, in microseconds. Negative for a
    /// servo that is mounted the other way.
    pub swing: i32,
    /// Largest steering angle to either side in radians.
    pub max_angle: f64,
    /// How fast the servo turns, in radians per second.
    pub rate: f64,
}

/// A steering servo on a PWM output. Dropping it ends the pulses, so the servo goes limp.
///
/// The servo does not report its angle. It is estimated from the commands and the rate.
#[derive(Debug)]
pub struct PwmServo {
    output: PwmOutput,
    config: ServoConfig,
    /// Estimates the angle.
    model: SimulatedServo,
    /// The angle to turn to, in radians.
    setpoint: f64,
    fault: Option<String>,
}

impl PwmServo {
    /// Interval between two pulses, as servos expect.
    pub const PERIOD: Duration = Duration::from_millis(20);

    /// A servo on an output with [its interval](Self::PERIOD), which it steers straight ahead.
    #[must_use]
    pub fn new(output: PwmOutput, config: ServoConfig) -> Self {
        let mut servo = Self {
            output,
            config,
            model: SimulatedServo::new(config.rate),
            setpoint: 0.0,
            fault: None,
        };
        servo.steer(0.0);
        servo
    }

    /// The pulse length for the angle to turn to, in nanoseconds.
    fn pulse(&self) -> u64 {
        let share = (self.setpoint / self.config.max_angle).clamp(-1.0, 1.0);
        let swing = share * f64::from(self.config.swing) * 1000.0;
        (self.config.centre.as_nanos() as f64 + swing).max(0.0) as u64
    }
}

impl Steering for PwmServo {
    /// While the output cannot be written, each call tries again.
    fn handle_time(&mut self, now: Instant) {
        if self.fault.is_some() {
            self.steer(self.setpoint);
        }
        self.model.handle_time(now);
    }

    fn steer(&mut self, angle: f64) {
        if !angle.is_finite() {
            return;
        }
        self.setpoint = angle;
        match self.output.set_pulse(self.pulse()) {
            Ok(()) => {
                self.fault = None;
                self.model.steer(angle);
            }
            Err(error) => self.fault = Some(format!("cannot set the steering servo: {error}")),
        }
    }

    fn angle(&self) -> f64 {
        self.model.angle()
    }

    fn fault(&self) -> Option<String> {
        self.fault.clone()
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    use std::fs;

    use crate::actuator::pwm_output::tests::Chip;

    fn servo(chip: &Chip) -> PwmServo {
        let output = PwmOutput::open(&chip.0, 3, PwmServo::PERIOD).unwrap();
        PwmServo::new(output, CONFIG)
    }

    const CONFIG: ServoConfig = ServoConfig {
        centre: Duration::from_micros(1500),
        swing: 400,
        max_angle: 0.5,
        rate: 2.0,
    };

    #[test]
    fn the_pulse_follows_the_angle_and_ends_with_the_servo() {
        let chip = Chip::new("angle", &[3]);
        let mut servo = servo(&chip);
        assert_eq!(chip.read(3, "period"), 20_000_000);
        for (angle, pulse) in [(0.0, 1_500_000), (0.5, 1_900_000), (-9.0, 1_100_000)] {
            servo.steer(angle);
            assert_eq!(
                (chip.read(3, "duty_cycle"), chip.read(3, "enable")),
                (pulse, 1)
            );
        }
        servo.steer(f64::NAN);
        assert_eq!(chip.read(3, "duty_cycle"), 1_100_000, "it keeps its angle");
        drop(servo);
        assert_eq!(chip.read(3, "enable"), 0);
    }

    #[test]
    fn the_angle_takes_the_time_that_the_servo_needs() {
        let chip = Chip::new("rate", &[3]);
        let mut servo = servo(&chip);
        let start = Instant::now();
        servo.handle_time(start);
        servo.steer(0.5);
        servo.handle_time(start + Duration::from_millis(100));
        assert!((servo.angle() - 0.2).abs() < 1e-9, "{}", servo.angle());
    }

    #[test]
    fn an_output_that_is_gone_is_a_fault_until_it_is_back() {
        let chip = Chip::new("gone", &[3]);
        let mut servo = servo(&chip);
        let (here, away) = (chip.0.join("pwm3"), chip.0.join("away"));
        fs::rename(&here, &away).unwrap();
        servo.steer(0.1);
        assert!(
            servo
                .fault()
                .unwrap()
                .contains("cannot set the steering servo")
        );
        fs::rename(&away, &here).unwrap();
        servo.handle_time(Instant::now());
        assert_eq!(servo.fault(), None);
    }
}
