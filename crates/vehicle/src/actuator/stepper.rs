//! Pulse timing for a stepper motor, with ramps that respect its acceleration limits.

use std::time::{Duration, Instant};

use super::Command;
use crate::motion::CommandDeadline;

/// Parameters of a stepper motor and its wheel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepperConfig {
    /// Pulses per metre of travel.
    pub steps_per_metre: f64,
    /// The speed at full propulsion, in metres per second.
    pub top: f64,
    /// Maximum acceleration without losing steps, in metres per second squared.
    pub acceleration: f64,
    /// Maximum deceleration without losing steps, in metres per second squared.
    pub deceleration: f64,
    /// The motor ramps down to a stop on its own when its last command is older than this.
    pub deadline: Duration,
}

impl Default for StepperConfig {
    /// 1600 pulses per turn and a wheel of 0.2 m: 2546 pulses/m, 1 m/s, 1 m/s² up and 2 m/s² down,
    /// 200 ms.
    fn default() -> Self {
        Self {
            steps_per_metre: 2546.0,
            top: 1.0,
            acceleration: 1.0,
            deceleration: 2.0,
            deadline: CommandDeadline::DEFAULT,
        }
    }
}

/// Next action for a stepper motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepperPoll {
    /// Send a pulse.
    Step {
        /// Whether the pulse is backwards.
        backwards: bool,
    },
    /// Wait until the given time or the next command.
    Wait(Option<Instant>),
}

/// Computes the pulses of one stepper motor. The ramp is recomputed at each pulse.
///
/// An energised stepper motor holds its position, so a stop is just a ramp down to 0. No brake is
/// needed.
#[derive(Debug, Clone)]
pub struct Stepper {
    config: StepperConfig,
    /// Commanded and current rate in pulses per second, negative backwards.
    wanted: f64,
    rate: f64,
    next: Option<Instant>,
    steps: i64,
}

impl Stepper {
    /// Pulses later than this are not caught up.
    const LATEST: Duration = Duration::from_millis(20);

    /// Creates a motor at rest.
    #[must_use]
    pub const fn new(config: StepperConfig) -> Self {
        Self {
            config,
            wanted: 0.0,
            rate: 0.0,
            next: None,
            steps: 0,
        }
    }

    /// Sets the command until the next one.
    pub fn command(&mut self, command: Command) {
        let command = command.or_stop();
        let share = command.drive.clamp(-1.0, 1.0) * (1.0 - command.brake.clamp(0.0, 1.0));
        let wanted = share * self.config.top * self.config.steps_per_metre;
        // Below 0.1 pulses per second counts as standing still.
        self.wanted = if wanted.abs() < 0.1 { 0.0 } else { wanted };
    }

    /// The same motor at rest, after `steps` pulses.
    pub(super) const fn at_rest(&self, steps: i64) -> Self {
        Self {
            steps,
            ..Self::new(self.config)
        }
    }

    /// Pulses so far. Backward pulses count negative.
    #[must_use]
    pub const fn steps(&self) -> i64 {
        self.steps
    }

    /// The next action at `now`. On `Step` the caller sends a pulse and polls again.
    pub fn poll(&mut self, now: Instant) -> StepperPoll {
        if self.rate == 0.0 {
            self.rate = self.first_rate();
            self.next = self.pause().map(|pause| now + pause);
        }
        let Some(next) = self.next else {
            return StepperPoll::Wait(None);
        };
        if now < next {
            return StepperPoll::Wait(Some(next));
        }
        let backwards = self.rate < 0.0;
        self.steps += if backwards { -1 } else { 1 };
        self.ramp();
        let from = if now > next + Self::LATEST { now } else { next };
        self.next = self.pause().map(|pause| from + pause);
        StepperPoll::Step { backwards }
    }

    /// Converts metres per second squared to pulses per second squared.
    fn per_second_squared(&self, metres: f64) -> f64 {
        metres * self.config.steps_per_metre
    }

    /// Rate of the first pulse from rest: the mean rate while accelerating over one step. 0 if no
    /// motion is commanded.
    fn first_rate(&self) -> f64 {
        let mean = (self.per_second_squared(self.config.acceleration) / 2.0).sqrt();
        self.wanted.clamp(-mean, mean)
    }

    /// Updates the rate after one more pulse.
    fn ramp(&mut self) {
        let slows = self.wanted * self.rate < 0.0 || self.wanted.abs() < self.rate.abs();
        let limit = match slows {
            true => self.config.deceleration,
            false => self.config.acceleration,
        };
        let turns = self.wanted * self.rate < 0.0;
        let goal = if turns { 0.0 } else { self.wanted.abs() };
        // At constant acceleration, the square of the speed changes linearly with distance.
        let change = 2.0 * self.per_second_squared(limit);
        let rate = self.rate.abs();
        let next = match slows {
            true => (rate * rate - change).max(0.0).sqrt().max(goal),
            false => (rate * rate + change).sqrt().min(goal),
        };
        self.rate = next.copysign(self.rate);
    }

    fn pause(&self) -> Option<Duration> {
        (self.rate != 0.0).then(|| Duration::from_secs_f64(1.0 / self.rate.abs()))
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    const AHEAD: Command = Command {
        drive: 1.0,
        brake: 0.0,
    };

    /// Runs in virtual time. Returns the intervals between pulses.
    fn run(stepper: &mut Stepper, now: &mut Instant, seconds: f64) -> Vec<f64> {
        let end = *now + Duration::from_secs_f64(seconds);
        let mut pauses = Vec::new();
        let mut last = *now;
        loop {
            match stepper.poll(*now) {
                StepperPoll::Step { .. } => {
                    pauses.push((*now - last).as_secs_f64());
                    last = *now;
                }
                StepperPoll::Wait(Some(next)) if next <= end => *now = next,
                StepperPoll::Wait(_) => break,
            }
        }
        *now = end;
        pauses
    }

    #[test]
    fn it_reaches_the_speed_that_is_wanted_and_counts_what_it_drives() {
        let mut stepper = Stepper::new(StepperConfig::default());
        let mut now = Instant::now();
        stepper.command(AHEAD);
        let pauses = run(&mut stepper, &mut now, 3.0);
        assert!((1.0 / pauses[pauses.len() - 1] - 2546.0).abs() < 1.0);
        // Half a metre while accelerating, then two more seconds at 1 m/s.
        let metres = stepper.steps() as f64 / 2546.0;
        assert!((metres - 2.5).abs() < 0.02, "{metres}");
    }

    #[test]
    fn it_gets_faster_no_faster_than_it_can() {
        let mut stepper = Stepper::new(StepperConfig::default());
        let mut now = Instant::now();
        stepper.command(AHEAD);
        let pauses = run(&mut stepper, &mut now, 1.5);
        for pair in pauses.windows(2).skip(5) {
            let (before, after) = (1.0 / pair[0], 1.0 / pair[1]);
            let acceleration = (after - before) / pair[1] / 2546.0;
            assert!(acceleration < 1.1, "{acceleration}");
        }
    }

    #[test]
    fn it_stops_on_a_ramp_and_then_wants_nothing() {
        let mut stepper = Stepper::new(StepperConfig::default());
        let mut now = Instant::now();
        stepper.command(AHEAD);
        run(&mut stepper, &mut now, 2.0);
        let before = stepper.steps();
        stepper.command(Command::STOP);
        run(&mut stepper, &mut now, 1.0);
        let metres = (stepper.steps() - before) as f64 / 2546.0;
        assert!((metres - 0.25).abs() < 0.02, "{metres}");
        assert_eq!(stepper.poll(now), StepperPoll::Wait(None));
    }

    #[test]
    fn it_turns_back_through_rest() {
        let mut stepper = Stepper::new(StepperConfig::default());
        let mut now = Instant::now();
        stepper.command(AHEAD);
        run(&mut stepper, &mut now, 2.0);
        stepper.command(Command {
            drive: -1.0,
            brake: 0.0,
        });
        let there = stepper.steps();
        run(&mut stepper, &mut now, 0.5);
        let turn = stepper.steps();
        run(&mut stepper, &mut now, 2.0);
        assert!(turn > there && stepper.steps() < turn);
    }

    #[test]
    fn who_comes_late_does_not_get_a_burst() {
        let mut stepper = Stepper::new(StepperConfig::default());
        let mut now = Instant::now();
        stepper.command(AHEAD);
        run(&mut stepper, &mut now, 2.0);
        now += Duration::from_secs(1);
        assert!(matches!(stepper.poll(now), StepperPoll::Step { .. }));
        assert!(matches!(stepper.poll(now), StepperPoll::Wait(Some(_))));
    }
}
