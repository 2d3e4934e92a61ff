//! The world of a trial: two operators at their pages, the station, two vehicles, and the networks
//! between them, in steps of virtual time.

use std::time::Duration;

use jaus_test_kit::random::Random;
use jaus_vehicle::motion::Drive;
use serde_json::json;

use crate::air::Air;
use crate::cable::Frame;
use crate::host::Host;
use crate::page::{Device, Page};
use crate::station::StationProgram;
use crate::story;
use crate::vehicle::{self, SharedMotors, Way};
use crate::witness::{Lives, Witness};

/// What happens within a step happens at its end.
const STEP: Duration = Duration::from_millis(4);
/// After this time programs know each other.
const SETTLED: Duration = Duration::from_secs(5);
pub(crate) const VEHICLES: [u16; 2] = [101, 102];
/// The host of the station. Those of the vehicles follow.
pub(crate) const STATION: usize = 0;

pub(crate) struct World {
    pub(crate) now: Duration,
    pub(crate) random: Random,
    hosts: Vec<Host>,
    /// When the programs were started.
    started: [Duration; 3],
    pub(crate) air: Air,
    station: Option<StationProgram>,
    motors: [SharedMotors; 2],
    /// The motors' last orders, for the trace.
    ordered: [Drive; 2],
    pub(crate) pages: Vec<Page>,
    pub(crate) witness: Witness,
}

impl World {
    /// Programs and pages start at once. The clocks run at these rates: those of the station, the
    /// vehicles and the pages.
    pub(crate) fn new(seed: u64, rates: [f64; 5]) -> Self {
        story::begin();
        let mut random = Random::new(seed);
        let pages = [Way::Forward, Way::Backward].into_iter().enumerate();
        let page = |(number, way)| Page::new(number, way, random.number(), rates[3 + number]);
        let pages = pages.map(page).collect();
        let mut world = Self {
            now: Duration::ZERO,
            hosts: rates[..3].iter().map(|rate| Host::new(*rate)).collect(),
            started: [Duration::ZERO; 3],
            air: Air::new(random.number(), 3),
            station: None,
            motors: [SharedMotors::new(), SharedMotors::new()],
            ordered: [Drive::Stop; 2],
            pages,
            witness: Witness::new(rates.into_iter().fold(1.0, f64::min)),
            random,
        };
        world.start_station();
        for vehicle in 0..VEHICLES.len() {
            world.start_vehicle(vehicle);
        }
        for page in &mut world.pages {
            page.open(Duration::ZERO, true);
        }
        world
    }

    pub(crate) fn trace(&self, what: impl FnOnce() -> String) {
        story::note(self.now, &what());
    }

    // Programs.

    pub(crate) fn start_station(&mut self) {
        let link = self.air.plug(STATION);
        self.started[STATION] = self.now;
        let station = &mut self.station;
        self.hosts[STATION].start(|_time| {
            *station = Some(StationProgram::start(&VEHICLES, link));
        });
    }

    pub(crate) fn kill_station(&mut self) {
        self.air.unplug(STATION);
        self.station = None;
        self.hosts[STATION].kill();
        // The system of its host closes the connections, and a page that has lost its own wants a new act.
        for page in &mut self.pages {
            self.witness.end(page.number, self.now, true);
            for connection in page.connections().to_vec() {
                page.cable.send_down(self.now, connection, Frame::Close);
            }
        }
    }

    pub(crate) fn start_vehicle(&mut self, vehicle: usize) {
        let (motors, link) = (&self.motors[vehicle], self.air.plug(1 + vehicle));
        self.started[1 + vehicle] = self.now;
        self.hosts[1 + vehicle].start(|time| {
            vehicle::start(VEHICLES[vehicle], motors, &time, link);
        });
    }

    pub(crate) fn kill_vehicle(&mut self, vehicle: usize) {
        self.motors[vehicle].disconnect();
        self.air.unplug(1 + vehicle);
        self.hosts[1 + vehicle].kill();
        self.witness.forget_emergency(vehicle);
    }

    pub(crate) fn host(&mut self, host: usize) -> &mut Host {
        &mut self.hosts[host]
    }

    // Time.

    pub(crate) fn step(&mut self) {
        self.now += STEP;
        let now = self.now;
        self.air.deliver(now);
        self.pass_up();
        for host in &mut self.hosts {
            host.live(now);
        }
        self.air.collect(now);
        if let Some(station) = &self.station {
            for (page, connection, frame) in station.take_said() {
                self.pages[page].cable.send_down(now, connection, frame);
            }
        }
        for page in &mut self.pages {
            page.live(now, &mut self.random);
        }
        self.handle_hands();
        for motors in &self.motors {
            motors.advance(now);
        }
        self.observe();
    }

    /// Brings the station what the pages have said.
    fn pass_up(&mut self) {
        for page in &mut self.pages {
            while let Some((connection, frame)) = page.cable.up.receive(self.now) {
                let Some(station) = &mut self.station else {
                    // Nobody listens.
                    if frame != Frame::Close {
                        page.cable.send_down(self.now, connection, Frame::Close);
                    }
                    continue;
                };
                let number = page.number;
                self.hosts[STATION].enter(|| station.handle(number, connection, frame));
            }
        }
    }

    // Hands.

    /// The hand of a page takes something up for a time.
    pub(crate) fn hold(&mut self, page: usize, device: Device, time: Duration, gets_lost: bool) {
        let (page, now) = (&mut self.pages[page], self.now);
        let (number, vehicle, way) = (page.number, page.view.vehicle, page.way);
        let is_ready = page.view.line.starts_with("Ready");
        let meant = VEHICLES.iter().position(|it| *it == vehicle);
        if meant.is_none() && device == Device::Gamepad {
            // It is pressed a moment later, when the page may show a vehicle.
            return;
        }
        page.hold(now, device, time, gets_lost, &mut self.random);
        if let Some(vehicle) = meant {
            self.witness.hold(now, (number, vehicle, way), is_ready);
        }
        let lost = if gets_lost { ", then is lost" } else { "" };
        self.trace(|| {
            let seconds = time.as_secs_f64();
            format!("page {number} holds {device:?} of {vehicle} for {seconds:.2} s{lost}")
        });
    }

    /// Hands let go, or are lost.
    fn handle_hands(&mut self) {
        for page in 0..self.pages.len() {
            if self.pages[page].grip.is_some_and(|it| it.ends <= self.now) {
                self.let_go(page);
            }
        }
    }

    pub(crate) fn let_go(&mut self, page: usize) {
        if let Some(grip) = self.pages[page].let_go() {
            if grip.gets_lost && grip.device != Device::Touch {
                self.witness.lose(page, grip.last_sign, grip.has_renewed);
            } else {
                self.witness.end(page, self.now, grip.has_renewed);
            }
            self.trace(|| format!("page {page}: the hand lets go: {grip:?}"));
        }
    }

    /// Something happens to the page after which nothing that is held counts.
    pub(crate) fn interrupt(&mut self, page: usize, event: serde_json::Value) {
        self.trace(|| format!("page {page}: {event}"));
        self.witness.end(page, self.now, true);
        // A hand that has not pressed yet would do so after the event.
        let grip = &mut self.pages[page].grip;
        *grip = grip.filter(|it| it.device != Device::Gamepad || it.has_renewed);
        self.pages[page].happen(event);
    }

    /// The operator of a page stops its vehicle, or all.
    pub(crate) fn stop(&mut self, page: usize) {
        let stops_all = self.random.happens(200);
        let shown = self.pages[page].view.vehicle;
        self.interrupt(page, json!(["key", "keydown", "Escape", false, stops_all]));
        for (vehicle, subsystem) in VEHICLES.into_iter().enumerate() {
            if stops_all || subsystem == shown {
                self.witness.stop(self.now, page, vehicle);
            }
        }
    }

    /// The operator of a page clears the emergency of its vehicle.
    pub(crate) fn clear(&mut self, page: usize) {
        self.trace(|| format!("page {page} clears"));
        let is_latched = self.pages[page].view.is_latched;
        let buttons = if is_latched {
            &["latch-clear"][..]
        } else {
            &["estop-clear", "clear-yes"]
        };
        for button in buttons {
            self.pages[page].happen(json!(["click", button]));
        }
        self.witness.forget_emergencies();
    }

    // Observation.

    fn observe(&mut self) {
        let page = |page: &Page| !page.cable.is_cut() && page.frozen.is_none();
        let lives = Lives {
            pages: [page(&self.pages[0]), page(&self.pages[1])],
            station: self.hosts[STATION].is_alive(),
            air: [1, 2].map(|host| !self.air.is_cut(STATION, host)),
            vehicles: [1, 2].map(|host| self.hosts[host].is_alive()),
            wires: [0, 1].map(|page| self.pages[page].cable.wire.clone()),
            weather: self.air.weather.clone(),
            live: [0, 1].map(|page| self.pages[page].view.link == "live"),
            settled: self.started.map(|at| self.now > at + SETTLED),
        };
        let driven = [0, 1].map(|vehicle| self.motors[vehicle].driven());
        for vehicle in 0..VEHICLES.len() {
            let order = self.motors[vehicle].order();
            if self.ordered[vehicle] != order {
                self.trace(|| format!("vehicle {vehicle}: {order:?}"));
                self.ordered[vehicle] = order;
            }
        }
        self.witness.observe(self.now, &lives, driven);
    }
}
