//! The vehicle: its components by Discovery, what they offer to ROS, and their states.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::messages::core::management;
use jaus::messages::mobility::{
    global_pose_sensor, local_pose_sensor, local_waypoint_driver, primitive_driver,
    velocity_state_driver, velocity_state_sensor,
};
use jaus::service::{ComponentEntry, Directory, State};
use jaus_vehicle::messages::ground::mission_planner;

/// A service by which ROS sees or commands the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// State and emergencies.
    Management,
    /// The pose in the local frame.
    LocalPose,
    /// The position on the globe.
    GlobalPose,
    /// The velocity.
    VelocityState,
    /// Drives at a velocity.
    VelocityDriver,
    /// Drives by efforts.
    PrimitiveDriver,
    /// Drives to a place on a path that it plans.
    Planner,
    /// Drives to a place.
    WaypointDriver,
}

impl Role {
    const ALL: [(Self, &'static str); 8] = [
        (Self::Management, management::URN),
        (Self::LocalPose, local_pose_sensor::URN),
        (Self::GlobalPose, global_pose_sensor::URN),
        (Self::VelocityState, velocity_state_sensor::URN),
        (Self::VelocityDriver, velocity_state_driver::URN),
        (Self::PrimitiveDriver, primitive_driver::URN),
        (Self::Planner, mission_planner::URN),
        (Self::WaypointDriver, local_waypoint_driver::URN),
    ];

    /// The roles by which ROS drives, the best first.
    ///
    /// A velocity state driver controls the velocity itself. A primitive driver gets the share of its
    /// full effort, because that is what a vehicle has at least. A local vector driver cannot be
    /// used: it takes no negative speed, and a heading instead of a turn rate.
    const DRIVE: [Self; 2] = [Self::VelocityDriver, Self::PrimitiveDriver];
    /// The roles by which ROS sets goals, the best first. A planner goes around obstacles.
    const GOAL: [Self; 2] = [Self::Planner, Self::WaypointDriver];
}

/// Which components belong to the vehicle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selection {
    /// The subsystem.
    pub subsystem: u16,
    /// Ids with wildcards; empty for all of the subsystem.
    pub only: Vec<JausId>,
}

/// A component of the vehicle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Part {
    /// Its name; may be empty.
    pub name: String,
    roles: Vec<Role>,
    status: Option<(u8, Instant)>,
    controller: Option<Controller>,
}

/// The client in control of a component, with its authority; `None` if there is none.
pub type Controller = Option<(JausId, u8)>;

/// What is known of the vehicle.
#[derive(Debug)]
pub struct Vehicle {
    own: JausId,
    selection: Selection,
    parts: BTreeMap<JausId, Part>,
}

impl Selection {
    fn includes(&self, id: JausId) -> bool {
        let is_selected = |only: &JausId| only.matches(id);
        id.subsystem() == self.subsystem
            && (self.only.is_empty() || self.only.iter().any(is_selected))
    }
}

impl Part {
    /// Whether it offers this service.
    #[must_use]
    pub fn has(&self, role: Role) -> bool {
        self.roles.contains(&role)
    }

    /// The state that it has reported within this time, if any.
    #[must_use]
    pub fn state(&self, now: Instant, within: Duration) -> Option<Result<State, u8>> {
        let (code, at) = self.status?;
        let is_recent = now.saturating_duration_since(at) <= within;
        is_recent.then_some(State::from_code(code).ok_or(code))
    }

    /// The age of its last status report.
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        let (_, at) = self.status?;
        Some(now.saturating_duration_since(at))
    }

    /// The client in control; `None` before a report.
    #[must_use]
    pub const fn controller(&self) -> Option<Controller> {
        self.controller
    }

    fn describe(&mut self, entry: &ComponentEntry) {
        let name = entry.identification.as_ref().map(|it| it.name.clone());
        self.name = name.unwrap_or_default();
        let offered = Role::ALL.iter().filter(|(_, urn)| entry.offers(urn));
        self.roles = offered.map(|(role, _)| *role).collect();
    }
}

impl Vehicle {
    /// A vehicle of which nothing is known yet. `own` is the id of the bridge, which is no part of
    /// it.
    #[must_use]
    pub const fn new(own: JausId, selection: Selection) -> Self {
        Self {
            own,
            selection,
            parts: BTreeMap::new(),
        }
    }

    /// Handles a new directory.
    pub fn handle_directory(&mut self, directory: &Directory) {
        let is_part = |id: JausId| id != self.own && self.selection.includes(id);
        let subsystem = directory.subsystem(self.selection.subsystem);
        let entries = subsystem.into_iter().flat_map(|it| it.components());
        let mut before = std::mem::take(&mut self.parts);
        for entry in entries.filter(|entry| is_part(entry.id)) {
            let mut part = before.remove(&entry.id).unwrap_or_default();
            part.describe(entry);
            self.parts.insert(entry.id, part);
        }
    }

    /// Handles a report of a component's state.
    pub fn handle_status(&mut self, now: Instant, id: JausId, code: u8) {
        if let Some(part) = self.parts.get_mut(&id) {
            part.status = Some((code, now));
        }
    }

    /// Handles a report of the client in control of a component.
    pub fn handle_controller(&mut self, id: JausId, controller: Controller) {
        if let Some(part) = self.parts.get_mut(&id) {
            part.controller = Some(controller);
        }
    }

    /// Its components.
    #[must_use]
    pub const fn parts(&self) -> &BTreeMap<JausId, Part> {
        &self.parts
    }

    /// The component with this role; with several, the one with the lowest id.
    #[must_use]
    pub fn find(&self, role: Role) -> Option<JausId> {
        self.all(role).next()
    }

    /// The components with this role, in order.
    pub fn all(&self, role: Role) -> impl Iterator<Item = JausId> {
        let parts = self.parts.iter();
        parts
            .filter(move |(_, part)| part.has(role))
            .map(|(id, _)| *id)
    }

    fn first(&self, roles: [Role; 2]) -> Option<(JausId, Role)> {
        let mut found = roles
            .into_iter()
            .filter_map(|role| Some((self.find(role)?, role)));
        found.next()
    }

    /// The component that takes velocities, and how.
    #[must_use]
    pub fn drive(&self) -> Option<(JausId, Role)> {
        self.first(Role::DRIVE)
    }

    /// The component that takes goals, and how.
    #[must_use]
    pub fn goal(&self) -> Option<(JausId, Role)> {
        self.first(Role::GOAL)
    }
}
