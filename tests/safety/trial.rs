//! One trial: the vehicle drives, a fault occurs, and everything is observed for at least half a
//! minute.

use std::time::{Duration, Instant};

use jaus_vehicle::motion::Pose;
use jaus_vehicle::zones::{Polygon, ZoneId, Zones};

use crate::cell::{Cell, Fault};
use crate::plant::{Plant, Sensor};
use crate::positioning::Positioning;
use crate::sim::{Conditions, Random};
use crate::world::{CROWD, World};

/// The result of a trial.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Outcome {
    /// Whether the vehicle moved before the fault.
    pub(crate) moved: bool,
    /// How long after the fault the vehicle was ordered to move.
    pub(crate) stop: Duration,
    /// Distance in metres after the fault.
    pub(crate) distance: f64,
    /// Whether it moved again with a new lease; `None` if not tried.
    pub(crate) revived: Option<bool>,
    /// Broken promises.
    pub(crate) broken: Vec<String>,
}

/// Runs the trial of a cell with a seed.
pub(crate) fn run(cell: Cell, seed: u64) -> Outcome {
    let mut trial = Trial::new(cell, seed);
    if trial.drive_off() {
        trial.begin_fault();
        trial.run_fault();
        trial.watch();
        trial.judge();
        trial.revive();
    }
    trial.outcome
}

/// Distance of the vehicle from the nearest edge of a zone that is set on top of it, in metres.
const ZONE_BEHIND: f64 = 0.5;

/// A zone whose nearest edge is behind a vehicle.
fn ahead_of(here: &Pose) -> Polygon {
    let (sin, cos) = here.yaw.sin_cos();
    let corner = |ahead: f64, right: f64| {
        (
            here.x + ahead * cos - right * sin,
            here.y + ahead * sin + right * cos,
        )
    };
    let corners = [
        corner(-ZONE_BEHIND, -50.0),
        corner(100.0, -50.0),
        corner(100.0, 50.0),
        corner(-ZONE_BEHIND, 50.0),
    ];
    Polygon::new(corners.to_vec()).expect("a rectangle")
}

struct Trial {
    cell: Cell,
    random: Random,
    world: World,
    /// Time of the fault.
    fault: Instant,
    odometer: f64,
    /// When the fault itself must have stopped the vehicle, and ended control.
    sudden: Option<Instant>,
    /// Whether the gateway was restarted.
    is_gateway_back: bool,
    /// Whether the controller keeps repeating its setpoints after the fault.
    insists: bool,
    /// Whether the component is running and sound at the end.
    is_sound: bool,
    outcome: Outcome,
}

fn conditions(random: &mut Random) -> Conditions {
    let millis = Duration::from_millis;
    let slowest = random.choose(&[2, 10, 30]);
    Conditions {
        latency: Duration::from_micros(200)..millis(slowest),
        lost: random.choose(&[0, 5, 20]),
        repeated: random.choose(&[0, 20]),
        detoured: random.choose(&[0, 20]),
        detour: millis(60),
        ..Conditions::good()
    }
}

impl Trial {
    /// How long the vehicle may take to start moving, with all preparations.
    const START: Duration = Duration::from_secs(12);
    /// How long it is watched after the fault.
    const WATCH: Duration = Duration::from_secs(30);
    /// How long control may outlast the last Request Control.
    const CONTROL: Duration = Duration::from_secs(5);
    /// Braking time from any speed, with a margin.
    const BRAKES: Duration = Duration::from_millis(1500);
    /// Braking distance in metres from the speeds in these trials, with the fence's reaction.
    const BRAKING_DISTANCE: f64 = 1.2;
    /// A controller that has restarted is noticed within this time.
    const RESTART: Duration = Duration::from_millis(500);
    /// How long the numbers of its messages must be known for that, without an incarnation.
    const NUMBERS: Duration = Duration::from_secs(9);
    /// Tolerance for the end of control after the vehicle notices its cause.
    const AT_ONCE: Duration = Duration::from_millis(100);

    fn new(cell: Cell, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let conditions = conditions(&mut random);
        let world = World::new(&mut random, cell, conditions);
        Self {
            cell,
            fault: world.network.now(),
            insists: random.happens(800),
            random,
            world,
            odometer: 0.0,
            sudden: None,
            is_gateway_back: false,
            is_sound: true,
            outcome: Outcome::default(),
        }
    }

    fn break_promise(&mut self, what: String) {
        self.outcome.broken.push(what);
    }

    /// A random duration between two numbers of milliseconds.
    fn between(&mut self, least: u64, most: u64) -> Duration {
        let millis = Duration::from_millis;
        self.random.between(&(millis(least)..millis(most)))
    }

    fn run_between(&mut self, least: u64, most: u64) {
        let time = self.between(least, most);
        self.world.run_for(time);
    }

    /// Drives until the vehicle moves properly; false if it does not.
    fn drive_off(&mut self) -> bool {
        self.run_between(100, 1000);
        if self.cell.driver.is_global() {
            self.world.run_for(Positioning::START);
        }
        if self.cell.fault == Fault::DeadIdsBefore {
            self.world.let_crowd_come(&mut self.random, CROWD);
            self.world.network.kill(self.world.crowd);
            self.run_between(0, 4000);
        }
        if self.cell.fault == Fault::Gateway {
            self.world.run_for(Self::START);
            self.world.with_operator(|_, operator| operator.begin());
        } else {
            let controller = self.world.controller;
            self.world
                .with_client(controller, |now, client| client.begin(now));
        }
        let end = self.world.network.now() + Self::START;
        while !self.has_moved(0.4, 0.4) {
            if self.world.network.now() > end {
                self.break_promise("it did not set out".into());
                return false;
            }
            self.world.run_for(Duration::from_millis(100));
        }
        if self.cell.fault == Fault::Gateway {
            self.world
                .with_operator(|_, operator| operator.note_motion());
        }
        if self.cell.fault == Fault::ForeignRestarted {
            self.world.run_for(Self::NUMBERS);
        }
        self.run_between(0, 2000);
        self.outcome.moved = self.has_moved(0.2, 0.1);
        if !self.outcome.moved {
            self.break_promise("it stopped before anything had gone wrong".into());
        }
        self.outcome.moved
    }

    /// Whether it has covered more than this distance in metres and is faster than this speed.
    fn has_moved(&self, metres: f64, speed: f64) -> bool {
        let plant = self.world.plant.lock();
        plant.odometer > metres && plant.speed() > speed
    }

    fn begin_fault(&mut self) {
        self.fault = self.world.network.now();
        self.odometer = self.world.plant.lock().odometer;
        let wait = match self.cell.fault {
            Fault::Hung => Some(Plant::DEADLINE + Duration::from_millis(1)),
            Fault::Stopped | Fault::Dropped => Some(Duration::ZERO),
            Fault::MotorFailed => Some(Duration::from_millis(200)),
            Fault::NanPose | Fault::PoseJumps => Some(Duration::from_millis(200)),
            Fault::FrozenPose | Fault::DiskStall => Some(Duration::from_secs(1)),
            Fault::ReceiverSilent
            | Fault::ReceiverFrozen
            | Fault::ReceiverGarbled
            | Fault::FixLost => Some(Positioning::OUTAGE + Duration::from_millis(500)),
            Fault::PositionJumps | Fault::PositionVague => Some(Duration::from_millis(500)),
            _ => None,
        };
        self.sudden = wait
            .filter(|_| self.cell.stops_by_itself())
            .map(|wait| self.fault + wait);
    }

    fn run_fault(&mut self) {
        let (vehicle, controller) = (self.world.vehicle, self.world.controller);
        match self.cell.fault {
            Fault::Killed | Fault::DeadIdsBefore => self.world.network.kill(controller),
            Fault::Gateway => self.restart_gateway(),
            Fault::DeadIdsDuring => self.flood(),
            Fault::Suspended => {
                self.world.network.suspend(controller);
                self.run_between(6000, 15_000);
                if self.random.happens(800) {
                    self.world.witness().stop_counting();
                    self.world.network.resume(controller);
                    self.persist();
                }
            }
            Fault::CutOff => self.cut(&[(controller, vehicle), (vehicle, controller)]),
            Fault::CutToVehicle => self.cut(&[(controller, vehicle)]),
            Fault::CutToController => self.cut(&[(vehicle, controller)]),
            Fault::Restarted | Fault::ForeignRestarted => {
                self.world.network.kill(controller);
                // Half of them faster than every limit on silence.
                let longest = self.random.choose(&[150, 3000]);
                self.run_between(1, longest);
                // The times count from the start of the new process.
                self.begin_fault();
                self.world.restart_controller(self.insists);
                self.sudden = Some(self.world.network.now() + Self::RESTART);
            }
            Fault::TakenOver => self.take_over(),
            Fault::ReleaseLost => {
                self.world.network.set_cut(vehicle, controller, true);
                self.world
                    .with_client(controller, |now, client| client.let_go(now));
                self.run_between(0, 3000);
                self.world.network.kill(controller);
            }
            Fault::Stopped | Fault::Dropped => self.end_component(),
            Fault::Hung => self.hang(),
            Fault::MotorFailed => {
                self.world.plant.lock().fault = Some("left motor: overcurrent");
                self.outlast(|plant| plant.fault = None);
            }
            Fault::NanPose => self.spoil_pose(Sensor::Unknown),
            Fault::PoseJumps => self.spoil_pose(Sensor::Displaced),
            Fault::FrozenPose | Fault::DiskStall => self.spoil_pose(Sensor::Stalled),
            Fault::VehicleClock | Fault::ControllerClock => self.step_clock(),
            Fault::ReceiverSilent
            | Fault::ReceiverFrozen
            | Fault::ReceiverGarbled
            | Fault::FixLost
            | Fault::PositionJumps
            | Fault::PositionVague => self.break_receiver(),
            Fault::ZoneSet => self.set_zone(),
        }
    }

    /// The controller survives the fault: it may insist on its setpoints, and request control
    /// again. It does not send Resume.
    fn persist(&mut self) {
        let (controller, insists) = (self.world.controller, self.insists);
        let asks = self.random.happens(300);
        self.world.with_client(controller, |now, client| {
            if insists {
                client.insist();
            }
            if asks {
                client.take_control_again(now);
            }
        });
    }

    /// The gateway is killed, and its operator survives. The vehicle notices when the operator is
    /// attached again. It may insist on its commands after the
    /// gateway's restart, and request control after losing it. It does not send Resume.
    fn restart_gateway(&mut self) {
        self.world.network.kill(self.world.controller);
        self.run_between(100, 8000);
        if self.random.happens(200) {
            return;
        }
        self.world.witness().stop_counting();
        self.world.restart_gateway();
        self.is_gateway_back = true;
        if self.insists {
            self.world.with_operator(|_, operator| operator.insist());
        }
        if self.random.happens(300) {
            self.world.run_for(Self::CONTROL);
            self.world
                .with_operator(|now, operator| operator.request_control(now));
        }
    }

    fn cut(&mut self, directions: &[(crate::sim::Host, crate::sim::Host)]) {
        for &(from, to) in directions {
            self.world.network.set_cut_one_way(from, to, true);
        }
        // A client that continues after losing control. A client that only stops receiving is still
        // in control for the vehicle, until its last request times out.
        let is_deaf = self.cell.fault == Fault::CutToController;
        if self.insists && self.random.happens(500) && !is_deaf {
            let controller = self.world.controller;
            self.world
                .with_client(controller, |_, client| client.insist());
        }
        let shortest = if is_deaf { 10_500 } else { 6500 };
        self.run_between(shortest, 16_000);
        if self.random.happens(800) {
            self.world.witness().stop_counting();
            for &(from, to) in directions {
                self.world.network.set_cut_one_way(from, to, false);
            }
            self.persist();
        }
    }

    /// The crowd appears, and the controller is killed in the middle of it.
    fn flood(&mut self) {
        let part = self.random.below(CROWD);
        self.world.let_crowd_come(&mut self.random, part);
        self.begin_fault();
        self.world.network.kill(self.world.controller);
        self.world.let_crowd_come(&mut self.random, CROWD - part);
        self.world.network.kill(self.world.crowd);
    }

    fn take_over(&mut self) {
        let (controller, supervisor) = (self.world.controller, self.world.supervisor);
        self.world
            .with_client(supervisor, |now, client| client.take_control(now));
        if self.insists {
            self.world
                .with_client(controller, |_, client| client.insist());
        }
        self.run_between(3000, 8000);
        let taken_over = self.world.witness().taken_over;
        self.sudden = taken_over.map(|it| it + Self::AT_ONCE);
        if taken_over.is_none() {
            self.break_promise("the stronger client did not get control".into());
        }
        self.persist();
    }

    /// Ends the component, and possibly restarts it.
    fn end_component(&mut self) {
        let orderly = self.cell.fault == Fault::Stopped;
        self.world.with_vehicle(|now, vehicle| {
            let Some(program) = vehicle.take_program() else {
                return Vec::new();
            };
            if orderly {
                return program.stop(now);
            }
            drop(program);
            Vec::new()
        });
        if self.insists {
            let controller = self.world.controller;
            self.world
                .with_client(controller, |_, client| client.insist());
        }
        self.is_sound = self.random.happens(700);
        if self.is_sound {
            self.run_between(500, 8000);
            self.world.restart_vehicle();
        }
    }

    /// Suspends the component's process. If the controller survives, the suspension lasts until
    /// control is over.
    fn hang(&mut self) {
        let (vehicle, controller) = (self.world.vehicle, self.world.controller);
        self.world.network.suspend(vehicle);
        let dies = self.random.happens(500);
        if dies {
            self.run_between(0, 900);
            self.world.network.kill(controller);
            // A delay below half a second counts as late, not as hung.
            self.run_between(600, 10_000);
        } else {
            self.run_between(6000, 12_000);
        }
        self.is_sound = self.random.happens(800);
        if self.is_sound {
            self.world.witness().stop_counting();
            self.world.network.resume(vehicle);
            if !dies {
                self.persist();
            }
        }
    }

    /// The controller continues during a fault, which is repaired later or never.
    fn outlast(&mut self, mend: impl FnOnce(&mut Plant)) {
        let time = match self.cell.fault {
            Fault::DiskStall => Duration::from_secs(5),
            _ => self.between(6000, 15_000),
        };
        self.persist();
        self.world.run_for(time);
        self.is_sound = self.cell.fault == Fault::DiskStall || self.random.happens(800);
        if self.is_sound {
            mend(&mut self.world.plant.lock());
            self.run_between(0, 2000);
            self.persist();
        }
    }

    fn spoil_pose(&mut self, sensor: Sensor) {
        self.world.plant.lock().sensor = sensor;
        if self.cell.stops_by_itself() {
            self.outlast(|plant| plant.sensor = Sensor::Measures);
            return;
        }
        self.kill_later();
        self.run_between(5000, 8000);
        self.world.plant.lock().sensor = Sensor::Measures;
    }

    fn break_receiver(&mut self) {
        let set = |plant: &mut Plant, fault| {
            let positioning = plant.positioning.as_mut();
            positioning.expect("a driver on the globe").fault = fault;
        };
        set(&mut self.world.plant.lock(), Some(self.cell.fault));
        self.outlast(|plant| set(plant, None));
    }

    /// Sets a keep-out zone around the vehicle and all that is ahead of it. The vehicle may brake,
    /// and leave slowly; it must not drive on. Then the controller is killed, and the zone is
    /// deleted.
    fn set_zone(&mut self) {
        let here = self.world.plant.lock().pose();
        let zone = ahead_of(&here);
        let mut zones = Zones::default();
        zones.set(ZoneId::KeepOut(7), zone.clone());
        let fence = self.world.plant.lock().fence.clone();
        fence.set_zones(zones);
        let end = self.world.network.now() + self.between(3000, 8000);
        while self.world.network.now() < end {
            self.world.run_for(Duration::from_millis(100));
            let Pose { x, y, .. } = self.world.plant.lock().pose();
            let deeper = -zone.signed_distance((x, y)) - ZONE_BEHIND;
            if deeper > Self::BRAKING_DISTANCE {
                return self.break_promise(format!("it drove {deeper:.2} m deeper into a zone"));
            }
        }
        self.begin_fault();
        self.world.network.kill(self.world.controller);
        self.run_between(0, 3000);
        fence.set_zones(Zones::default());
    }

    fn step_clock(&mut self) {
        let hour = 3_600_000_000_000;
        let step = self.random.choose(&[hour, -hour]);
        let controller = self.world.controller;
        let host = match self.cell.fault {
            Fault::VehicleClock => self.world.vehicle,
            _ => controller,
        };
        self.world.network.step_clock(host, step);
        let clock = self.world.network.clock(controller);
        self.world
            .with_client(controller, |_, client| client.set_time(&clock));
        self.kill_later();
    }

    /// The fault must not stop this driver; the death of its controller must.
    fn kill_later(&mut self) {
        self.run_between(500, 3000);
        if !self.has_moved(0.2, 0.1) {
            self.break_promise("it stopped though it need not".into());
        }
        self.begin_fault();
        self.world.network.kill(self.world.controller);
    }

    fn watch(&mut self) {
        self.world.run_for(Self::WATCH);
        if self.is_gateway_back
            && let Some(attached) = self.world.operator_attached()
        {
            self.sudden = Some(attached + Self::RESTART);
        }
    }

    /// Until when the vehicle may be ordered to move.
    fn limit(&mut self) -> Instant {
        let cell = self.cell;
        let witness = self.world.witness();
        let last = match cell.driver.is_streamed() {
            true => witness.last_setpoint,
            false => witness.last_message,
        };
        let last = last.expect("it has moved") + cell.driver.limit();
        let control = witness.last_request.expect("it has moved") + Self::CONTROL;
        let limit = last.min(control);
        self.sudden.map_or(limit, |sudden| sudden.min(limit))
    }

    fn judge(&mut self) {
        let limit = self.limit();
        let (movement, wheels, odometer) = {
            let plant = self.world.plant.lock();
            // A hung program sends no commands: its actuator stops by itself.
            let movement = match self.cell.fault {
                Fault::Hung => plant.actuator,
                _ => plant.order,
            };
            (movement.last(), plant.wheels.last(), plant.odometer)
        };
        let after = |time: Option<Instant>| {
            time.map_or(Duration::ZERO, |time| {
                time.saturating_duration_since(self.fault)
            })
        };
        let allowed = after(Some(limit));
        let (moved, rolled) = (after(movement), after(wheels));
        self.outcome.stop = moved;
        self.outcome.distance = odometer - self.odometer;
        if moved > allowed {
            self.break_promise(format!(
                "it was ordered to move {moved:.3?} after the fault, and no longer than \
                 {allowed:.3?} were allowed"
            ));
        } else if rolled > allowed + Self::BRAKES {
            self.break_promise(format!(
                "its wheels turned {rolled:.3?} after the fault, and orders to move were allowed \
                 for {allowed:.3?}"
            ));
        }
        if self.world.plant.lock().got_rubbish {
            self.break_promise("it ordered something that is no number".into());
        }
        self.judge_control();
    }

    /// Checks that control became free, or passed to another client, in time.
    fn judge_control(&mut self) {
        if self.cell.fault.ends_component() {
            return;
        }
        let sudden = self.sudden.map(|sudden| sudden + Self::AT_ONCE);
        let witness = self.world.witness();
        let request = witness.last_request.expect("it has moved");
        let limit = request + Self::CONTROL;
        let limit = sudden.map_or(limit, |sudden| sudden.min(limit));
        let Some(freed) = witness.freed else {
            self.break_promise("control never became free".into());
            return;
        };
        if freed > limit {
            let late = freed.saturating_duration_since(limit);
            self.break_promise(format!("control became free {late:.3?} too late"));
        }
    }

    /// A supervisor takes control, sends Resume and drives. The vehicle must move again.
    fn revive(&mut self) {
        if !self.is_sound || !self.outcome.broken.is_empty() {
            return;
        }
        let supervisor = self.world.supervisor;
        let is_in_control = self.cell.fault == Fault::TakenOver;
        self.world.with_client(supervisor, |now, client| {
            if is_in_control {
                client.drive();
            } else {
                client.begin(now);
            }
        });
        let end = self.world.network.now() + Self::START;
        let before = self.world.plant.lock().odometer;
        while !self.has_moved(before + 0.2, 0.1) && self.world.network.now() < end {
            self.world.run_for(Duration::from_millis(100));
        }
        let revived = self.has_moved(before + 0.2, 0.1);
        self.outcome.revived = Some(revived);
        if !revived {
            self.break_promise("a new lease does not set it in motion".into());
        }
    }
}
