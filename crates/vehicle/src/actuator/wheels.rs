//! The platform on wheels, whatever drives and steers them, and its odometer.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::{Actuator, Interlock, SideDrives, SteeredDrive, Steering};
use crate::motion::{
    Acceleration, Ackermann, DeadReckoning, Drive, Effort, Limits, Motion, Platform, Pose,
    Velocity, WheelCount,
};

/// Parameters of a platform on wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelsConfig {
    /// Effective distance between left and right wheels in turns, in metres.
    pub track: f64,
    /// Speed of a drive at full propulsion, in metres per second.
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

/// The drives of a platform, and its steering if it has one.
pub trait Drivetrain: Send {
    /// Advances to time `now`: a simulation integrates, real hardware is read back.
    fn handle_time(&mut self, now: Instant);

    /// Moves with a velocity along and about the platform's axes.
    fn drive(&mut self, velocity: Velocity);

    /// Moves with an effort. Full effort commands the speeds of the limits.
    fn push(&mut self, effort: Effort, limits: &Limits);

    /// Stops as fast as the brakes allow.
    fn stop(&mut self);

    /// Distance travelled by the left and the right wheels since creation, in metres.
    fn travel(&self) -> (f64, f64);

    /// The fault of any drive or of the steering, as text for the operator.
    fn fault(&self) -> Option<String>;
}

/// A platform on wheels. A fault of any part of its drivetrain stops all of it, since a single drive
/// would turn the vehicle.
///
/// Its only sensor is the wheel odometry, so its pose is dead reckoning.
pub struct Wheels<T> {
    drivetrain: T,
    config: WheelsConfig,
    limits: Limits,
    odometer: Odometer,
    reckoning: DeadReckoning,
    motion: Motion,
    /// Start of the counter, and time of the last reading.
    times: Option<(Instant, Instant)>,
    interlock: Interlock,
}

impl<A: Actuator> Wheels<SideDrives<A>> {
    /// Creates a platform at rest with one drive on each side, steered by the speed difference.
    #[must_use]
    pub fn new(left: A, right: A, config: WheelsConfig, odometer: Odometer) -> Self {
        Self::with(SideDrives::new(left, right, &config), config, odometer)
    }
}

impl<A: Actuator, S: Steering> Wheels<SteeredDrive<A, S>> {
    /// Creates a platform at rest with one drive and steered front wheels. The geometry determines
    /// the turning radius of its limits.
    #[must_use]
    pub fn steered(
        drive: A,
        steering: S,
        mut config: WheelsConfig,
        geometry: Ackermann,
        odometer: Odometer,
    ) -> Self {
        let least = geometry.turning_radius();
        config.limits.turning_radius = config.limits.turning_radius.max(least);
        let drivetrain = SteeredDrive::new(drive, steering, &config, geometry);
        Self::with(drivetrain, config, odometer)
    }
}

impl<T: Drivetrain> Wheels<T> {
    fn with(drivetrain: T, config: WheelsConfig, odometer: Odometer) -> Self {
        odometer.lock().count.track = config.track;
        Self {
            drivetrain,
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

    /// Whether the platform must stand still, whatever the command.
    fn is_locked(&self) -> bool {
        self.interlock.is_open() || self.fault().is_some()
    }

    fn read(&mut self, now: Instant) {
        let (began, last) = self.times.unwrap_or((now, now));
        self.times = Some((began, now));
        let fault = self.fault();
        let milliseconds = now.saturating_duration_since(began).as_millis();
        let count = {
            let mut reading = self.odometer.lock();
            reading.fault = fault;
            (reading.count.left, reading.count.right) = self.drivetrain.travel();
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

impl<T: Drivetrain> Platform for Wheels<T> {
    fn handle_time(&mut self, now: Instant) {
        self.drivetrain.handle_time(now);
        if self.is_locked() {
            self.drivetrain.stop();
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
            _ if self.is_locked() => self.drivetrain.stop(),
            Drive::Stop => self.drivetrain.stop(),
            Drive::Velocity(velocity) => self.drivetrain.drive(self.limits.clamp(velocity)),
            Drive::Effort(effort) => self.drivetrain.push(effort, &self.limits),
        }
    }

    fn limits(&self) -> Limits {
        self.config.limits
    }

    fn set_limits(&mut self, limits: Limits) {
        self.limits = limits.and(&self.config.limits);
    }

    fn fault(&self) -> Option<String> {
        self.drivetrain.fault()
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
    use crate::actuator::{FaultSwitch, MotorConfig, SimulatedMotor, SimulatedServo};
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
            let mut drive = |wheels: &mut Wheels<SideDrives<SimulatedMotor>>, seconds: f64| {
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

    /// What breaks a drive.
    type Break = fn(&FaultSwitch);

    /// Breaks a drive in different ways while the vehicle drives. Each is found; returns the travel of
    /// both sides since then.
    fn breaks<T: Drivetrain + 'static>(
        make: impl Fn(Odometer) -> (Wheels<T>, FaultSwitch),
    ) -> Vec<(f64, f64)> {
        let faults: [(Break, &str); 3] = [
            (|it| it.stick(0.5), "without a command"),
            (|it| it.multiply(-1.0), "the wrong way"),
            (|it| it.multiply(4.0), "faster than commanded"),
        ];
        let travel_after = |(fault, says): (Break, &str)| {
            let odometer = Odometer::new(7);
            let (wheels, switch) = make(odometer.clone());
            let mut pilot = Pilot::new(wheels, Frame::default());
            let start = Instant::now();
            pilot.handle_time(start);
            pilot.pursue(effort(0.3, 0.0));
            let now = run(&mut pilot, start, 2.0);
            assert_eq!(odometer.fault(), None);
            fault(&switch);
            if says == "without a command" {
                pilot.stop();
            }
            let now = run(&mut pilot, now, 1.8);
            let told = odometer.fault().unwrap_or_default();
            assert!(told.contains(says), "{told}");
            let before = odometer.count();
            run(&mut pilot, now, 0.5);
            let after = odometer.count();
            (after.left - before.left, after.right - before.right)
        };
        faults.into_iter().map(travel_after).collect()
    }

    fn motor(seed: u64) -> SimulatedMotor {
        SimulatedMotor::new(MotorConfig {
            seed,
            ..MotorConfig::default()
        })
    }

    #[test]
    fn motion_without_a_command_of_either_side_is_a_fault_that_stops_the_other() {
        for left_breaks in [true, false] {
            let travel = breaks(|odometer| {
                let (left, right) = (motor(1), motor(2));
                let switch = match left_breaks {
                    true => left.fault_switch(),
                    false => right.fault_switch(),
                };
                let config = WheelsConfig::default();
                (Wheels::new(left, right, config, odometer), switch)
            });
            for (left, right) in travel {
                let other = if left_breaks { right } else { left };
                assert!(other.abs() < 1e-3, "{other} m");
            }
        }
    }

    #[test]
    fn motion_without_a_command_of_the_only_drive_is_a_fault() {
        let found = breaks(|odometer| {
            let drive = motor(1);
            let switch = drive.fault_switch();
            let servo = SimulatedServo::new(SimulatedServo::RATE);
            let geometry = Ackermann::default();
            let config = WheelsConfig::default();
            let wheels = Wheels::steered(drive, servo, config, geometry, odometer);
            (wheels, switch)
        });
        assert_eq!(found.len(), 3);
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
