//! The differential-drive platform of two drives, and its odometer.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::{Actuator, Command, Interlock};
use crate::motion::{Acceleration, Drive, Effort, Limits, Motion, Platform, Pose, Velocity};
use crate::motion::{DeadReckoning, WheelCount};

/// Parameters of a platform with two drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelsConfig {
    /// Effective distance between left and right wheels in turns, in metres.
    pub track: f64,
    /// Speed of each side at full propulsion, in metres per second.
    pub top: f64,
    /// Limits of the platform. Full forward effort commands the maximum speed, full backward effort
    /// the reverse speed, full turning effort the yaw rate.
    pub limits: Limits,
}

impl Default for WheelsConfig {
    /// A small rover with a track of 0.5 m.
    fn default() -> Self {
        Self {
            track: 0.5,
            top: 2.0,
            limits: Limits::default(),
        }
    }
}

/// Distance travelled by the wheels of a platform. Cheap to clone; all clones share one state.
#[derive(Debug, Clone)]
pub struct Odometer(Arc<Mutex<Reading>>);

#[derive(Debug)]
struct Reading {
    count: WheelCount,
    fault: Option<String>,
}

impl Odometer {
    /// Creates an odometer at 0. Choose `start` at random: it identifies this odometer run.
    #[must_use]
    pub fn new(start: u32) -> Self {
        let count = WheelCount {
            start,
            ..WheelCount::default()
        };
        Self(Arc::new(Mutex::new(Reading { count, fault: None })))
    }

    /// The count at the last time update of the platform.
    #[must_use]
    pub fn count(&self) -> WheelCount {
        self.lock().count
    }

    /// The fault of the drives, if any.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        self.lock().fault.clone()
    }

    fn lock(&self) -> MutexGuard<'_, Reading> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A platform with one drive on each side, steered by the speed difference.
///
/// Its only sensor is the wheel odometry, so its pose is dead reckoning.
pub struct Wheels<A> {
    left: A,
    right: A,
    config: WheelsConfig,
    limits: Limits,
    odometer: Odometer,
    reckoning: DeadReckoning,
    motion: Motion,
    /// Start of the counter, and time of the last reading.
    times: Option<(Instant, Instant)>,
    interlock: Interlock,
}

impl<A: Actuator> Wheels<A> {
    /// Creates a platform at rest.
    #[must_use]
    pub fn new(left: A, right: A, config: WheelsConfig, odometer: Odometer) -> Self {
        odometer.lock().count.track = config.track;
        Self {
            left,
            right,
            config,
            limits: config.limits,
            odometer,
            reckoning: DeadReckoning::at(Pose::default()),
            motion: Motion::default(),
            times: None,
            interlock: Interlock::default(),
        }
    }

    /// Adds an interlock that holds the platform at rest while open.
    #[must_use]
    pub fn with_interlock(mut self, interlock: Interlock) -> Self {
        self.interlock = interlock;
        self
    }

    /// Whether both sides must stand still, whatever the command.
    fn is_locked(&self) -> bool {
        self.interlock.is_open() || self.fault().is_some()
    }

    /// Drives both sides at speeds in metres per second. If one side exceeds its top speed, both
    /// slow down so that the curvature is preserved.
    fn drive_at(&mut self, velocity: Velocity, brake: f64) {
        let lead = velocity.yaw * self.config.track / 2.0;
        let sides = [velocity.x + lead, velocity.x - lead].map(|speed| speed / self.config.top);
        let most = sides.iter().fold(1.0_f64, |most, it| most.max(it.abs()));
        let [left, right] = sides.map(|share| Command {
            drive: share / most,
            brake,
        });
        self.command(left, right);
    }

    /// Commands both sides. A fault on one side stops both, since a single drive would turn the
    /// vehicle.
    fn command(&mut self, left: Command, right: Command) {
        let locked = self.is_locked();
        let [left, right] = [left, right].map(|it| if locked { Command::STOP } else { it });
        self.left.command(left);
        self.right.command(right);
    }

    fn push(&mut self, effort: Effort) {
        let Limits {
            speed,
            reverse,
            yaw_rate,
            ..
        } = self.limits;
        let along = if effort.forward < 0.0 { reverse } else { speed };
        let velocity = Velocity::forward(
            effort.forward.clamp(-1.0, 1.0) * along,
            effort.turn.clamp(-1.0, 1.0) * yaw_rate,
        );
        self.drive_at(velocity, effort.brake.max(effort.turn_brake));
    }

    fn read(&mut self, now: Instant) {
        let (began, last) = self.times.unwrap_or((now, now));
        self.times = Some((began, now));
        let fault = self.fault();
        let milliseconds = now.saturating_duration_since(began).as_millis();
        let count = {
            let mut reading = self.odometer.lock();
            reading.fault = fault;
            reading.count.left = self.left.travel();
            reading.count.right = self.right.travel();
            // Wraps to 0 after 49 days, as specified for the report.
            reading.count.time_ms = milliseconds as u32;
            reading.count
        };
        let seconds = now.saturating_duration_since(last).as_secs_f64();
        let gone = self.reckoning.handle_count(count);
        if seconds > 0.0 {
            let before = self.motion.velocity;
            let velocity = Velocity::forward(gone.forward / seconds, gone.turn / seconds);
            self.motion.velocity = velocity;
            self.motion.acceleration = Acceleration {
                x: (velocity.x - before.x) / seconds,
                y: velocity.x * velocity.yaw,
                yaw: (velocity.yaw - before.yaw) / seconds,
                ..Acceleration::default()
            };
        }
        self.motion.pose = self.reckoning.pose();
        self.motion.sampled_at = Some(now);
    }
}

impl<A: Actuator> Platform for Wheels<A> {
    fn handle_time(&mut self, now: Instant) {
        self.left.handle_time(now);
        self.right.handle_time(now);
        if self.is_locked() {
            self.command(Command::STOP, Command::STOP);
        }
        self.read(now);
    }

    fn motion(&self) -> Motion {
        self.motion
    }

    fn set_pose(&mut self, pose: Pose) {
        self.reckoning.set_pose(pose);
        self.motion.pose = self.reckoning.pose();
    }

    fn drive(&mut self, command: Drive) {
        match command.or_stop() {
            Drive::Stop => self.command(Command::STOP, Command::STOP),
            Drive::Velocity(velocity) => self.drive_at(self.limits.clamp(velocity), 0.0),
            Drive::Effort(effort) => self.push(effort),
        }
    }

    fn limits(&self) -> Limits {
        self.config.limits
    }

    fn set_limits(&mut self, limits: Limits) {
        self.limits = limits.and(&self.config.limits);
    }

    fn fault(&self) -> Option<String> {
        self.left.fault().or_else(|| self.right.fault())
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::actuator::{MotorConfig, SimulatedMotor};
    use crate::motion::{Frame, Goal, Pilot};

    fn rover() -> (Pilot, Odometer) {
        let motor = || SimulatedMotor::new(MotorConfig::default());
        let odometer = Odometer::new(7);
        let wheels = Wheels::new(motor(), motor(), WheelsConfig::default(), odometer.clone());
        (Pilot::new(wheels, Frame::default()), odometer)
    }

    fn run(pilot: &mut Pilot, start: Instant, seconds: f64) -> Instant {
        let end = start + Duration::from_secs_f64(seconds);
        let mut now = start;
        while now < end {
            now += Pilot::STEP;
            pilot.handle_time(now);
        }
        now
    }

    fn effort(forward: f64, turn: f64) -> Goal {
        Goal::Effort(Effort {
            forward,
            turn,
            ..Effort::default()
        })
    }

    #[test]
    fn full_effort_reaches_full_speed_and_full_yaw_rate() {
        let (mut pilot, odometer) = rover();
        let start = Instant::now();
        pilot.handle_time(start);
        pilot.pursue(effort(1.0, 0.0));
        let now = run(&mut pilot, start, 3.0);
        assert!((pilot.motion().velocity.x - 2.0).abs() < 0.01);
        pilot.pursue(effort(0.0, 1.0));
        run(&mut pilot, now, 3.0);
        assert!((pilot.motion().velocity.yaw - 1.5).abs() < 0.01);
        let count = odometer.count();
        assert!(count.left > count.right, "it turns to the right");
        assert_eq!((count.start, count.track), (7, 0.5));
    }

    #[test]
    fn without_a_goal_it_stops() {
        let (mut pilot, _) = rover();
        let start = Instant::now();
        pilot.handle_time(start);
        pilot.pursue(effort(1.0, 0.2));
        let now = run(&mut pilot, start, 2.0);
        pilot.stop();
        run(&mut pilot, now, 2.0);
        assert!(pilot.is_at_rest());
    }

    #[test]
    fn full_effort_backwards_keeps_the_reverse_limit() {
        let (mut pilot, _) = rover();
        let start = Instant::now();
        pilot.handle_time(start);
        pilot.pursue(effort(-1.0, 0.0));
        run(&mut pilot, start, 3.0);
        let speed = pilot.motion().velocity.x;
        assert!((speed + Limits::default().reverse).abs() < 0.01, "{speed}");
    }

    #[test]
    fn a_fault_on_one_side_stops_both_until_it_is_gone() {
        let [left, right] = [1, 2].map(|seed| {
            SimulatedMotor::new(MotorConfig {
                seed,
                ..MotorConfig::default()
            })
        });
        for switch in [left.fault_switch(), right.fault_switch()] {
            let wheels = [left.clone(), right.clone()];
            let [left, right] = wheels;
            let odometer = Odometer::new(7);
            let mut wheels = Wheels::new(left, right, WheelsConfig::default(), odometer.clone());
            let forward = Drive::Velocity(Velocity::forward(1.0, 0.0));
            let mut now = Instant::now();
            let mut drive = |wheels: &mut Wheels<SimulatedMotor>, seconds: f64| {
                let end = now + Duration::from_secs_f64(seconds);
                while now < end {
                    now += Pilot::STEP;
                    wheels.drive(forward);
                    wheels.handle_time(now);
                }
                wheels.motion().velocity
            };
            assert!(drive(&mut wheels, 2.0).x > 0.9);
            switch.fail("no current");
            drive(&mut wheels, 0.6);
            assert_eq!(wheels.fault().as_deref(), Some("no current"));
            assert_eq!(odometer.fault().as_deref(), Some("no current"));
            let before = odometer.count();
            drive(&mut wheels, 1.0);
            let after = odometer.count();
            assert!(
                (after.left - before.left).abs() < 1e-6,
                "the left side stands"
            );
            assert!(
                (after.right - before.right).abs() < 1e-6,
                "the right side stands"
            );
            switch.mend();
            assert!(drive(&mut wheels, 2.0).x > 0.9, "it works again");
        }
    }

    #[test]
    fn a_drive_command_that_is_no_number_stops_both_sides() {
        let (mut pilot, _) = rover();
        let start = Instant::now();
        pilot.handle_time(start);
        pilot.pursue(effort(1.0, 0.0));
        let now = run(&mut pilot, start, 2.0);
        pilot.pursue(effort(f64::NAN, 0.0));
        run(&mut pilot, now, 2.0);
        assert!(pilot.motion().velocity.is_rest());
    }
}
