//! What a page shows: one snapshot of everything, so that a page that connects again needs nothing
//! else. What is not known is `null`.

use serde::Serialize;

/// Everything a page shows, at one moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct State {
    /// Counts the snapshots.
    pub seq: u64,
    /// When it was taken, RFC 3339 in UTC.
    pub time: String,
    /// The operator's own id.
    pub operator: String,
    /// Everybody who is known.
    pub tree: Vec<Subsystem>,
    /// The chosen vehicle.
    pub vehicle: Option<Vehicle>,
    /// Whether the operator is in control of it.
    pub control: Control,
    /// Manual drive.
    pub drive: Drive,
    /// The planner's mission.
    pub mission: Option<Mission>,
    /// The map to show.
    pub map: Option<Map>,
}

/// A subsystem of the tree.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Subsystem {
    /// Its number.
    pub subsystem: u16,
    /// What it is called.
    pub name: String,
    /// What it is, for example `vehicle`.
    pub kind: String,
    /// Its nodes.
    pub nodes: Vec<Node>,
}

/// A node of the tree.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Node {
    /// Its number.
    pub node: u8,
    /// What it is called.
    pub name: String,
    /// Its components.
    pub components: Vec<Component>,
}

/// A component of the tree.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Component {
    /// Its id.
    pub id: String,
    /// What it is called.
    pub name: String,
    /// What it offers.
    pub services: Vec<Service>,
}

/// A service that a component offers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Service {
    /// Its name.
    pub urn: String,
    /// Major and minor version, as `1.0`.
    pub version: String,
}

/// The chosen vehicle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Vehicle {
    /// Its number.
    pub subsystem: u16,
    /// What it is called.
    pub name: String,
    /// Where it is.
    pub pose: Option<Pose>,
    /// How it moves.
    pub velocity: Option<Velocity>,
    /// Its components that can be managed or that the operator needs.
    pub parts: Vec<Part>,
    /// Those that have disappeared or fallen silent.
    pub missing: Vec<Missing>,
    /// Why the picture is too old to drive by; `null` if it is not.
    pub stale: Option<String>,
    /// Whether it is stopped by an emergency: every part that can be, if this operator wants it.
    pub emergency: bool,
}

/// Where a vehicle is, in the local frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pose {
    /// Metres to the north; `null` if unknown.
    pub x: Option<f64>,
    /// Metres to the east; `null` if unknown.
    pub y: Option<f64>,
    /// Radians clockwise from north; `null` if unknown.
    pub yaw: Option<f64>,
    /// Milliseconds since the sample was taken, by its time stamp; without one, since the report
    /// arrived.
    pub age_ms: u64,
}

/// How a vehicle moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Velocity {
    /// Metres per second ahead; `null` if unknown.
    pub x: Option<f64>,
    /// Radians per second clockwise; `null` if unknown.
    pub yaw_rate: Option<f64>,
    /// Milliseconds since the sample was taken, as for the pose.
    pub age_ms: u64,
}

/// A component of the vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Part {
    /// Its id.
    pub id: String,
    /// What it does in the vehicle, for example `primitive_driver`.
    pub role: &'static str,
    /// Whether it can be managed: a sensor or a store has no state, and nobody controls it.
    pub managed: bool,
    /// Its state in Management, for example `ready`.
    pub state: Option<&'static str>,
    /// Milliseconds since it reported that state.
    pub state_age_ms: Option<u64>,
    /// Who controls it.
    pub controller: Option<String>,
    /// With which authority.
    pub authority: Option<u8>,
    /// Whether this operator controls it.
    pub ours: bool,
    /// Why it is not under control though that is wanted.
    pub obstacle: Option<String>,
    /// How far its stage of the waterfall is.
    pub stage: Option<Stage>,
    /// Milliseconds since it last reported anything.
    pub age_ms: Option<u64>,
}

/// A component of the vehicle that has disappeared or fallen silent.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Missing {
    /// Its id.
    pub id: String,
    /// What it does in the vehicle, for example `primitive_driver`.
    pub role: &'static str,
    /// The same for people, for example `Primitive Driver`.
    pub name: String,
    /// `gone` if Discovery has lost it, `silent` if its reports have stopped.
    pub how: &'static str,
    /// Milliseconds since its last report.
    pub age_ms: Option<u64>,
}

/// How far a stage is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Stage {
    /// For example `active`.
    pub state: &'static str,
    /// Percent.
    pub progress: u8,
    /// Why it does not go on.
    pub reason: String,
}

/// Whether the operator is in control.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Default)]
pub struct Control {
    /// Control of what is needed now is held: of the primitive driver, or of the planner while it
    /// drives.
    pub held: bool,
    /// Whether it is wanted.
    pub wanted: bool,
    /// What is in the way.
    pub reason: String,
}

/// Manual drive.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Drive {
    /// Whether somebody drives.
    pub active: bool,
    /// Ahead, -1 to 1.
    pub forward: f64,
    /// To the right, -1 to 1.
    pub turn: f64,
    /// Why the station ended it although the stick was not let go; empty otherwise.
    pub reason: String,
}

/// The planner's mission.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mission {
    /// Its number.
    pub mission: u32,
    /// How far it is, for example `driving`.
    pub stage: &'static str,
    /// Which try this is.
    pub attempt: u8,
    /// How many there are at most.
    pub attempts: u8,
    /// Percent.
    pub progress: u8,
    /// Metres north and east.
    pub destination: [f64; 2],
    /// How much of the path lies ahead.
    pub remaining_m: f64,
    /// Why it does not go on.
    pub reason: String,
    /// The points of its path, metres north and east, at most 500.
    pub path: Vec<[f64; 2]>,
    /// Milliseconds since it was reported.
    pub age_ms: u64,
    /// The planner, if it was lost while it drove.
    pub lost: Option<LostPlanner>,
}

/// A planner that was lost while it drove.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LostPlanner {
    /// Its id.
    pub id: String,
    /// `gone` or `silent`, as for [`Missing`].
    pub how: &'static str,
    /// Whether this station has told the drivers to stop: it can if it controlled the planner.
    pub told_to_stop: bool,
}

/// A map of the vehicle's world model; its cells are asked for separately.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Map {
    /// Its number.
    pub id: u16,
    /// What it is called.
    pub name: String,
    /// Cells along X.
    pub rows: u16,
    /// Cells along Y.
    pub columns: u16,
    /// How long and wide a cell is.
    pub cell_m: f64,
    /// Metres north of its south-west corner.
    pub x: f64,
    /// Metres east of its south-west corner.
    pub y: f64,
    /// Raised by every change.
    pub revision: u32,
}

/// A map at one of its revisions.
pub(crate) type Edition = (u16, u32);

impl Map {
    pub(crate) const fn edition(&self) -> Edition {
        (self.id, self.revision)
    }
}
