//! The operator session: monitors vehicles, takes control of the selected one, drives and stops it,
//! on request of the pages. A single task that never waits for the network: slow operations are jobs that
//! report their completion.

mod alarm;
mod client;
mod fleet;
mod following;
mod handover;
mod lease;
mod maps;
mod requests;
mod vehicle;

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::{mpsc, watch};
use tokio::time::{MissedTickBehavior, interval};

use self::client::{Client, Finished};
use self::fleet::Fleet;
use self::following::Sighting;
use self::handover::Notice;
pub(super) use self::maps::CellsReply;
use self::vehicle::Vehicle;
use super::answer::Said;
use super::picture::Depth;
use super::request::OperatorRequest;
use super::state::{Control, Drive, State, Tree};
use super::stick::PageId;
use super::stick::{Push, Stick};
use jaus::component::{Component, Handlers, PeerClocks};
use jaus::node::time_of_day;
use jaus_vehicle::parts::PartError;
use jaus_view::Timestamp;

/// Callback for the result of a request: success, or the reason for failure.
pub(super) type Reply = Box<dyn FnOnce(Result<(), String>) + Send>;

/// A message from a page to the session.
pub(super) enum Order {
    OperatorRequest {
        page: PageId,
        /// The user of the page.
        user: Arc<str>,
        /// The vehicle that the page means; `None` for the selected one.
        vehicle: Option<u16>,
        request: OperatorRequest,
        reply: Reply,
    },
    /// Request for the cells of a map of a vehicle.
    Cells {
        vehicle: u16,
        map: u16,
        reply: CellsReply,
    },
    /// A page is gone. If it held the stick, the stick is released.
    Gone(PageId),
}

/// The pages' interface to the session.
#[derive(Clone)]
pub(super) struct Access {
    pub(super) orders: mpsc::Sender<Order>,
    pub(super) snapshots: Snapshots,
}

/// The last snapshots as JSON; empty before the first.
#[derive(Clone)]
pub(super) struct Snapshots {
    /// The selected vehicle, ten times a second.
    state: watch::Receiver<Arc<str>>,
    /// The list of vehicles, once a second.
    fleet: watch::Receiver<Arc<str>>,
    /// The tree of components, when it has changed.
    tree: watch::Receiver<Arc<str>>,
}

impl Snapshots {
    /// Makes all snapshots new, for a page that has just connected.
    pub(super) fn mark_changed(&mut self) {
        for snapshots in [&mut self.state, &mut self.fleet, &mut self.tree] {
            snapshots.mark_changed();
        }
    }

    /// The next new snapshot; `None` when the session has ended. The returned future is cancel safe.
    pub(super) async fn next(&mut self) -> Option<Arc<str>> {
        loop {
            let (changed, snapshots) = tokio::select! {
                biased;
                changed = self.tree.changed() => (changed, &mut self.tree),
                changed = self.fleet.changed() => (changed, &mut self.fleet),
                changed = self.state.changed() => (changed, &mut self.state),
            };
            changed.ok()?;
            let json = snapshots.borrow_and_update().clone();
            if !json.is_empty() {
                return Some(json);
            }
        }
    }
}

/// The senders of [`Snapshots`].
struct Publisher {
    state: watch::Sender<Arc<str>>,
    fleet: watch::Sender<Arc<str>>,
    tree: watch::Sender<Arc<str>>,
}

impl Publisher {
    fn new() -> (Self, Snapshots) {
        let (state, states) = watch::channel(Arc::from(""));
        let (fleet, fleets) = watch::channel(Arc::from(""));
        let (tree, trees) = watch::channel(Arc::from(""));
        let snapshots = Snapshots {
            state: states,
            fleet: fleets,
            tree: trees,
        };
        (Self { state, fleet, tree }, snapshots)
    }
}

fn publish(sender: &watch::Sender<Arc<str>>, snapshot: &Said<'_>) {
    // Serialisation cannot fail for numbers and text. Unlike `send`, `send_replace` never fails. The
    // server holds a receiver even without pages.
    if let Ok(json) = serde_json::to_string(snapshot) {
        sender.send_replace(json.into());
    }
}

/// The operator session.
pub(super) struct Session {
    client: Client,
    fleet: Fleet,
    stick: Stick,
    /// The clocks of the vehicles' sensors, for the age of what they report.
    clocks: PeerClocks,
    /// Deselected vehicles that are still being stopped and released. Until then no other one is
    /// driven.
    leaving: BTreeSet<u16>,
    /// Whether all vehicles are to be in emergency, also those that appear later.
    all_stopped: bool,
    /// The user who last took control, drove or approved a mission.
    driver: Option<Arc<str>>,
    /// Why the station ended manual drive, until a page drives again.
    halted: Option<String>,
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
    /// Number of periods between two snapshots of the selected vehicle.
    const SNAPSHOT: u64 = 2;
    /// Number of periods between two snapshots of the list of vehicles, and of the tree.
    const FLEET_SNAPSHOT: u64 = 20;
    /// Capacity of the order and report queues.
    const QUEUE: usize = 256;

    /// Creates a session for a component. `vehicles` are shown, by default all that are discovered;
    /// the first is selected. `authority` is used to request control.
    pub(super) fn new(component: Component, vehicles: Vec<u16>, authority: u8) -> (Self, Access) {
        let (orders, inbox) = mpsc::channel(Self::QUEUE);
        let (sighted, sightings) = mpsc::channel(Self::QUEUE);
        let (noticed, notices) = mpsc::channel(Self::QUEUE);
        let (publisher, snapshots) = Publisher::new();
        let session = Self {
            fleet: Fleet::new(component.clone(), vehicles, sighted),
            client: Client::new(component, authority),
            stick: Stick::default(),
            clocks: PeerClocks::default(),
            leaving: BTreeSet::new(),
            all_stopped: false,
            driver: None,
            halted: None,
            orders: inbox,
            sightings,
            notices,
            handoff: Some(handover::service(noticed)),
            publisher,
            published: None,
            seq: 0,
        };
        (session, Access { orders, snapshots })
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
                changed = standing.changed() => if changed.is_err() {
                    return PartError::NodeStopped;
                },
                Some(order) = self.orders.recv() => self.handle_order(Instant::now(), order),
                never = &mut measuring => match never {},
                Some((by, mut report)) = self.sightings.recv() => {
                    if let Some(sampled) = report.sampled() {
                        sampled.measure(|stamp| self.clocks.age(by, stamp));
                    }
                    if let Some(vehicle) = self.fleet.get_mut(by.subsystem()) {
                        vehicle.handle_report(Instant::now(), by, report);
                    }
                }
                Some((part, content)) = self.notices.recv() => {
                    if let Some(vehicle) = self.fleet.get_mut(part.subsystem()) {
                        vehicle.handle_handover(Instant::now(), part, &content, &mut self.client);
                    }
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
            Finished::Begun { peer, result } => {
                // Without its vehicle the session is dropped, which releases the part.
                if let Some(vehicle) = self.fleet.get_mut(peer.subsystem()) {
                    vehicle.lease.handle_begun(peer, result);
                }
            }
            Finished::Left { vehicle } => {
                self.leaving.remove(&vehicle);
            }
            Finished::Requested { reply, result } => reply(result),
            Finished::Steered { push, acknowledged } => {
                if acknowledged && push == Push::NONE {
                    self.stick.handle_stopped();
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
            Finished::Alarmed { peer, status } => {
                if let Some(vehicle) = self.fleet.get_mut(peer.subsystem()) {
                    vehicle.alarm.handle_told(peer);
                    if let Some(report) = status {
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
        self.halt_on_old_picture(now);
        if self.fleet.selected().is_some_and(Vehicle::is_stopped) {
            self.stick.stop(now);
        }
        for (is_selected, vehicle) in self.fleet.iter_mut() {
            vehicle.handle_time(now, &mut self.client);
            if !is_selected && vehicle.is_wanted() && !vehicle.is_on_mission(now) {
                tracing::info!("vehicle {}: the mission is over", vehicle.number());
                drop(vehicle.release());
                vehicle.set_depth(Depth::Brief);
            }
        }
        self.fleet.drop_absent();
        self.steer(now);
        self.seq += 1;
        if self.seq.is_multiple_of(Self::SNAPSHOT) {
            publish(&self.publisher.state, &Said::State(&self.state(now)));
        }
        if self.seq % Self::FLEET_SNAPSHOT == 1 {
            self.publish_fleet(now);
        }
    }

    /// Ends manual drive when the picture is stale.
    fn halt_on_old_picture(&mut self, now: Instant) {
        if self.stick.driven().is_none() {
            return;
        }
        let stale = self.fleet.selected().and_then(|it| it.picture.stale(now));
        if let Some(why) = stale {
            tracing::warn!("manual drive ended: {why}");
            self.stick.stop(now);
            self.halted = Some(why);
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
        let driver = self.fleet.selected().and_then(Vehicle::driver);
        match driver {
            Some(session) if session.check().is_ok() => self.client.steer(now, &session, push),
            // Without control and in standby, earlier commands no longer affect the vehicle.
            _ => self.stick.handle_stopped(),
        }
    }

    fn publish_fleet(&mut self, now: Instant) {
        let fleet = self.fleet.state(now);
        publish(&self.publisher.fleet, &Said::Fleet(&fleet));
        let tree = self.fleet.tree(now);
        if self.published.as_ref() != Some(&tree) {
            publish(&self.publisher.tree, &Said::Tree(&tree));
            self.published = Some(tree);
        }
    }

    /// Control of the selected vehicle, with the user who drives.
    fn control(&self, vehicle: Option<&Vehicle>) -> Control {
        let control = vehicle.map_or_else(Control::default, Vehicle::control_state);
        let is_ours = control.held || control.wanted;
        let driver = self.driver.as_ref().filter(|_| is_ours);
        Control {
            user: driver.map(ToString::to_string),
            ..control
        }
    }

    fn state(&self, now: Instant) -> State {
        let driven = self.stick.driven();
        let push = driven.unwrap_or_default();
        let vehicle = self.fleet.selected();
        State {
            seq: self.seq / Self::SNAPSHOT,
            time: Timestamp::since_1970(time_of_day(), DECIMALS).to_string(),
            operator: self.client.component().id().to_string(),
            vehicle: vehicle.and_then(|it| it.state(now)),
            control: self.control(vehicle),
            drive: Drive {
                active: driven.is_some(),
                forward: push.forward(),
                turn: push.turn(),
                reason: self.halt_reason(),
            },
            mission: vehicle.and_then(|it| it.mission_state(now)),
            map: vehicle.and_then(|it| it.picture.map_state()),
        }
    }
}

/// Of seconds: milliseconds are precise enough for display.
const DECIMALS: u8 = 3;
