//! A vehicle: its motors, which go on while its program is dead until their deadline, and its program.

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use jaus::component::{Component, Kind, Management};
use jaus::link::custom::CustomLink;
use jaus::node::{Config, Node};
use jaus::service::{Time, TimeOfDay};
use jaus_vehicle::handoff::Handoff;
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{
    Drive, Frame, Limits, Motion, Pilot, Platform, Pose, SkidSteer, SkidSteerConfig,
};

/// The motors and wheels of a vehicle, in true time.
pub(crate) struct Motors {
    start: Instant,
    now: Duration,
    rover: SkidSteer,
    /// The program that may give orders.
    program: u64,
    order: Drive,
    ordered_at: Duration,
}

/// Which way something moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Forward,
    Backward,
}

#[derive(Clone)]
pub(crate) struct SharedMotors(Arc<Mutex<Motors>>);

impl SharedMotors {
    /// The drives stop without an order for this time.
    const DEADLINE: Duration = Duration::from_millis(200);
    /// The integers of the wire have no exact zero.
    const NOTHING: f64 = 1e-3;

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    pub(crate) fn new() -> Self {
        Self(Arc::new(Mutex::new(Motors {
            start: Instant::now(),
            now: Duration::ZERO,
            rover: SkidSteer::new(SkidSteerConfig::default()),
            program: 0,
            order: Drive::Stop,
            ordered_at: Duration::ZERO,
        })))
    }

    fn lock(&self) -> MutexGuard<'_, Motors> {
        self.0.lock().expect("no panic")
    }

    /// Goes on to `now` of the true time.
    pub(crate) fn advance(&self, now: Duration) {
        let mut motors = self.lock();
        motors.now = now;
        if now > motors.ordered_at + Self::DEADLINE && motors.order != Drive::Stop {
            motors.order = Drive::Stop;
            motors.rover.drive(Drive::Stop);
        }
        let now = motors.start + now;
        motors.rover.handle_time(now);
    }

    /// The order that the motors follow.
    pub(crate) fn order(&self) -> Drive {
        self.lock().order
    }

    /// Which way the motors are driven now; `None` for none. The wheels take a while to follow.
    pub(crate) fn driven(&self) -> Option<Way> {
        let ahead = match self.order() {
            Drive::Stop => 0.0,
            Drive::Velocity(velocity) => velocity.x + velocity.yaw,
            Drive::Effort(effort) => effort.forward + effort.turn,
        };
        match ahead {
            ahead if ahead > Self::NOTHING => Some(Way::Forward),
            ahead if ahead < -Self::NOTHING => Some(Way::Backward),
            _ => None,
        }
    }

    /// Takes the motors from the program that had them.
    pub(crate) fn disconnect(&self) {
        self.lock().program += 1;
    }

    fn connect(&self) -> Wheels {
        let motors = self.lock();
        Wheels {
            program: motors.program,
            motors: self.clone(),
            sample: motors.rover.motion(),
        }
    }
}

/// What a program has of the motors.
struct Wheels {
    program: u64,
    motors: SharedMotors,
    sample: Motion,
}

impl Platform for Wheels {
    fn handle_time(&mut self, now: Instant) {
        // The program dates its samples by its own clock.
        self.sample = Motion {
            sampled_at: Some(now),
            ..self.motors.lock().rover.motion()
        };
    }

    fn motion(&self) -> Motion {
        self.sample
    }

    fn set_pose(&mut self, pose: Pose) {
        self.motors.lock().rover.set_pose(pose);
    }

    fn drive(&mut self, command: Drive) {
        let mut motors = self.motors.lock();
        if motors.program == self.program {
            motors.order = command;
            motors.ordered_at = motors.now;
            motors.rover.drive(command);
        }
    }

    fn limits(&self) -> Limits {
        self.motors.lock().rover.limits()
    }

    fn set_limits(&mut self, limits: Limits) {
        self.motors.lock().rover.set_limits(limits);
    }
}

/// Starts the vehicle's program on the current runtime.
pub(crate) fn start(
    subsystem: u16,
    motors: &SharedMotors,
    time: &TimeOfDay,
    link: Box<dyn CustomLink>,
) {
    let config = Config::new(subsystem, 1).without_udp();
    let node = Node::start_with(config, vec![link]).expect("a node");
    let pilot = Pilot::new(motors.connect(), Frame::at(52.5, 13.4));
    let vehicle = Vehicle::new(pilot).with_clock(time.clone());
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .management(Management::new())
        .offer(Time::new(time.clone()))
        .offer(Handoff::new())
        .offer(vehicle.velocity_state_sensor())
        .offer(vehicle.local_pose_sensor())
        .offer(vehicle.primitive_driver());
    let rover = rover.attach(&node, 1).expect("a free id");
    // Both run until the program is killed.
    tokio::spawn(async move {
        let _running = (node, rover);
        std::future::pending::<()>().await;
    });
}
