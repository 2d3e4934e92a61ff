//! What the operator's station knows of its vehicle: reports come in, snapshots for the pages go
//! out. Knows no network and no clock.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::report::{Mission, Report};
use super::role::{self, Role};
use super::state;
use crate::address::JausId;
use crate::service::{Directory, Kind, State};

/// The vehicle as it is known.
#[derive(Debug)]
pub(super) struct Picture {
    own: JausId,
    directory: Arc<Directory>,
    vehicle: Option<u16>,
    parts: BTreeMap<JausId, Part>,
    pose: Option<Told<state::Pose>>,
    velocity: Option<Told<state::Velocity>>,
    mission: Option<Told<Mission>>,
    path: Vec<[f64; 2]>,
    maps: Vec<state::Map>,
    store: Option<JausId>,
}

/// A component of the vehicle.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) role: Role,
    /// Whether it offers Management.
    pub(super) managed: bool,
    status: Option<Told<u8>>,
    /// Who controls it, with which authority.
    controller: Option<Told<Option<(JausId, u8)>>>,
    stage: Option<state::Stage>,
    heard: Option<Instant>,
}

/// What was reported, by whom and when.
#[derive(Debug, Clone, Copy)]
struct Told<T> {
    what: T,
    by: JausId,
    at: Instant,
}

impl Part {
    fn new(role: Role, managed: bool) -> Self {
        Self {
            role,
            managed,
            status: None,
            controller: None,
            stage: None,
            heard: None,
        }
    }

    pub(super) fn is(&self, state: State) -> bool {
        self.status.is_some_and(|it| it.what == state as u8)
    }

    /// Whether it has said since `since` that it stands by.
    pub(super) fn stands_by(&self, since: Instant) -> bool {
        self.is(State::Standby) && self.status.is_some_and(|it| it.at > since)
    }

    /// Whether it has said since `since` that somebody other than `own`, or nobody, controls it;
    /// who does.
    pub(super) fn disowns(&self, own: JausId, since: Instant) -> Option<Option<JausId>> {
        let told = self.controller.filter(|it| it.at > since)?;
        let controller = told.what.map(|(id, _)| id);
        (controller != Some(own)).then_some(controller)
    }

    pub(super) fn controller(&self) -> Option<JausId> {
        self.told_controller()?
    }

    /// Who controls it, or that nobody does, once it has said so.
    pub(super) fn told_controller(&self) -> Option<Option<JausId>> {
        Some(self.controller?.what.map(|(id, _)| id))
    }
}

impl Picture {
    /// A report that is older counts for nothing when the vehicle's safety is at stake.
    const FRESH: Duration = Duration::from_secs(2);

    /// Nothing is known yet; `vehicle` is the one to look at, the first that turns up if there is
    /// none.
    pub(super) fn new(own: JausId, vehicle: Option<u16>) -> Self {
        Self {
            own,
            directory: Arc::default(),
            vehicle,
            parts: BTreeMap::new(),
            pose: None,
            velocity: None,
            mission: None,
            path: Vec::new(),
            maps: Vec::new(),
            store: None,
        }
    }

    pub(super) const fn vehicle(&self) -> Option<u16> {
        self.vehicle
    }

    pub(super) const fn parts(&self) -> &BTreeMap<JausId, Part> {
        &self.parts
    }

    /// The component that does something in the vehicle.
    pub(super) fn find(&self, role: Role) -> Option<JausId> {
        let mut parts = self.parts.iter();
        parts.find(|(_, part)| part.role == role).map(|(id, _)| *id)
    }

    pub(super) fn directory(&self) -> &Directory {
        &self.directory
    }

    pub(super) fn mission(&self) -> Option<&Mission> {
        self.mission.as_ref().map(|told| &told.what)
    }

    /// The component that keeps the maps.
    pub(super) const fn store(&self) -> Option<JausId> {
        self.store
    }

    /// One of its maps.
    pub(super) fn map(&self, id: u16) -> Option<state::Map> {
        self.maps.iter().find(|map| map.id == id).cloned()
    }

    /// Another vehicle is chosen.
    ///
    /// # Errors
    /// If there is none with this number: why not, in words.
    pub(super) fn select(&mut self, subsystem: u16) -> Result<(), String> {
        if !role::is_vehicle(&self.directory, subsystem) || subsystem == self.own.subsystem() {
            return Err(format!(
                "subsystem {subsystem} is not known as a vehicle; choose one of the tree"
            ));
        }
        if self.vehicle != Some(subsystem) {
            let directory = self.directory.clone();
            *self = Self::new(self.own, Some(subsystem));
            self.handle_directory(directory);
        }
        Ok(())
    }

    /// Somebody came, changed or went.
    pub(super) fn handle_directory(&mut self, directory: Arc<Directory>) {
        self.directory = directory;
        self.vehicle = self.vehicle.or_else(|| self.first_vehicle());
        let known = self.vehicle.and_then(|it| self.directory.subsystem(it));
        let mut parts = BTreeMap::new();
        for component in known.iter().flat_map(|it| it.components()) {
            let Some(role) = Role::of(component).filter(|_| component.id != self.own) else {
                continue;
            };
            let managed = role::is_managed(component);
            let before = self.parts.remove(&component.id);
            let part = before.map_or_else(
                || Part::new(role, managed),
                |part| Part {
                    role,
                    managed,
                    ..part
                },
            );
            parts.insert(component.id, part);
        }
        self.parts = parts;
    }

    fn first_vehicle(&self) -> Option<u16> {
        let others = || {
            let own = self.own.subsystem();
            let all = self.directory.subsystems();
            all.filter(move |(id, _)| *id != own && role::is_vehicle(&self.directory, *id))
        };
        let is_vehicle = |it: &crate::service::Subsystem| {
            it.identification()
                .is_some_and(|it| it.kind == Kind::Vehicle)
        };
        let named = others().find(|(_, subsystem)| is_vehicle(subsystem));
        named.or_else(|| others().next()).map(|(id, _)| id)
    }

    /// A part of the vehicle has told something.
    pub(super) fn handle_report(&mut self, now: Instant, by: JausId, report: Report) {
        let Some(part) = self.parts.get_mut(&by) else {
            return;
        };
        part.heard = Some(now);
        match report {
            Report::Status(what) => part.status = Some(Told { what, by, at: now }),
            Report::Control(what) => part.controller = Some(Told { what, by, at: now }),
            Report::Stage(stage) => part.stage = Some(stage),
            Report::Pose(what) => self.pose = Some(Told { what, by, at: now }),
            Report::Velocity(what) => self.velocity = Some(Told { what, by, at: now }),
            Report::Mission(what) => self.mission = Some(Told { what, by, at: now }),
            Report::Path(path) => self.path = path,
            Report::Maps(maps) => {
                self.maps = maps;
                self.store = Some(by);
            }
        }
    }

    /// The parts that can be stopped by an emergency and have not said lately that they are.
    pub(super) fn not_in_emergency(&self, now: Instant) -> impl Iterator<Item = JausId> {
        let stands = move |part: &Part| {
            let fresh = |it: &Told<u8>| now.saturating_duration_since(it.at) < Self::FRESH;
            part.is(State::Emergency) && part.status.as_ref().is_some_and(fresh)
        };
        let managed = self.parts.iter().filter(|(_, part)| part.managed);
        managed
            .filter(move |(_, part)| !stands(part))
            .map(|(id, _)| *id)
    }

    /// The parts that are stopped by an emergency.
    pub(super) fn in_emergency(&self) -> impl Iterator<Item = JausId> {
        let stopped = self
            .parts
            .iter()
            .filter(|(_, part)| part.is(State::Emergency));
        stopped.map(|(id, _)| *id)
    }

    /// What is known of everybody.
    pub(super) fn tree(&self) -> Vec<state::Subsystem> {
        super::tree::of(&self.directory)
    }

    /// What is known of the vehicle. `obstacle` says why a part is not under control.
    pub(super) fn vehicle_state(
        &self,
        now: Instant,
        emergency_wanted: bool,
        obstacle: impl Fn(JausId) -> Option<String>,
    ) -> Option<state::Vehicle> {
        let subsystem = self.vehicle?;
        let known = self.directory.subsystem(subsystem)?;
        let mut parts: Vec<_> = self.parts.iter().collect();
        parts.sort_by_key(|(id, part)| (part.role, **id));
        let describe =
            |(id, part): (&JausId, &Part)| self.part_state(now, *id, part, obstacle(*id));
        let any = self.in_emergency().next().is_some();
        let all = any && self.not_in_emergency(now).next().is_none();
        Some(state::Vehicle {
            subsystem,
            name: known
                .identification()
                .map_or_else(String::new, |it| it.name.clone()),
            pose: self.pose.map(|told| state::Pose {
                age_ms: age(now, told.at),
                ..told.what
            }),
            velocity: self.velocity.map(|told| state::Velocity {
                age_ms: age(now, told.at),
                ..told.what
            }),
            parts: parts.into_iter().map(describe).collect(),
            emergency: if emergency_wanted { all } else { any },
        })
    }

    fn part_state(
        &self,
        now: Instant,
        id: JausId,
        part: &Part,
        obstacle: Option<String>,
    ) -> state::Part {
        let controller = part.controller.and_then(|told| told.what);
        state::Part {
            id: id.to_string(),
            role: part.role.name(),
            managed: part.managed,
            state: part.status.map(|told| state_name(told.what)),
            controller: controller.map(|(id, _)| id.to_string()),
            authority: controller.map(|(_, authority)| authority),
            ours: controller.is_some_and(|(id, _)| id == self.own),
            obstacle,
            stage: part.stage.clone(),
            age_ms: part.heard.map(|at| age(now, at)),
        }
    }

    /// The mission with its path.
    pub(super) fn mission_state(&self, now: Instant) -> Option<state::Mission> {
        let told = self.mission.as_ref()?;
        self.parts.contains_key(&told.by).then(|| state::Mission {
            path: self.path.clone(),
            age_ms: age(now, told.at),
            ..told.what.state()
        })
    }

    /// The map to show: the one of the planner, or the first.
    pub(super) fn map_state(&self) -> Option<state::Map> {
        let traversability = |map: &&state::Map| map.name == "traversability";
        let map = self.maps.iter().find(traversability);
        map.or_else(|| self.maps.first()).cloned()
    }
}

/// Milliseconds since then.
fn age(now: Instant, then: Instant) -> u64 {
    let age = now.saturating_duration_since(then).as_millis();
    u64::try_from(age).unwrap_or(u64::MAX)
}

fn state_name(status: u8) -> &'static str {
    match status {
        0 => "initialize",
        1 => "ready",
        2 => "standby",
        3 => "shutdown",
        4 => "failure",
        5 => "emergency",
        _ => "unknown",
    }
}
