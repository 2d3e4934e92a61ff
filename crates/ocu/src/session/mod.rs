//! The operator session: monitors a vehicle, takes control of it, drives and stops it, on request
//! of the pages. A single task that never waits for the network: slow operations are jobs that
//! report their completion.

mod alarm;
mod client;
mod following;
mod lease;
mod maps;
mod requests;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use tokio::sync::{mpsc, watch};
use tokio::time::{MissedTickBehavior, interval};

use self::alarm::Alarm;
use self::client::{Client, Finished};
use self::following::{Following, Sighting};
use self::lease::{Lease, Wanted};
pub(super) use self::maps::CellsReply;
use self::maps::Maps;
use super::PageId;
use super::missing::Absence;
use super::picture::Picture;
use super::request::OperatorRequest;
use super::role::Role;
use super::state::{Drive, State};
use super::stick::{Push, Stick};
use jaus::address::JausId;
use jaus::component::Component;
use jaus_vehicle::parts::PartError;
use jaus_view::Timestamp;

/// Callback for the result of a request: success, or the reason for failure.
pub(super) type Reply = Box<dyn FnOnce(Result<(), String>) + Send>;

/// A message from a page to the session.
pub(super) enum Order {
    OperatorRequest {
        page: PageId,
        request: OperatorRequest,
        reply: Reply,
    },
    /// Request for the cells of a map.
    Cells { map: u16, reply: CellsReply },
    /// A page is gone. If it held the stick, the stick is released.
    Gone(PageId),
}

/// The pages' interface to the session.
#[derive(Clone)]
pub(super) struct Access {
    pub(super) orders: mpsc::Sender<Order>,
    /// The last snapshot as JSON; empty before the first.
    pub(super) snapshots: watch::Receiver<Arc<str>>,
}

/// The operator session.
pub(super) struct Session {
    client: Client,
    picture: Picture,
    following: Following,
    stick: Stick,
    lease: Lease,
    alarm: Alarm,
    maps: Maps,
    /// The missing parts that have been logged.
    missing: BTreeMap<JausId, Absence>,
    /// Why the station ended manual drive, until a page drives again.
    halted: Option<String>,
    orders: mpsc::Receiver<Order>,
    sightings: mpsc::Receiver<Sighting>,
    snapshots: watch::Sender<Arc<str>>,
    seq: u64,
}

impl Session {
    /// Period of manual drive commands and of all other periodic work.
    const BEAT: Duration = Duration::from_millis(50);
    /// Number of periods between two snapshots.
    const SNAPSHOT: u64 = 2;
    /// Capacity of the order and report queues.
    const QUEUE: usize = 256;

    /// Creates a session for a component. `vehicle` selects the vehicle, by default the first one
    /// discovered; `authority` is used to request control.
    pub(super) fn new(component: Component, vehicle: Option<u16>, authority: u8) -> (Self, Access) {
        let (orders, inbox) = mpsc::channel(Self::QUEUE);
        let (sighted, sightings) = mpsc::channel(Self::QUEUE);
        let (publisher, snapshots) = watch::channel(Arc::from(""));
        let session = Self {
            picture: Picture::new(component.id(), vehicle),
            following: Following::new(component.clone(), sighted),
            client: Client::new(component, authority),
            stick: Stick::default(),
            lease: Lease::default(),
            alarm: Alarm::default(),
            maps: Maps::default(),
            missing: BTreeMap::new(),
            halted: None,
            orders: inbox,
            sightings,
            snapshots: publisher,
            seq: 0,
        };
        (session, Access { orders, snapshots })
    }

    /// Runs until the component stops.
    pub(super) async fn run(mut self) -> PartError {
        let mut standing = self.client.component().watch_standing();
        let mut beat = interval(Self::BEAT);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                changed = standing.changed() => if changed.is_err() {
                    return PartError::NodeStopped;
                },
                Some(order) = self.orders.recv() => self.handle_order(Instant::now(), order),
                Some((by, report)) = self.sightings.recv() => {
                    self.picture.handle_report(Instant::now(), by, report);
                }
                Some(finished) = self.client.finished() => {
                    self.handle_finished(Instant::now(), finished);
                }
                _ = beat.tick() => self.handle_beat(Instant::now()),
            }
        }
    }

    fn handle_finished(&mut self, now: Instant, finished: Finished) {
        match finished {
            Finished::Begun { peer, result } => self.lease.handle_begun(peer, result),
            Finished::Requested { reply, result } => reply(result),
            Finished::Steered { push, acknowledged } => {
                if acknowledged && push == Push::NONE {
                    self.stick.handle_stopped();
                }
            }
            Finished::Mapped { edition, result } => self.maps.handle_mapped(edition, &result),
            Finished::Alarmed { peer, status } => {
                self.alarm.handle_told(peer);
                if let Some(report) = status {
                    self.picture.handle_report(now, peer, report.into());
                }
            }
        }
    }

    fn handle_beat(&mut self, now: Instant) {
        self.look_around(now);
        self.log_missing(now);
        self.halt_on_old_picture(now);
        if self.alarm.is_wanted() || self.picture.in_emergency().next().is_some() {
            // Whatever the source of the emergency: nothing resumes on its own afterwards.
            self.stick.stop(now);
            self.lease.set_ready(false);
        }
        self.alarm.handle_time(now, &self.picture, &mut self.client);
        self.stop_after_lost_planner(now);
        self.lease.handle_time(&self.picture, &mut self.client);
        self.steer(now);
        self.seq += 1;
        if self.seq.is_multiple_of(Self::SNAPSHOT) {
            self.publish(now);
        }
    }

    fn look_around(&mut self, now: Instant) {
        self.picture.handle_time(now);
        let directory = self.client.component().directory();
        if !std::ptr::eq(&*directory, self.picture.directory()) {
            self.picture.handle_directory(now, directory);
            self.following.follow(&self.picture);
        }
    }

    /// Logs parts that disappear, fall silent or return.
    fn log_missing(&mut self, now: Instant) {
        let mut missing = BTreeMap::new();
        for (id, name, how) in self.picture.missing(now) {
            missing.insert(id, how);
            if self.missing.get(&id) != Some(&how) {
                tracing::warn!("{name} {id} is {}", how.name());
            }
        }
        for id in self.missing.keys().filter(|id| !missing.contains_key(id)) {
            if self.picture.parts().contains_key(id) {
                tracing::info!("{id} is back");
            }
        }
        self.missing = missing;
    }

    /// Ends manual drive when the picture is stale.
    fn halt_on_old_picture(&mut self, now: Instant) {
        if self.stick.driven().is_none() {
            return;
        }
        if let Some(why) = self.picture.stale(now) {
            tracing::warn!("manual drive ended: {why}");
            self.stick.stop(now);
            self.halted = Some(why);
        }
    }

    /// Stops the vehicle after the planner was lost while driving for this operator. Its drivers
    /// have no supervising client left, so the station takes control and sends them to standby.
    fn stop_after_lost_planner(&mut self, now: Instant) {
        let Some((planner, how)) = self.picture.lost_planner(now) else {
            return;
        };
        if self.lease.wanted() == Wanted::Planner {
            tracing::warn!(
                "the planner {planner} is {} while it drives: stopping the vehicle",
                how.name()
            );
            self.lease.want_stopped(&self.picture);
        }
    }

    /// Why driving ended without a release of the stick; empty otherwise.
    fn halt_reason(&self) -> String {
        if self.stick.fell_silent() {
            let limit = Stick::DEAD_MAN.as_millis();
            return format!("no command from the page for {limit} ms: the vehicle was stopped");
        }
        self.halted.clone().unwrap_or_default()
    }

    /// Sends the stick's setpoint to the vehicle, until it has acknowledged the release.
    fn steer(&mut self, now: Instant) {
        let Some(push) = self.stick.poll_push(now) else {
            return;
        };
        let driver = self.picture.find(Role::PrimitiveDriver);
        match driver.and_then(|driver| self.lease.held(driver)) {
            Some(session) if session.check().is_ok() => self.client.steer(now, &session, push),
            // Without control and in standby, earlier commands no longer affect the vehicle.
            _ => self.stick.handle_stopped(),
        }
    }

    fn publish(&mut self, now: Instant) {
        let state = self.state(now);
        // Serialisation cannot fail for numbers and text.
        let Ok(json) = serde_json::to_string(&super::answer::Said::State(&state)) else {
            return;
        };
        // Unlike `send`, this never fails. The server holds a receiver even without pages.
        self.snapshots.send_replace(json.into());
    }

    fn state(&self, now: Instant) -> State {
        let driven = self.stick.driven();
        let push = driven.unwrap_or_default();
        let emergency = self.alarm.is_wanted();
        State {
            seq: self.seq / Self::SNAPSHOT,
            time: time_of_day().to_string(),
            operator: self.client.component().id().to_string(),
            tree: self.picture.tree(),
            vehicle: self
                .picture
                .vehicle_state(now, emergency, |part| self.lease.obstacle(part)),
            control: self.lease.state(&self.picture),
            drive: Drive {
                active: driven.is_some(),
                forward: push.forward(),
                turn: push.turn(),
                reason: self.halt_reason(),
            },
            mission: self
                .picture
                .mission_state(now, self.lease.is_stopped(&self.picture)),
            map: self.picture.map_state(),
        }
    }
}

/// Milliseconds are precise enough for display.
const DECIMALS: u8 = 3;

/// The time of day. Clocks before 1970 yield the start of 1970.
fn time_of_day() -> Timestamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let since = since.unwrap_or_default();
    let seconds = i64::try_from(since.as_secs()).unwrap_or(i64::MAX);
    Timestamp::new(seconds, since.subsec_nanos(), DECIMALS)
}
