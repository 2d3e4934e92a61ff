//! The operator's session: the component that watches a vehicle, takes it under control, drives and
//! stops it, as the pages request. One task that never waits for the network: whatever takes time is a
//! job, whose end comes back as news.

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

/// What becomes of a request: done, or why not.
pub(super) type Reply = Box<dyn FnOnce(Result<(), String>) + Send>;

/// What pages tell the session.
pub(super) enum Order {
    OperatorRequest {
        page: PageId,
        request: OperatorRequest,
        reply: Reply,
    },
    /// The cells of a map.
    Cells { map: u16, reply: CellsReply },
    /// A page is gone, and with it the hand that was on the stick.
    Gone(PageId),
}

/// How pages reach the session.
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
    /// Which parts were missing when that was last logged.
    missing: BTreeMap<JausId, Absence>,
    /// Why driving was ended by the station, until a page drives again.
    halted: Option<String>,
    orders: mpsc::Receiver<Order>,
    sightings: mpsc::Receiver<Sighting>,
    snapshots: watch::Sender<Arc<str>>,
    seq: u64,
}

impl Session {
    /// Between two commands of manual drive; everything else is looked after as often.
    const BEAT: Duration = Duration::from_millis(50);
    /// Beats between two snapshots.
    const SNAPSHOT: u64 = 2;
    /// Orders and reports that may wait for the session.
    const QUEUE: usize = 256;

    /// A session for a component: which vehicle it looks at if not the first that it finds, and with
    /// which authority it asks for control.
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

    /// Works until the component stops.
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
            Finished::Taken { peer, result } => {
                self.lease.handle_taken(now, peer, result, &mut self.client);
            }
            Finished::Told { reply, result } => reply(result),
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
            // Whoever has set it: nothing acts again by itself when it is over.
            self.stick.stop(now);
            self.lease.set_ready(now, false);
        }
        self.alarm.handle_time(now, &self.picture, &mut self.client);
        self.stop_after_lost_planner(now);
        self.lease.handle_time(now, &self.picture, &mut self.client);
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

    /// Logs which parts disappear, fall silent, and come back.
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
            tracing::warn!("manual drive ends: {why}");
            self.stick.stop(now);
            self.halted = Some(why);
        }
    }

    /// A planner that is lost while it drives for this operator leaves the drivers without a client
    /// that watches them: the station takes them and has them stand by.
    fn stop_after_lost_planner(&mut self, now: Instant) {
        let Some((planner, how)) = self.picture.lost_planner(now) else {
            return;
        };
        if self.lease.wanted() == Wanted::Planner {
            tracing::warn!(
                "the planner {planner} is {} while it drives: stopping the vehicle",
                how.name()
            );
            self.lease.want_stopped(now, &self.picture);
        }
    }

    /// Why driving has ended although no page let go of the stick; empty otherwise.
    fn halt_reason(&self) -> String {
        if self.stick.fell_silent() {
            let limit = Stick::DEAD_MAN.as_millis();
            return format!(
                "nothing came from the page for {limit} ms: the vehicle was told to stop"
            );
        }
        self.halted.clone().unwrap_or_default()
    }

    /// Tells the vehicle what the stick says, until it has acknowledged that it is let go.
    fn steer(&mut self, now: Instant) {
        let Some(push) = self.stick.poll_push(now) else {
            return;
        };
        let driver = self.picture.find(Role::PrimitiveDriver);
        match driver.and_then(|driver| self.lease.held(driver)) {
            Some(control) => self.client.steer(now, &control, push),
            // Without control nothing that was said before has any effect on the vehicle.
            None => self.stick.handle_stopped(),
        }
    }

    fn publish(&mut self, now: Instant) {
        let state = self.state(now);
        // Numbers and texts only, so that there is nothing that JSON can not say.
        let Ok(json) = serde_json::to_string(&super::answer::Said::State(&state)) else {
            return;
        };
        // Without pages there is nobody to tell, which the server's own copy hides.
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

/// Milliseconds are precise enough for people.
const DECIMALS: u8 = 3;

/// The time of day; the beginning of 1970 on a computer whose clock is before that.
fn time_of_day() -> Timestamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let since = since.unwrap_or_default();
    let seconds = i64::try_from(since.as_secs()).unwrap_or(i64::MAX);
    Timestamp::new(seconds, since.subsec_nanos(), DECIMALS)
}
