//! The station's model of a vehicle: reports go in, snapshots for the pages come out. It uses no
//! network and no clock.

mod part;
mod snapshot;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub(super) use self::part::{Depth, Part};
use super::georeference::Georeference;
use super::map_overlay::MapOverlay;
use super::missing::{Absence, GonePart, GoneParts};
use super::report::{Mission, Report};
use super::role::Role;
use super::state;
use super::stop_monitor::{StopMonitor, speed};
use jaus::address::JausId;
use jaus::service::{ComponentEntry, Directory, SampleAge, State};
use jaus_vehicle::messages::handoff::enhanced_access_control;
use jaus_vehicle::motion;

/// The known state of a vehicle.
#[derive(Debug)]
pub(super) struct Picture {
    own: JausId,
    directory: Arc<Directory>,
    vehicle: u16,
    depth: Depth,
    /// Name of the vehicle, kept after discovery has lost it.
    name: String,
    parts: BTreeMap<JausId, Part>,
    gone: GoneParts,
    pose: Option<Sample<state::Pose>>,
    georeference: Georeference,
    velocity: Option<Sample<state::Velocity>>,
    mission: Option<Sample<Mission>>,
    /// Whether the planner of the mission has restarted since it reported it, and whether it was
    /// lost before it came back.
    has_planner_restarted: bool,
    was_planner_lost: bool,
    path: Vec<[f64; 2]>,
    maps: Vec<state::Map>,
    store: Option<JausId>,
    stop_monitor: StopMonitor,
    /// When this station last stopped the vehicle.
    stopped: Option<Instant>,
    overlay: MapOverlay,
}

/// A reported value with its reporter and sample time. The time comes from the report's time stamp,
/// or is the arrival time without a stamp.
#[derive(Debug, Clone, Copy)]
struct Sample<T> {
    what: T,
    by: JausId,
    at: Instant,
}

impl Picture {
    /// Manual drive requires pose, velocity and status younger than this.
    const DRIVABLE: Duration = Duration::from_secs(1);
    /// A local pose of the same time as a global one is younger than this.
    const PAIR: Duration = Duration::from_millis(300);
    /// What arrives after this time was said after the stop that was sent then.
    const LONGEST_WAY: Duration = Duration::from_secs(2);
    /// A planner that is silent for this time while other parts report is lost.
    const LOST: Duration = Duration::from_secs(2);

    /// Creates an empty picture of a vehicle.
    pub(super) fn new(own: JausId, vehicle: u16, depth: Depth) -> Self {
        Self {
            own,
            directory: Arc::default(),
            vehicle,
            depth,
            name: String::new(),
            parts: BTreeMap::new(),
            gone: GoneParts::default(),
            pose: None,
            georeference: Georeference::default(),
            velocity: None,
            mission: None,
            has_planner_restarted: false,
            was_planner_lost: false,
            path: Vec::new(),
            maps: Vec::new(),
            store: None,
            stop_monitor: StopMonitor::default(),
            stopped: None,
            overlay: MapOverlay::default(),
        }
    }

    pub(super) const fn own(&self) -> JausId {
        self.own
    }

    pub(super) const fn vehicle(&self) -> u16 {
        self.vehicle
    }

    pub(super) const fn depth(&self) -> Depth {
        self.depth
    }

    /// Changes which reports are expected. What was reported is forgotten, because some of it is
    /// not reported any more.
    pub(super) fn set_depth(&mut self, depth: Depth) {
        if self.depth == depth {
            return;
        }
        self.depth = depth;
        self.parts.values_mut().for_each(Part::forget);
        (self.pose, self.velocity, self.mission) = (None, None, None);
        (self.path, self.maps, self.store) = (Vec::new(), Vec::new(), None);
        self.georeference = Georeference::default();
        self.stop_monitor = StopMonitor::default();
        self.overlay.forget();
    }

    pub(super) const fn parts(&self) -> &BTreeMap<JausId, Part> {
        &self.parts
    }

    /// The component with this role in the vehicle.
    pub(super) fn find(&self, role: Role) -> Option<JausId> {
        let mut parts = self.parts.iter();
        parts.find(|(_, part)| part.role == role).map(|(id, _)| *id)
    }

    /// The part whose state stands for the vehicle's.
    pub(super) fn principal(&self) -> Option<JausId> {
        let managed = self.parts.iter().filter(|(_, part)| part.managed);
        managed.min_by_key(|(_, part)| part.role).map(|(id, _)| *id)
    }

    pub(super) fn directory(&self) -> &Directory {
        &self.directory
    }

    pub(super) fn mission(&self) -> Option<&Mission> {
        self.mission.as_ref().map(|known| &known.what)
    }

    /// The component that stores the maps.
    pub(super) const fn store(&self) -> Option<JausId> {
        self.store
    }

    /// The map with this number.
    pub(super) fn map(&self, id: u16) -> Option<state::Map> {
        self.maps.iter().find(|map| map.id == id).cloned()
    }

    /// Whether nothing of the vehicle is known any more.
    pub(super) fn is_empty(&self) -> bool {
        self.parts.is_empty() && self.gone.iter().next().is_none()
    }

    /// Handles a change of the discovered components.
    pub(super) fn handle_directory(&mut self, now: Instant, directory: &Arc<Directory>) {
        self.directory = Arc::clone(directory);
        let known = directory.subsystem(self.vehicle);
        if let Some(identification) = known.and_then(|it| it.identification()) {
            self.name.clone_from(&identification.name);
        }
        self.set_parts(now, known.iter().flat_map(|it| it.components()));
    }

    /// Replaces the components of the vehicle.
    fn set_parts<'c>(
        &mut self,
        now: Instant,
        components: impl Iterator<Item = &'c ComponentEntry>,
    ) {
        let mut parts = BTreeMap::new();
        for component in components {
            let before = self.parts.remove(&component.id);
            let Some(role) = Role::of(component).filter(|_| component.id != self.own) else {
                continue;
            };
            let mut part = before.unwrap_or_else(|| Part::new(role));
            part.describe(component, role);
            parts.insert(component.id, part);
        }
        for (id, part) in std::mem::replace(&mut self.parts, parts) {
            let (role, name, heard) = (part.role, part.name, part.heard);
            let at = now;
            let part = GonePart {
                role,
                name,
                heard,
                at,
            };
            self.gone.insert(id, part);
        }
        let present = self.parts.iter().map(|(id, part)| (*id, part.role));
        self.gone.handle_present(&present.collect::<Vec<_>>());
    }

    pub(super) fn handle_time(&mut self, now: Instant) {
        self.gone.handle_time(now);
        self.was_planner_lost |= self.lost_planner(now).is_some();
    }

    /// Handles a report of a part of the vehicle.
    pub(super) fn handle_report(&mut self, now: Instant, by: JausId, report: Report) {
        let Some(part) = self.parts.get_mut(&by) else {
            return;
        };
        if let Report::Subscription { is_up } = report {
            part.is_down = !is_up;
            return;
        }
        (part.heard, part.is_down) = (Some(now), false);
        match report {
            Report::Status(what) => part.status = Some(Sample { what, by, at: now }),
            Report::Control(what) => part.controller = Some(Sample { what, by, at: now }),
            Report::Stage(stage) => part.stage = Some(stage),
            Report::Pose(what, sampled) => {
                part.pose_age.handle(now, sampled.stamp());
                let at = sample_time(now, by, &part.pose_age, self.pose.as_ref());
                self.pose = Some(Sample { what, by, at });
            }
            Report::GlobalPose(fix) => {
                let local = self
                    .pose
                    .as_ref()
                    .filter(|it| is_within(now, it, Self::PAIR));
                let local = local.map(|it| &it.what);
                self.georeference.handle_fix(now, fix, local);
            }
            Report::Velocity(what, sampled) => {
                part.velocity_age.handle(now, sampled.stamp());
                let at = sample_time(now, by, &part.velocity_age, part.velocity.as_ref());
                part.velocity = Some(Sample { what, by, at });
                self.handle_velocities(now);
            }
            Report::Mission(what) => self.handle_mission(now, by, what),
            Report::Path(path) => self.path = path,
            Report::Maps(maps) => {
                self.maps = maps;
                self.store = Some(by);
            }
            Report::Zones(zones) => self.overlay.handle_zones(zones),
            Report::Scan(scan) => {
                let pose = self.pose.filter(|it| is_within(now, it, Self::PAIR));
                let pose = pose.and_then(|it| located(&it.what));
                self.overlay.handle_scan(now, pose, scan.as_ref());
            }
            Report::Subscription { .. } => {}
        }
    }

    /// Takes the velocity of the vehicle from those that its parts report: the greatest of the fresh ones, because no
    /// source may hide that another one measures motion. An inertial measurement unit reports turn rates without a
    /// speed, which count only where no part reports one.
    fn handle_velocities(&mut self, now: Instant) {
        let limit = self.depth.velocity_counts();
        let reported = self.parts.values().filter_map(|part| part.velocity);
        let greatest = reported.max_by(|one, other| {
            let rank = |it: &Sample<state::Velocity>| {
                let is_fresh = is_within(now, it, limit);
                let age = now.saturating_duration_since(it.at).as_secs_f64();
                let speed = speed(&it.what).filter(|_| is_fresh).unwrap_or(-age);
                (it.what.x.is_some(), is_fresh, speed)
            };
            let (one, other) = (rank(one), rank(other));
            let is_better = (one.0, one.1).cmp(&(other.0, other.1));
            is_better.then(one.2.total_cmp(&other.2))
        });
        if let Some(velocity) = greatest {
            self.velocity = Some(velocity);
            let emergency = self.in_emergency().next().is_some();
            let what = &velocity.what;
            self.stop_monitor.handle_velocity(now, what, emergency);
        }
    }

    /// Handles the report of a mission. A planner that drove and has none any more has restarted:
    /// its mission ended without a report, and is kept for that. Nobody has approved what it drives since.
    fn handle_mission(&mut self, now: Instant, by: JausId, what: Mission) {
        if what.stage.is_idle() {
            self.handle_planner_restart(by);
        }
        if self.has_planner_restarted && (what.stage.is_idle() || what.stage.is_driven()) {
            return;
        }
        (self.has_planner_restarted, self.was_planner_lost) = (false, false);
        self.mission = Some(Sample { what, by, at: now });
    }

    /// Handles the restart of a planner, unless it was known to be lost before.
    pub(super) fn handle_planner_restart(&mut self, planner: JausId) {
        let drove = |it: &Sample<Mission>| it.by == planner && it.what.stage.is_driven();
        let is_new = !self.was_planner_lost && self.mission.as_ref().is_some_and(drove);
        self.has_planner_restarted |= is_new;
    }

    /// The operator drives on: that the planner has restarted is known.
    pub(super) fn forget_planner_restart(&mut self) {
        if std::mem::take(&mut self.has_planner_restarted) {
            self.mission = None;
        }
    }

    /// Why the picture is too old to drive by, as text; `None` if it is not. Only data that some
    /// part of the vehicle offers is expected.
    pub(super) fn stale(&self, now: Instant) -> Option<String> {
        let gone = self.gone.iter();
        let gone = gone.map(|(id, part)| (id, part.role));
        let mut gone = gone.filter(|(_, role)| *role == Role::PrimitiveDriver);
        if let Some((id, role)) = gone.next() {
            return Some(format!("{} {id} is gone", role.words()));
        }
        let driver = self.find(Role::PrimitiveDriver);
        let driver = driver.and_then(|id| self.parts.get(&id));
        let status = driver.and_then(|it| it.status.map(|it| it.at));
        let has_status = driver.is_some_and(|it| it.managed);
        let pose = self.pose.map(|it| it.at);
        let has_pose = pose.is_some() || self.parts.values().any(|it| it.reports_pose);
        let velocity = self.velocity.map(|it| it.at);
        let has_velocity = velocity.is_some() || self.parts.values().any(|it| it.reports_velocity);
        let is_old = |at: Instant| now.saturating_duration_since(at) >= Self::DRIVABLE;
        let topics = [
            ("status", has_status, status),
            ("pose", has_pose, pose),
            ("velocity", has_velocity, velocity),
        ];
        topics
            .into_iter()
            .find_map(|(what, is_expected, at)| match at {
                Some(at) if is_old(at) => Some(format!(
                    "no new {what} for {} s: the picture is stale",
                    Self::DRIVABLE.as_secs()
                )),
                None if is_expected => Some(format!("the {what} is not known yet")),
                _ => None,
            })
    }

    /// Whether the vehicle reports its position.
    pub(super) fn is_position_known(&self) -> bool {
        self.pose
            .is_some_and(|it| it.what.x.is_some() && it.what.y.is_some())
    }

    /// The parts that have disappeared or fallen silent, each with its name and kind of absence.
    pub(super) fn missing(&self, now: Instant) -> impl Iterator<Item = (JausId, &str, Absence)> {
        let gone = self.gone.iter();
        let gone = gone.map(|(id, part)| (id, &*part.name, Absence::Gone));
        let principal = self.principal();
        let silent = self.parts.iter().filter(move |(id, part)| {
            let is_expected = self.depth == Depth::Full || principal == Some(**id);
            is_expected && part.is_silent(now, self.depth.silent())
        });
        let silent = silent.map(|(id, part)| (*id, &*part.name, Absence::Silent));
        gone.chain(silent).chain(self.restarted_planner(now))
    }

    /// A planner that has restarted while it drove is missing as the one that it was.
    fn restarted_planner(&self, now: Instant) -> Option<(JausId, &str, Absence)> {
        let lost = self.lost_planner(now);
        let (id, how) = lost.filter(|(_, how)| *how == Absence::Restarted)?;
        Some((id, &self.parts.get(&id)?.name, how))
    }

    /// The condition of any component of the vehicle that discovery knows, for the tree.
    pub(super) fn condition(&self, now: Instant, id: JausId) -> &'static str {
        match self.parts.get(&id) {
            Some(part) if part.is_silent(now, self.depth.silent()) => Absence::Silent.name(),
            Some(part) => part.status.map_or(PRESENT, |known| state_name(known.what)),
            None => PRESENT,
        }
    }

    /// The planner, if it was lost or has restarted while it drove. When all parts are silent, the network is to
    /// blame, and the planner does not count as lost.
    pub(super) fn lost_planner(&self, now: Instant) -> Option<(JausId, Absence)> {
        let known = self.mission.as_ref();
        let planner = known.filter(|it| it.what.stage.is_driven())?.by;
        if self.gone.get(planner).is_some() {
            return Some((planner, Absence::Gone));
        }
        if self.has_planner_restarted {
            return Some((planner, Absence::Restarted));
        }
        let part = self.parts.get(&planner)?;
        let mut others = self.parts.iter().filter(|(id, _)| **id != planner);
        let is_lost = part.heard.is_some()
            && !part.was_heard_within(Self::LOST, now)
            && others.any(|(_, it)| it.was_heard_within(Self::DRIVABLE, now));
        is_lost.then_some((planner, Absence::Silent))
    }

    /// This station stops the vehicle.
    pub(super) fn handle_stop(&mut self, now: Instant) {
        self.stopped = Some(now);
        let parts = self.parts.values_mut();
        parts.for_each(|part| part.has_answered_stop = false);
    }

    /// A part has acknowledged the stop of this station, and reported its state after that.
    pub(super) fn handle_stop_answered(&mut self, part: JausId) {
        if let Some(part) = self.parts.get_mut(&part) {
            part.has_answered_stop = true;
        }
    }

    /// The parts that can enter emergency and have not recently reported that of this station's last stop.
    pub(super) fn not_in_emergency(&self, now: Instant) -> impl Iterator<Item = JausId> {
        let stands = move |part: &Part| {
            part.status.is_some_and(|status| {
                let is_recent = now.saturating_duration_since(status.at) < self.depth.fresh();
                // Some peers acknowledge nothing.
                let is_later = self
                    .stopped
                    .is_none_or(|at| status.at >= at + Self::LONGEST_WAY);
                let is_of_stop = part.has_answered_stop || is_later;
                part.is(State::Emergency) && is_recent && is_of_stop
            })
        };
        let managed = self.parts.iter().filter(|(_, part)| part.managed);
        managed
            .filter(move |(_, part)| !stands(part))
            .map(|(id, _)| *id)
    }

    /// Whether it reports an emergency: if this station has stopped it, whether every part has confirmed that.
    fn is_in_emergency(&self, now: Instant, is_stopped: bool) -> bool {
        let any = self.in_emergency().next().is_some();
        any && !(is_stopped && self.not_in_emergency(now).next().is_some())
    }

    /// The parts in emergency.
    pub(super) fn in_emergency(&self) -> impl Iterator<Item = JausId> {
        let stopped = self
            .parts
            .iter()
            .filter(|(_, part)| part.is(State::Emergency));
        stopped.map(|(id, _)| *id)
    }

    /// The velocity, if its sample is fresh enough to tell whether the vehicle is at rest.
    fn fresh_velocity(&self, now: Instant) -> Option<state::Velocity> {
        let limit = self.depth.velocity_counts();
        let fresh = self.velocity.filter(|it| is_within(now, it, limit));
        fresh.map(|it| it.what)
    }

    /// Whether the vehicle is at rest by its measured velocity; `None` if that is unknown.
    pub(super) fn at_rest(&self, now: Instant) -> Option<bool> {
        StopMonitor::at_rest(&self.fresh_velocity(now)?)
    }

    /// Whether the vehicle moves in an emergency and does not slow down.
    pub(super) fn is_runaway(&self, now: Instant) -> bool {
        self.stop_monitor.is_runaway() && self.fresh_velocity(now).is_some()
    }

    /// Why a driver holds the vehicle. Of several drivers the one nearest to the motors counts: the
    /// others wait for it.
    pub(super) fn hold_reason(&self, now: Instant) -> Option<state::HoldReason> {
        if self.in_emergency().next().is_some() {
            return None;
        }
        // While an operator has the primitive driver, the others only say that they have not.
        let primitive = self.find(Role::PrimitiveDriver);
        let primitive = primitive.and_then(|id| self.parts.get(&id)?.controller());
        let is_by_hand = primitive.is_some_and(|id| id.subsystem() != self.vehicle);
        let holding = self
            .parts
            .iter()
            .filter(|(_, part)| !is_by_hand || part.role == Role::PrimitiveDriver)
            .filter_map(|(id, part)| Some((part.role, id, part.hold_reason(now)?)));
        let (role, id, reason) = holding.min_by_key(|(role, ..)| *role)?;
        Some(state::HoldReason {
            role: role.name(),
            id: id.to_string(),
            reason: reason.to_owned(),
        })
    }

    /// The components in Failure, each with a description.
    pub(super) fn faults(&self) -> impl Iterator<Item = (JausId, String)> {
        let failed = self
            .parts
            .iter()
            .filter(|(_, part)| part.is(State::Failure));
        failed.map(|(id, part)| {
            let reason = part.stage.as_ref().map_or("", |it| &*it.reason);
            let reason = if reason.is_empty() {
                String::new()
            } else {
                format!(": {reason}")
            };
            (*id, format!("{} {id} reports a failure{reason}", part.name))
        })
    }

    /// The operator in control of the vehicle with the greatest authority. The vehicle's own parts
    /// control each other during a mission, which does not count.
    pub(super) fn holder(&self) -> Option<(JausId, u8)> {
        let parts = self.parts.values().filter(|part| part.role.is_commanded());
        let controllers = parts.filter_map(|part| part.controller?.what);
        let operators = controllers.filter(|(id, _)| id.subsystem() != self.vehicle);
        operators.max_by_key(|(_, authority)| *authority)
    }

    /// The part under control of this operator that passes on requests for control.
    pub(super) fn handoff_part(&self, holder: JausId) -> Option<JausId> {
        let held = self
            .parts
            .iter()
            .filter(|(_, part)| part.controller() == Some(holder));
        let mut ids = held.map(|(id, _)| *id);
        ids.find(|id| {
            let component = self.directory.component(*id);
            component.is_some_and(|it| it.offers(enhanced_access_control::URN))
        })
    }
}

/// Condition of a component without a known state.
pub(super) const PRESENT: &str = "present";

fn is_within<T>(now: Instant, sample: &Sample<T>, limit: Duration) -> bool {
    now.saturating_duration_since(sample.at) < limit
}

/// The pose for calculations; `None` if a coordinate is unknown.
fn located(pose: &state::Pose) -> Option<motion::Pose> {
    let (x, y) = pose.x.zip(pose.y)?;
    Some(motion::Pose {
        yaw: pose.yaw?,
        ..motion::Pose::at(x, y)
    })
}

fn state_name(code: u8) -> &'static str {
    State::from_code(code).map_or("unknown", State::name)
}

/// The time of a sensor's last sample. Its first sample counts as taken on arrival, until the next one
/// shows whether its time stamps advance.
fn sample_time<T>(now: Instant, by: JausId, age: &SampleAge, known: Option<&Sample<T>>) -> Instant {
    let first = || known.filter(|it| it.by == by).map(|it| it.at);
    age.sampled_at().or_else(first).unwrap_or(now)
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests;
