//! The operator session: monitors vehicles, takes control of them, drives and stops them, on request
//! of the pages. A single task that never waits for the network: slow operations are jobs that
//! report their completion.

mod alarm;
mod client;
mod control;
mod driving;
mod emergency;
mod fleet;
mod hold;
mod lease;
mod manual_drive;
mod maps;
mod mission;
mod observations;
mod vehicle;

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use self::client::{Client, Finished};
use self::fleet::Fleet;
use super::answer::Said;
use super::events::EventLog;
use super::following::Sighting;
use super::handover::{self, Notice};
use super::orders::{Access, Order, Publisher, Snapshot, StopOrder, fields};
use super::pages::Pages;
use super::press::Presses;
use super::state::{State, Tree};
use jaus::component::{Component, Handlers, PeerClocks};
use jaus::node::{now, time_of_day};
use jaus_vehicle::parts::PartError;
use jaus_view::Timestamp;

/// The operator session.
pub(super) struct Session {
    client: Client,
    fleet: Fleet,
    pages: Pages,
    /// The clocks of the vehicles' sensors, for the age of what they report.
    clocks: PeerClocks,
    /// Whether all vehicles are to be in emergency, also those that appear later.
    all_stopped: bool,
    /// What pages have pressed to stop, and cleared.
    presses: Presses,
    /// Stops come before everything else.
    stops: mpsc::Receiver<StopOrder>,
    events: EventLog,
    orders: mpsc::Receiver<Order>,
    sightings: mpsc::Receiver<Sighting>,
    notices: mpsc::Receiver<Notice>,
    /// The service that receives the notices, until it is offered.
    handoff: Option<Handlers>,
    publisher: Publisher,
    /// The tree that was published.
    published: Option<Tree>,
    seq: u64,
}

impl Session {
    /// Period of manual drive commands and of all other periodic work.
    const BEAT: Duration = Duration::from_millis(50);
    /// Number of periods between two snapshots of the pages' vehicles.
    const SNAPSHOT: u64 = 2;
    /// Number of periods between two observations for the log of events.
    const OBSERVATION: u64 = 4;
    /// Number of periods between two snapshots of the list of vehicles, and of the tree, and between
    /// two measurements of round trips.
    const FLEET_SNAPSHOT: u64 = 20;
    /// Capacity of the order and report queues.
    const QUEUE: usize = 256;
    /// Capacity of the queue of stops.
    const STOPS: usize = 64;

    /// Creates a session for a component. `vehicles` are shown, by default all that are discovered;
    /// pages begin with the first. `authority` is used to request control.
    pub(super) fn new(component: Component, vehicles: Vec<u16>, authority: u8) -> (Self, Access) {
        let (orders, inbox) = mpsc::channel(Self::QUEUE);
        let (sighted, sightings) = mpsc::channel(Self::QUEUE);
        let (noticed, notices) = mpsc::channel(Self::QUEUE);
        let (stop, stops) = mpsc::channel(Self::STOPS);
        let (publisher, lists) = Publisher::new();
        let session = Self {
            fleet: Fleet::new(component.clone(), vehicles, sighted),
            client: Client::new(component, authority),
            pages: Pages::default(),
            clocks: PeerClocks::default(),
            all_stopped: false,
            presses: Presses::default(),
            stops,
            events: EventLog::default(),
            orders: inbox,
            sightings,
            notices,
            handoff: Some(handover::service(noticed)),
            publisher,
            published: None,
            seq: 0,
        };
        let access = Access {
            orders,
            stops: stop,
            lists,
        };
        (session, access)
    }

    /// Runs until the component stops.
    pub(super) async fn run(mut self) -> PartError {
        if let Some(handoff) = self.handoff.take()
            && let Err(error) = self.client.component().offer(handoff).await
        {
            return PartError::Broken(error.to_string());
        }
        let (component, clocks) = (self.client.component().clone(), self.clocks.clone());
        let measuring = clocks.measure(&component);
        tokio::pin!(measuring);
        let mut standing = component.watch_standing();
        let mut beat = interval(Self::BEAT);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                biased;
                Some(stop) = self.stops.recv() => self.handle_stop(now(), stop),
                changed = standing.changed() => if changed.is_err() {
                    return PartError::NodeStopped;
                },
                _ = beat.tick() => self.handle_beat(now()),
                Some(order) = self.orders.recv() => self.handle_order(now(), order),
                never = &mut measuring => match never {},
                Some((by, mut report)) = self.sightings.recv() => {
                    if let Some(sampled) = report.sampled() {
                        sampled.measure(|stamp| self.clocks.age(by, stamp));
                    }
                    if let Some(vehicle) = self.fleet.get_mut(by.subsystem()) {
                        vehicle.handle_report(now(), by, report);
                    }
                }
                Some((part, content)) = self.notices.recv() => {
                    if let Some(vehicle) = self.fleet.get_mut(part.subsystem()) {
                        vehicle.handle_handover(now(), part, &content, &mut self.client);
                    }
                }
                Some(finished) = self.client.finished() => {
                    self.handle_finished(now(), finished);
                }
            }
        }
    }

    fn handle_finished(&mut self, now: Instant, finished: Finished) {
        match finished {
            Finished::Begun { peer, result } => {
                // Without its vehicle the session is dropped, which releases the part.
                if let Some(vehicle) = self.fleet.get_mut(peer.subsystem()) {
                    vehicle.lease.handle_begun(peer, result);
                }
            }
            Finished::Left { vehicle } => {
                if let Some(vehicle) = self.fleet.get_mut(vehicle) {
                    vehicle.is_leaving = false;
                }
            }
            Finished::Requested { reply, result } => reply(result),
            Finished::Stopped {
                vehicle,
                acknowledged,
            } => {
                if let Some(vehicle) = self.fleet.get_mut(vehicle).filter(|_| acknowledged) {
                    vehicle.manual.handle_stopped();
                }
            }
            Finished::Probed {
                vehicle,
                round_trip,
            } => {
                if let Some(vehicle) = self.fleet.get_mut(vehicle) {
                    vehicle.link.handle_answer(round_trip);
                }
            }
            Finished::Mapped {
                store,
                edition,
                result,
            } => {
                if let Some(vehicle) = self.fleet.get_mut(store.subsystem()) {
                    vehicle.maps.handle_mapped(edition, &result);
                }
            }
            Finished::Alarmed {
                peer,
                is_stopped,
                status,
            } => {
                if let Some(vehicle) = self.fleet.get_mut(peer.subsystem()) {
                    vehicle.alarm.handle_told(peer);
                    if let Some(report) = status {
                        if is_stopped {
                            vehicle.picture.handle_stop_answered(peer);
                        }
                        vehicle.handle_report(now, peer, report.into());
                    }
                }
            }
        }
    }

    fn handle_beat(&mut self, now: Instant) {
        for joined in self.fleet.handle_directory(now) {
            self.stop_latecomer(now, joined);
        }
        for vehicle in self.fleet.iter_mut() {
            vehicle.handle_time(now, &mut self.client);
        }
        self.show();
        self.seq += 1;
        if self.seq.is_multiple_of(Self::OBSERVATION) {
            self.observe(now);
        }
        if self.seq.is_multiple_of(Self::SNAPSHOT) {
            self.pages.publish(|vehicle| self.snapshot(now, vehicle));
        }
        if self.seq % Self::FLEET_SNAPSHOT == 1 {
            self.publish_fleet(now);
            self.measure_links();
        }
    }

    /// Follows the vehicles that pages show.
    fn show(&mut self) {
        let first = self.fleet.first();
        let fleet = &self.fleet;
        self.pages
            .select_first(first, |vehicle| fleet.may_come(vehicle));
        let shown = self.pages.shown();
        self.fleet.set_depths(&shown);
        self.fleet.drop_absent(&shown);
    }

    fn measure_links(&mut self) {
        for vehicle in self.pages.shown() {
            if let Some(vehicle) = self.fleet.get(vehicle) {
                vehicle.probe(&mut self.client);
            }
        }
    }

    fn publish_fleet(&mut self, now: Instant) {
        let stops = self.presses.count();
        let fleet = self.fleet.state(now, self.all_stopped, stops);
        self.publisher.fleet(&Said::Fleet(&fleet));
        let tree = self.fleet.tree(now);
        if self.published.as_ref() != Some(&tree) {
            self.publisher.tree(&Said::Tree(&tree));
            self.published = Some(tree);
        }
    }

    fn snapshot(&self, now: Instant, number: Option<u16>) -> Snapshot {
        let state = self.state(now, number);
        let vehicle = number.and_then(|number| self.fleet.get(number));
        Snapshot {
            seq: state.seq,
            vehicle: number,
            link: vehicle.map(|it| it.link.quality()).unwrap_or_default(),
            fields: Arc::new(fields(&state)),
        }
    }

    fn state(&self, now: Instant, number: Option<u16>) -> State {
        let vehicle = number.and_then(|number| self.fleet.get(number));
        State {
            seq: self.seq / Self::SNAPSHOT,
            time: Timestamp::since_1970(time_of_day(), DECIMALS).to_string(),
            operator: self.client.component().id().to_string(),
            vehicle: vehicle.and_then(|it| it.state(now)),
            control: vehicle.map(|it| it.control_state()).unwrap_or_default(),
            drive: vehicle.map(|it| it.manual.state()).unwrap_or_default(),
            mission: vehicle.and_then(|it| it.mission_state(now)),
            map: vehicle.and_then(|it| it.picture.map_state()),
            events: self.events.latest(),
            stops: self.presses.count(),
        }
    }
}

/// Of seconds: milliseconds are precise enough for display.
const DECIMALS: u8 = 3;
