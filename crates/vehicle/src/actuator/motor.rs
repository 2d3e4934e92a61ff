//! A simulated drive: a motor with first-order lag from command to speed, and a brake.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::{Actuator, Command};
use crate::motion::{CommandDeadline, Noise};

/// Parameters of a simulated motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorConfig {
    /// Speed at full propulsion, in metres per second.
    pub top: f64,
    /// Time constant in seconds: the error to the commanded speed falls to about a third in this
    /// time.
    pub response: f64,
    /// Maximum deceleration of the brake, in metres per second squared.
    pub braking: f64,
    /// Standard deviation of the motor's strength, as a fraction of the nominal strength.
    pub noise: f64,
    /// Seed of the noise. The same seed and the same commands give the same travel.
    pub seed: u64,
    /// The motor brakes on its own when its last command is older than this.
    pub deadline: Duration,
}

impl Default for MotorConfig {
    /// The motor of a small rover: 2 m/s, 0.25 s, 4 m/s², no noise, 200 ms.
    fn default() -> Self {
        Self {
            top: 2.0,
            response: 0.25,
            braking: 4.0,
            noise: 0.0,
            seed: 1,
            deadline: CommandDeadline::DEFAULT,
        }
    }
}

/// Injects and clears a fault of a [`SimulatedMotor`] or a
/// [`SimulatedServo`](super::SimulatedServo). Cheap to clone; all clones share one state.
#[derive(Debug, Clone, Default)]
pub struct FaultSwitch(Arc<Mutex<Option<SimulatedFault>>>);

/// What is wrong with a simulated motor or servo.
#[derive(Debug, Clone)]
enum SimulatedFault {
    /// It does not move, and reports why.
    Broken(String),
    /// It multiplies the propulsion, and reports nothing.
    Factor(f64),
    /// It keeps this propulsion, whatever it is commanded, and reports nothing.
    Stuck(f64),
}

impl FaultSwitch {
    /// Sets a fault: the motor no longer turns the wheel but can still brake, and the servo no longer
    /// moves.
    pub fn fail(&self, reason: impl Into<String>) {
        self.set(Some(SimulatedFault::Broken(reason.into())));
    }

    /// Sets a fault that the motor does not report: it turns so many times faster than commanded,
    /// and the wrong way if the factor is negative. It still brakes.
    pub fn multiply(&self, factor: f64) {
        self.set(Some(SimulatedFault::Factor(factor)));
    }

    /// Sets a fault that the motor does not report: it keeps this share of full propulsion, from -1
    /// to 1, whatever it is commanded, and does not brake.
    pub fn stick(&self, drive: f64) {
        self.set(Some(SimulatedFault::Stuck(drive)));
    }

    /// Clears the fault.
    pub fn mend(&self) {
        self.set(None);
    }

    fn set(&self, fault: Option<SimulatedFault>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = fault;
    }

    pub(super) fn fault(&self) -> Option<String> {
        match &*self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(SimulatedFault::Broken(reason)) => Some(reason.clone()),
            _ => None,
        }
    }

    /// What a motor makes of a command.
    fn distort(&self, command: Command) -> Command {
        match &*self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            None => command,
            Some(SimulatedFault::Broken(_)) => Command {
                drive: 0.0,
                ..command
            },
            Some(SimulatedFault::Factor(factor)) => Command {
                drive: command.drive * factor,
                ..command
            },
            Some(SimulatedFault::Stuck(drive)) => Command {
                drive: *drive,
                brake: 0.0,
            },
        }
    }
}

/// A simulated drive, integrated in steps of at most [`STEP`](Self::STEP).
#[derive(Debug, Clone)]
pub struct SimulatedMotor {
    config: MotorConfig,
    command: Command,
    deadline: CommandDeadline,
    switch: FaultSwitch,
    speed: f64,
    travel: f64,
    unevenness: f64,
    noise: Noise,
    time: Option<Instant>,
}

impl SimulatedMotor {
    /// The longest step of the integration.
    pub const STEP: Duration = Duration::from_millis(10);
    /// The longest time simulated in one call. Longer gaps are truncated.
    pub const LONGEST_GAP: Duration = Duration::from_millis(100);
    /// Decay rate of the noise, per second.
    const CHANGE: f64 = 2.0;

    /// Creates a motor at rest.
    #[must_use]
    pub fn new(config: MotorConfig) -> Self {
        Self {
            config,
            command: Command::STOP,
            deadline: CommandDeadline::new(config.deadline),
            switch: FaultSwitch::default(),
            speed: 0.0,
            travel: 0.0,
            unevenness: 0.0,
            noise: Noise::new(config.seed),
            time: None,
        }
    }

    /// The switch that injects faults into this motor.
    #[must_use]
    pub fn fault_switch(&self) -> FaultSwitch {
        self.switch.clone()
    }

    fn step(&mut self, command: Command, seconds: f64) {
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
            self.unevenness = self.unevenness * keep + spread * self.noise.normal();
        }
        let before = self.speed;
        let wanted = command.drive.clamp(-1.0, 1.0) * top * (1.0 + self.unevenness);
        // Exact solution of the lag, so the result does not depend on the step length.
        self.speed += (wanted - self.speed) * (1.0 - (-seconds / response).exp());
        let braked = braking * command.brake.clamp(0.0, 1.0) * seconds;
        self.speed -= self.speed.clamp(-braked, braked);
        self.travel += (before + self.speed) / 2.0 * seconds;
    }
}

impl Actuator for SimulatedMotor {
    fn handle_time(&mut self, now: Instant) {
        let since = now.saturating_duration_since(self.time.unwrap_or(now));
        self.time = Some(self.time.map_or(now, |time| time.max(now)));
        if self.deadline.has_passed(now) {
            self.command = Command::STOP;
        }
        let command = self.switch.distort(self.command);
        let mut left = since.min(Self::LONGEST_GAP);
        while !left.is_zero() {
            let step = left.min(Self::STEP);
            self.step(command, step.as_secs_f64());
            left -= step;
        }
    }

    fn command(&mut self, command: Command) {
        self.command = command.or_stop();
        self.deadline.restart(self.time);
    }

    fn travel(&self) -> f64 {
        self.travel
    }

    fn fault(&self) -> Option<String> {
        self.switch.fault()
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    /// Travel and speed after repeating a command for `seconds`.
    fn driven(motor: &mut SimulatedMotor, command: Command, seconds: f64) -> (f64, f64) {
        motor.command(command);
        let start = motor.time.unwrap_or_else(Instant::now);
        for step in 0..=(seconds * 50.0) as u32 {
            motor.command(command);
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
    fn it_stops_by_itself_when_commands_are_not_repeated() {
        let mut motor = SimulatedMotor::new(MotorConfig::default());
        driven(&mut motor, AHEAD, 2.0);
        let last = motor.time.unwrap();
        let mut now = last;
        let step = Duration::from_millis(10);
        // The last command was sent one clock step earlier.
        while now < last + CommandDeadline::DEFAULT - 2 * step {
            now += step;
            motor.handle_time(now);
        }
        assert!(motor.speed > 1.9, "still within the deadline");
        // It brakes with 4 m/s².
        for _ in 0..53 {
            now += step;
            motor.handle_time(now);
        }
        assert!(motor.speed.abs() < 1e-6, "{}", motor.speed);
        let travel = motor.travel;
        motor.handle_time(now + step);
        assert_eq!(motor.travel.to_bits(), travel.to_bits());
    }

    #[test]
    fn a_broken_motor_turns_no_wheel_and_brakes() {
        let mut motor = SimulatedMotor::new(MotorConfig::default());
        let switch = motor.fault_switch();
        switch.fail("no current");
        assert_eq!(driven(&mut motor, AHEAD, 1.0), (0.0, 0.0));
        assert_eq!(motor.fault().as_deref(), Some("no current"));
        switch.mend();
        assert!(driven(&mut motor, AHEAD, 1.0).1 > 1.9);
    }

    #[test]
    fn a_command_that_is_no_number_stops_it() {
        let mut motor = SimulatedMotor::new(MotorConfig::default());
        let unknown = Command {
            drive: f64::NAN,
            brake: 0.0,
        };
        driven(&mut motor, AHEAD, 1.0);
        assert!(driven(&mut motor, unknown, 1.0).1.abs() < 1e-6);
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
