//! The vehicle's program: creates a component and its services. No other file of this test depends
//! on the library's API.

use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received};
use jaus::messages::mobility::{QueryWrenchEffort, SetWrenchEffort, primitive_driver};
use jaus::service::{
    Condition, Discovery, Handlers, Kind, Liveness, Management, MotionPolicy, Profile, Scope,
    Service, Stack, Standing, State, StopCause, Time, TimeOfDay, Timing,
};
use jaus_vehicle::mobility;
use jaus_vehicle::motion::{Drive, Effort, Limits, Motion, Pilot, Platform, Pose};

use crate::cell::{Cell, Driver, Fault};
use crate::plant::{SharedPlant, Wheels};
use crate::positioning::FRAME;
use crate::sim::WallClock;

pub(crate) const VEHICLE: JausId = JausId::new(101, 1, 1);

/// A component that drives the plant.
pub(crate) struct Program {
    stack: Stack,
    plant: SharedPlant,
    /// When the own service's loop runs next.
    next: Option<Instant>,
}

impl Program {
    /// The interval of the own service's loop.
    const LOOP: Duration = Duration::from_millis(20);

    pub(crate) fn new(
        now: Instant,
        cell: Cell,
        plant: &SharedPlant,
        clock: WallClock,
        seed: u64,
    ) -> Self {
        let is_own = cell.driver == Driver::Own;
        let time = TimeOfDay::new(move || clock.since_1970());
        let mut services: Vec<Box<dyn Service>> = vec![Box::new(Liveness::new())];
        if is_own {
            services.push(Box::new(own_service(plant)));
        } else {
            services.extend(drivers(plant, &time, cell));
        }
        services.push(Box::new(Time::new(time)));
        let profile = Profile::new(Kind::Vehicle, "Rover");
        let discovery = Discovery::new(VEHICLE, profile, Scope::System, Timing::default(), seed);
        let mut stack = Stack::new(discovery, services).management(Management::new());
        stack.start(now);
        Self {
            stack,
            plant: plant.clone(),
            next: is_own.then_some(now),
        }
    }

    pub(crate) fn handle_message(&mut self, now: Instant, message: &Received) {
        self.stack.handle_message(now, message);
    }

    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        if self.next.is_some_and(|next| next <= now) {
            self.next = Some(now + Self::LOOP);
            self.run_own_loop(now);
        }
        self.stack.handle_timeout(now);
    }

    /// The application's duties for a motor beside its service: repeat the order within the
    /// actuator's deadline, and report a fault.
    fn run_own_loop(&mut self, now: Instant) {
        self.plant.repeat_order();
        let state = self.stack.standing().state;
        match self.plant.fault() {
            Some(_) if state != State::Failure => {
                self.stack.set_condition(now, Condition::Failed);
            }
            None if state == State::Failure => {
                self.stack.set_condition(now, Condition::Initialized);
            }
            _ => {}
        }
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.stack.poll_timeout().into_iter().chain(self.next).min()
    }

    pub(crate) fn poll_transmit(&mut self) -> Option<Outgoing> {
        while self.stack.poll_event().is_some() {}
        self.stack.poll_transmit()
    }

    pub(crate) const fn standing(&self) -> &Standing {
        self.stack.standing()
    }

    /// Shuts down gracefully; returns the messages still to be sent.
    pub(crate) fn stop(mut self, now: Instant) -> Vec<Outgoing> {
        self.stack.stop(&StopCause::Ended);
        self.stack.take_leave(now);
        std::iter::from_fn(|| self.poll_transmit()).collect()
    }
}

/// All drivers on one vehicle. A gateway turns an RA client's waypoints into a list if it can, so a
/// vehicle for single waypoints offers it no lists.
fn drivers(plant: &SharedPlant, time: &TimeOfDay, cell: Cell) -> Vec<Box<dyn Service>> {
    let pilot = Pilot::new(Wheels(plant.clone()), FRAME).with_fence(plant.lock().fence.clone());
    let policy = match cell.driver.is_held() {
        true => MotionPolicy::Hold,
        false => MotionPolicy::default(),
    };
    let vehicle = mobility::Vehicle::new(pilot)
        .motion_policy(policy)
        .with_clock(time.clone());
    let mut services: Vec<Box<dyn Service>> = vec![
        Box::new(vehicle.velocity_state_sensor()),
        Box::new(vehicle.local_pose_sensor()),
        Box::new(vehicle.primitive_driver()),
        Box::new(vehicle.velocity_state_driver()),
        Box::new(vehicle.local_vector_driver()),
        Box::new(vehicle.local_waypoint_driver()),
    ];
    if cell.driver.is_global() {
        services.push(Box::new(vehicle.global_vector_driver()));
        services.push(Box::new(vehicle.global_waypoint_driver()));
    }
    if (cell.fault, cell.driver) != (Fault::Gateway, Driver::Waypoint) {
        services.push(Box::new(vehicle.list_manager()));
        services.push(Box::new(vehicle.local_waypoint_list_driver()));
        services.push(Box::new(vehicle.local_path_segment_driver()));
    }
    services
}

/// A driver made of functions, as in an application.
fn own_service(plant: &SharedPlant) -> Handlers {
    let (motor, brake) = (plant.clone(), plant.clone());
    Handlers::new(primitive_driver::LATEST)
        .command(move |effort: SetWrenchEffort, _, _| {
            let percent = effort.propulsive_linear_effort_x_percent();
            motor.drive(Drive::Effort(Effort {
                forward: percent.unwrap_or_default() / 100.0,
                ..Effort::default()
            }));
        })
        .declines::<QueryWrenchEffort>()
        .on_stop(move |_| brake.drive(Drive::Stop))
}

impl Platform for Wheels {
    fn handle_time(&mut self, now: Instant) {
        self.read_sensor(now);
    }

    fn motion(&self) -> Motion {
        self.sample()
    }

    fn set_pose(&mut self, pose: Pose) {
        Self::set_pose(self, pose);
    }

    fn drive(&mut self, command: Drive) {
        self.0.drive(command);
    }

    fn limits(&self) -> Limits {
        Self::limits(self)
    }

    fn set_limits(&mut self, limits: Limits) {
        Self::set_limits(self, limits);
    }

    fn fault(&self) -> Option<String> {
        self.0.fault().map(str::to_owned)
    }
}
