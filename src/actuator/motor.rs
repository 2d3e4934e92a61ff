//! A simulated drive: a motor whose speed follows its voltage after a moment, and a brake.

use std::time::{Duration, Instant};

use super::{Actuator, Command};
use crate::vehicle::Random;

/// How a simulated motor behaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorConfig {
    /// The speed that it reaches at full propulsion, in metres per second.
    pub top: f64,
    /// After how many seconds it has come within a third of the speed that it is driven to.
    pub response: f64,
    /// What its brake does at most, in metres per second squared.
    pub braking: f64,
    /// How uneven it is: the standard deviation of its strength, as a share of it.
    pub noise: f64,
    /// Where the unevenness comes from: the same seed and the same commands give the same travel.
    pub seed: u64,
}

impl Default for MotorConfig {
    /// The motor of a small rover: 2 m/s, a quarter of a second, 4 m/s², even.
    fn default() -> Self {
        Self {
            top: 2.0,
            response: 0.25,
            braking: 4.0,
            noise: 0.0,
            seed: 1,
        }
    }
}

/// A simulated drive, integrated in steps of at most [`STEP`](Self::STEP).
#[derive(Debug, Clone)]
pub struct SimulatedMotor {
    config: MotorConfig,
    command: Command,
    speed: f64,
    travel: f64,
    unevenness: f64,
    random: Random,
    time: Option<Instant>,
}

impl SimulatedMotor {
    /// The longest step of the integration.
    pub const STEP: Duration = Duration::from_millis(10);
    /// The longest time that is made up for at once.
    pub const LONGEST_GAP: Duration = Duration::from_millis(100);
    /// How fast unevenness forgets, per second.
    const CHANGE: f64 = 2.0;

    /// A motor at rest.
    #[must_use]
    pub const fn new(config: MotorConfig) -> Self {
        Self {
            config,
            command: Command::STOP,
            speed: 0.0,
            travel: 0.0,
            unevenness: 0.0,
            random: Random::new(config.seed),
            time: None,
        }
    }

    fn step(&mut self, seconds: f64) {
        let MotorConfig {
            top,
            response,
            braking,
            noise,
            ..
        } = self.config;
        if noise > 0.0 {
            let keep = (-Self::CHANGE * seconds).exp();
            let spread = noise * (1.0 - keep * keep).sqrt();
            self.unevenness = self.unevenness * keep + spread * self.random.normal();
        }
        let before = self.speed;
        let wanted = self.command.drive.clamp(-1.0, 1.0) * top * (1.0 + self.unevenness);
        // Exactly what the lag does in this time, so that the length of the steps does not matter.
        self.speed += (wanted - self.speed) * (1.0 - (-seconds / response).exp());
        let braked = braking * self.command.brake.clamp(0.0, 1.0) * seconds;
        self.speed -= self.speed.clamp(-braked, braked);
        self.travel += (before + self.speed) / 2.0 * seconds;
    }
}

impl Actuator for SimulatedMotor {
    fn handle_time(&mut self, now: Instant) {
        let since = now.saturating_duration_since(self.time.unwrap_or(now));
        self.time = Some(self.time.map_or(now, |time| time.max(now)));
        let mut left = since.min(Self::LONGEST_GAP);
        while !left.is_zero() {
            let step = left.min(Self::STEP);
            self.step(step.as_secs_f64());
            left -= step;
        }
    }

    fn command(&mut self, command: Command) {
        self.command = command;
    }

    fn travel(&self) -> f64 {
        self.travel
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "any moment will do as the beginning of virtual time"
)]
mod tests {
    use super::*;

    /// Travel and speed after a command of so many seconds.
    fn driven(motor: &mut SimulatedMotor, command: Command, seconds: f64) -> (f64, f64) {
        motor.command(command);
        let start = motor.time.unwrap_or_else(Instant::now);
        for step in 0..=(seconds * 50.0) as u32 {
            motor.handle_time(start + Duration::from_millis(20) * step);
        }
        (motor.travel, motor.speed)
    }

    const AHEAD: Command = Command {
        drive: 1.0,
        brake: 0.0,
    };

    #[test]
    fn it_comes_up_to_its_speed_and_stops_when_braked() {
        let mut motor = SimulatedMotor::new(MotorConfig::default());
        let (_, speed) = driven(&mut motor, AHEAD, 2.0);
        assert!((speed - 2.0).abs() < 0.01, "{speed}");
        let (_, speed) = driven(&mut motor, Command::STOP, 1.0);
        assert!(speed.abs() < 1e-6, "{speed}");
    }

    #[test]
    fn backwards_is_the_same_as_forwards_with_another_sign() {
        let there = driven(&mut SimulatedMotor::new(MotorConfig::default()), AHEAD, 1.0);
        let back = Command {
            drive: -1.0,
            ..AHEAD
        };
        let back = driven(&mut SimulatedMotor::new(MotorConfig::default()), back, 1.0);
        assert!((there.0 + back.0).abs() < 1e-9);
    }

    #[test]
    fn an_uneven_motor_is_uneven_in_the_same_way_for_the_same_seed() {
        let run = |seed| {
            let config = MotorConfig {
                noise: 0.1,
                seed,
                ..MotorConfig::default()
            };
            driven(&mut SimulatedMotor::new(config), AHEAD, 3.0).0
        };
        assert_eq!(run(5).to_bits(), run(5).to_bits());
        assert!((run(5) - run(6)).abs() > 1e-6);
    }
}
