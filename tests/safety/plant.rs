//! The vehicle's hardware: it keeps moving while its program hangs or is dead.

use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use jaus_vehicle::motion::{
    Drive, Fence, Limits, Motion, Platform, Pose, SkidSteer, SkidSteerConfig,
};

use crate::positioning::Positioning;

/// Wheels, an actuator that stops without orders, and a pose sensor.
pub(crate) struct Plant {
    now: Instant,
    rover: SkidSteer,
    ordered: Drive,
    /// The program's last order.
    pub(crate) order: Movement,
    /// The actuator's movement: the order, until its deadline.
    pub(crate) actuator: Movement,
    /// The wheels.
    pub(crate) wheels: Movement,
    last_order: Instant,
    /// Distance in metres, forward and backward.
    pub(crate) odometer: f64,
    pub(crate) sensor: Sensor,
    /// What measures the pose on the globe, if the vehicle is driven by it.
    pub(crate) positioning: Option<Positioning>,
    /// The operating zones of the vehicle.
    pub(crate) fence: Fence,
    sample: Motion,
    /// The motors' fault.
    pub(crate) fault: Option<&'static str>,
    /// Whether an order was not finite; the actuator ignores it.
    pub(crate) got_rubbish: bool,
}

/// Whether something moves, and when it last moved.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Movement {
    moves: bool,
    last: Option<Instant>,
}

/// What the pose sensor does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sensor {
    /// It measures whenever it is read.
    Measures,
    /// It keeps its last sample.
    Stalled,
    /// Its samples are not numbers.
    Unknown,
    /// Its samples are three metres and a quarter turn off.
    Displaced,
}

/// The plant, shared by its program and the world.
#[derive(Clone)]
pub(crate) struct SharedPlant(Arc<Mutex<Plant>>);

impl Plant {
    /// The actuator stops after this time without an order.
    pub(crate) const DEADLINE: Duration = Duration::from_millis(200);
    const STEP: Duration = Duration::from_millis(10);
    /// Slower wheels count as at rest, in metres or radians per second.
    const REST: f64 = 0.005;

    /// A plant with this least turning radius in metres; 0 turns on the spot.
    pub(crate) fn new(now: Instant, turning_radius: f64) -> Self {
        let rover = SkidSteer::new(SkidSteerConfig {
            limits: Limits {
                turning_radius,
                ..Limits::default()
            },
            ..SkidSteerConfig::default()
        });
        Self {
            now,
            sample: rover.motion(),
            rover,
            ordered: Drive::Stop,
            order: Movement::default(),
            actuator: Movement::default(),
            wheels: Movement::default(),
            last_order: now,
            odometer: 0.0,
            sensor: Sensor::Measures,
            positioning: None,
            fence: Fence::default(),
            fault: None,
            got_rubbish: false,
        }
    }

    /// Speed in metres per second.
    pub(crate) fn speed(&self) -> f64 {
        self.rover.motion().velocity.x.abs()
    }

    /// Advances to `now`. Only lasting motion counts: an order that is revoked at the same instant
    /// does not.
    pub(crate) fn advance(&mut self, now: Instant) {
        if now <= self.now {
            return;
        }
        self.order.moves_until(now);
        if !self.actuator.moves && !self.wheels.moves {
            self.rover.handle_time(now);
            self.now = now;
        }
        while self.now < now {
            let mut next = now.min(self.now + Self::STEP);
            let deadline = self.last_order + Self::DEADLINE;
            if self.actuator.moves {
                next = next.min(deadline);
            }
            self.turn_wheels(next);
            if self.actuator.moves && next >= deadline {
                self.actuator.moves = false;
                self.rover.drive(Drive::Stop);
            }
        }
        let truth = self.pose();
        if let Some(positioning) = &mut self.positioning {
            positioning.handle_time(now, &truth);
        }
    }

    fn turn_wheels(&mut self, next: Instant) {
        let seconds = next.saturating_duration_since(self.now).as_secs_f64();
        self.rover.handle_time(next);
        self.now = next;
        let velocity = self.rover.motion().velocity;
        self.odometer += velocity.x.abs() * seconds;
        if let Some(positioning) = &mut self.positioning {
            positioning.travel(velocity, seconds);
        }
        self.wheels.moves = velocity.x.abs() > Self::REST || velocity.yaw.abs() > Self::REST;
        self.wheels.moves_until(next);
        self.actuator.moves_until(next);
    }

    /// Processes an order of the program.
    fn drive(&mut self, command: Drive) {
        if !is_finite(&command) {
            self.got_rubbish = true;
            return;
        }
        self.ordered = command;
        self.order.moves = is_motion(&command);
        self.obey();
    }

    /// Gives the actuator the order, for the first time or again.
    fn obey(&mut self) {
        self.last_order = self.now;
        self.rover.drive(self.ordered);
        self.actuator.moves = self.order.moves;
    }

    /// The true pose.
    pub(crate) fn pose(&self) -> Pose {
        self.rover.motion().pose
    }

    fn read_sensor(&mut self, now: Instant) {
        if self.sensor == Sensor::Stalled {
            return;
        }
        let truth = self.rover.motion();
        self.sample = match &self.positioning {
            Some(positioning) => positioning.measure(now, truth),
            None => truth,
        };
        if self.sensor == Sensor::Unknown {
            let pose = &mut self.sample.pose;
            [pose.x, pose.y, pose.yaw] = [f64::NAN; 3];
        }
        if self.sensor == Sensor::Displaced {
            let pose = &mut self.sample.pose;
            pose.y += 3.0;
            pose.yaw += FRAC_PI_2;
        }
    }
}

impl Movement {
    fn moves_until(&mut self, now: Instant) {
        if self.moves {
            self.last = Some(now);
        }
    }

    /// Time of the last movement.
    pub(crate) const fn last(&self) -> Option<Instant> {
        self.last
    }
}

fn is_motion(command: &Drive) -> bool {
    match command {
        Drive::Stop => false,
        Drive::Velocity(velocity) => velocity.x != 0.0 || velocity.yaw != 0.0,
        Drive::Effort(effort) => effort.forward != 0.0 || effort.turn != 0.0,
    }
}

fn is_finite(command: &Drive) -> bool {
    match command {
        Drive::Stop => true,
        Drive::Velocity(velocity) => velocity.x.is_finite() && velocity.yaw.is_finite(),
        Drive::Effort(effort) => effort.forward.is_finite() && effort.turn.is_finite(),
    }
}

impl SharedPlant {
    pub(crate) fn new(now: Instant, turning_radius: f64) -> Self {
        Self(Arc::new(Mutex::new(Plant::new(now, turning_radius))))
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, Plant> {
        self.0.lock().expect("no panic")
    }

    /// Gives an order.
    pub(crate) fn drive(&self, command: Drive) {
        self.lock().drive(command);
    }

    /// Repeats the last order to the actuator.
    pub(crate) fn repeat_order(&self) {
        self.lock().obey();
    }

    pub(crate) fn fault(&self) -> Option<&'static str> {
        self.lock().fault
    }
}

/// The program's view of the plant; code that depends on the library's version is in `vehicle.rs`.
pub(crate) struct Wheels(pub(crate) SharedPlant);

impl Wheels {
    pub(crate) fn read_sensor(&self, now: Instant) {
        let mut plant = self.0.lock();
        plant.advance(now);
        plant.read_sensor(now);
    }

    pub(crate) fn sample(&self) -> Motion {
        self.0.lock().sample
    }

    pub(crate) fn set_pose(&self, pose: Pose) {
        let mut plant = self.0.lock();
        plant.rover.set_pose(pose);
        plant.sample.pose = pose;
    }

    pub(crate) fn limits(&self) -> Limits {
        self.0.lock().rover.limits()
    }

    pub(crate) fn set_limits(&self, limits: Limits) {
        self.0.lock().rover.set_limits(limits);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jaus_vehicle::motion::Effort;

    const FULL: Drive = Drive::Effort(Effort {
        forward: 1.0,
        turn: 0.0,
        brake: 0.0,
        turn_brake: 0.0,
    });

    /// A plant that was ordered to move, after one second without further orders.
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn left_alone() -> (Plant, Instant, Instant) {
        let start = Instant::now();
        let mut plant = Plant::new(start, 0.0);
        plant.drive(FULL);
        let end = start + Duration::from_secs(1);
        plant.advance(end);
        (plant, start, end)
    }

    #[test]
    fn the_actuator_stops_at_its_deadline_though_the_order_stands() {
        let (plant, start, end) = left_alone();
        assert_eq!(plant.actuator.last(), Some(start + Plant::DEADLINE));
        assert_eq!(plant.order.last(), Some(end));
        assert!(plant.odometer > 0.01 && plant.speed() < Plant::REST);
    }

    #[test]
    fn an_order_that_is_repeated_keeps_it_moving_until_it_is_taken_back() {
        let (mut plant, _, mut now) = left_alone();
        for _ in 0..20 {
            plant.obey();
            now += Duration::from_millis(100);
            plant.advance(now);
        }
        assert_eq!(plant.actuator.last(), Some(now));
        plant.drive(Drive::Stop);
        plant.advance(now + Duration::from_secs(3));
        assert_eq!(
            (plant.actuator.last(), plant.order.last()),
            (Some(now), Some(now))
        );
        assert!(plant.speed() < Plant::REST);
    }

    #[test]
    fn what_is_no_number_is_noted_and_not_obeyed() {
        let (mut plant, ..) = left_alone();
        plant.drive(Drive::Effort(Effort {
            forward: f64::NAN,
            ..Effort::default()
        }));
        assert!(plant.got_rubbish && !plant.actuator.moves);
    }
}
