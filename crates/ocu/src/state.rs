//! Snapshots for pages: the vehicle of the page, the list of vehicles, and the tree of components. Each
//! one is complete, so that a reconnecting page needs nothing else; of the first kind a page then gets the
//! changes. Unknown values are `null`.

use std::time::Instant;

use serde::{Serialize, Serializer};

/// Snapshot of the vehicle that a page has selected.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct State {
    /// Snapshot counter.
    pub seq: u64,
    /// Time of the snapshot, RFC 3339 in UTC.
    pub time: String,
    /// The operator's own JAUS id.
    pub operator: String,
    /// The selected vehicle.
    pub vehicle: Option<VehicleState>,
    /// Control of the vehicle.
    pub control: Control,
    /// Manual drive.
    pub drive: Drive,
    /// The planner's mission.
    pub mission: Option<Mission>,
    /// The map to show.
    pub map: Option<Map>,
    /// Number of the latest event in the log of the station.
    pub events: u64,
    /// How many stops of all pages the station has taken, without copies of them.
    pub stops: u64,
}

/// The list of vehicles.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fleet {
    /// The vehicles, by subsystem number.
    pub vehicles: Vec<FleetVehicle>,
    /// Whether all vehicles are to be in emergency, also those that appear later.
    pub all_stopped: bool,
    /// How many stops of all pages the station has taken, without copies of them.
    pub stops: u64,
}

/// A vehicle in the list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FleetVehicle {
    /// Subsystem number.
    pub subsystem: u16,
    /// Name.
    pub name: String,
    /// The operator of this station who controls it, with the page; empty if none does.
    pub driver: String,
    /// `present`, `silent` if its reports have ceased, `gone` if discovery has lost it, or
    /// `unknown` if it was never discovered.
    pub presence: &'static str,
    /// Management state of its primitive driver, or of the part that stands in for it.
    pub state: Option<&'static str>,
    /// Whether it reports an emergency. If this station has set it: whether every part has confirmed that.
    pub emergency: bool,
    /// Whether this station has put it in emergency, and repeats that until all parts confirm it.
    pub stop_set: bool,
    /// Measured forward speed in metres per second; `null` without a fresh measurement.
    pub speed: Option<f64>,
    /// Whether it is at rest by that measurement; `null` without one.
    pub at_rest: Option<bool>,
    /// Whether it moves in an emergency and does not slow down.
    pub runaway: bool,
    /// JAUS id of the operator in control.
    pub controller: Option<String>,
    /// Authority of that operator.
    pub authority: Option<u8>,
    /// Whether this station controls it.
    pub held: bool,
    /// Whether another operator requests the control that this station has.
    pub requested: bool,
    /// Stage of its mission; `null` without one.
    pub mission: Option<&'static str>,
    /// Milliseconds since its last report.
    pub age_ms: Option<u64>,
}

/// The tree of all known components.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Tree {
    /// All known subsystems.
    pub subsystems: Vec<TreeSubsystem>,
}

/// A subsystem of the tree.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TreeSubsystem {
    /// Subsystem number.
    pub subsystem: u16,
    /// Name.
    pub name: String,
    /// Kind, for example `vehicle`.
    pub kind: String,
    /// Nodes of the subsystem.
    pub nodes: Vec<TreeNode>,
}

/// A node of the tree.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TreeNode {
    /// Node number.
    pub node: u8,
    /// Name.
    pub name: String,
    /// Components of the node.
    pub components: Vec<TreeComponent>,
}

/// A component of the tree.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TreeComponent {
    /// JAUS id.
    pub id: String,
    /// Name.
    pub name: String,
    /// Management state, for example `ready`, if it reports it to this station; otherwise
    /// `present`. `silent` if its reports have ceased, `gone` if discovery has lost it.
    pub state: &'static str,
    /// Services offered.
    pub services: Vec<TreeService>,
}

/// A service that a component offers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TreeService {
    /// URN.
    pub urn: String,
    /// Major and minor version, as `1.0`.
    pub version: String,
}

/// The selected vehicle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VehicleState {
    /// Subsystem number.
    pub subsystem: u16,
    /// Name.
    pub name: String,
    /// Pose.
    pub pose: Option<Pose>,
    /// Where its local frame is on the globe; `null` if it has reported no global pose.
    pub place: Option<Place>,
    /// Velocity.
    pub velocity: Option<Velocity>,
    /// Milliseconds since its primitive driver reported its management state.
    pub status_age_ms: Option<u64>,
    /// Components that offer Management or matter to the operator.
    pub parts: Vec<Part>,
    /// Components that have disappeared or fallen silent.
    pub missing: Vec<Missing>,
    /// Why the picture is too old to drive by; `null` if it is not.
    pub stale: Option<String>,
    /// Whether the vehicle reports an emergency. If this operator has set it: whether every part has
    /// confirmed it. It says nothing of the vehicle's motion.
    pub emergency: bool,
    /// Whether the emergency is one that other clients have set, or the vehicle's own.
    pub emergency_of_others: bool,
    /// Whether this station has put it in emergency, and repeats that until all parts confirm it.
    pub stop_set: bool,
    /// Whether the vehicle is at rest by its measured velocity; `null` without a fresh measurement.
    pub at_rest: Option<bool>,
    /// Whether the vehicle moves in an emergency and does not slow down.
    pub runaway: bool,
    /// Why a driver holds the vehicle although it is commanded to move; `null` if none does.
    pub held: Option<HoldReason>,
    /// Revisions of the overlay of the map, which has its own request.
    pub overlay: OverlayRevision,
}

/// Why a driver holds the vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HoldReason {
    /// Role of the driver, for example `primitive_driver`.
    pub role: &'static str,
    /// JAUS id of the driver.
    pub id: String,
    /// The reason, in the driver's words.
    pub reason: String,
}

/// Revisions of the parts of an [`Overlay`]; 0 before the first report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct OverlayRevision {
    /// Revision of the zones.
    pub zones: u32,
    /// Revision of the scan and the obstacles.
    pub scan: u32,
    /// Milliseconds since the last scan.
    pub scan_age_ms: Option<u64>,
}

/// What lies over the map: operating zones, the last scan, and obstacles. Coordinates are metres
/// north and east.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Overlay {
    /// Revision of the zones.
    pub zones_revision: u32,
    /// The zones; `null` if the page has them.
    pub zones: Option<Vec<Zone>>,
    /// Number of further zones, which are not sent.
    pub omitted_zones: usize,
    /// Why the vehicle's zones cannot be shown; empty if they can.
    pub problem: String,
    /// Revision of the scan and the obstacles.
    pub scan_revision: u32,
    /// Where the last scan met something.
    pub scan: Vec<[f64; 2]>,
    /// Side length of an obstacle in metres.
    pub cell_m: f64,
    /// Middles of the cells in which scans of the last 30 s have shown something.
    pub obstacles: Vec<[f64; 2]>,
}

/// An operating zone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Zone {
    /// 1 for the zone that the vehicle must stay in, greater for one that it must keep out of.
    pub number: u16,
    /// Vertices of the polygon.
    pub points: Vec<[f64; 2]>,
}

/// Pose of a vehicle in the local frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pose {
    /// Metres north; `null` if unknown.
    #[serde(serialize_with = "rounded")]
    pub x: Option<f64>,
    /// Metres east; `null` if unknown.
    #[serde(serialize_with = "rounded")]
    pub y: Option<f64>,
    /// Radians clockwise from north; `null` if unknown.
    #[serde(serialize_with = "rounded")]
    pub yaw: Option<f64>,
    /// Milliseconds since the sample was taken according to its time stamp, or since the report
    /// arrived without a stamp.
    pub age_ms: u64,
}

/// The origin of the local frame on the globe (WGS 84).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Place {
    /// Degrees north.
    pub latitude: f64,
    /// Degrees east.
    pub longitude: f64,
    /// Direction of X in radians clockwise from true north.
    pub heading: f64,
    /// The last reported global pose; `null` if it is unknown now.
    pub fix: Option<Fix>,
}

/// A global pose of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fix {
    /// Degrees north.
    pub latitude: f64,
    /// Degrees east.
    pub longitude: f64,
    /// The same position in the frame of [`Place`], in metres along X.
    pub x: f64,
    /// Metres along Y.
    pub y: f64,
    /// Radians clockwise from X; `null` if unknown.
    pub yaw: Option<f64>,
    /// Milliseconds since the report.
    pub age_ms: u64,
}

/// Velocity of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Velocity {
    /// Forward speed in metres per second; `null` if unknown.
    #[serde(serialize_with = "rounded")]
    pub x: Option<f64>,
    /// Clockwise yaw rate in radians per second; `null` if unknown.
    #[serde(serialize_with = "rounded")]
    pub yaw_rate: Option<f64>,
    /// Age of the sample in milliseconds, as for the pose.
    pub age_ms: u64,
}

/// A component of the vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Part {
    /// JAUS id.
    pub id: String,
    /// Role in the vehicle, for example `primitive_driver`.
    pub role: &'static str,
    /// Whether it offers Management. Sensors and stores have no state and no controller.
    pub managed: bool,
    /// Management state, for example `ready`.
    pub state: Option<&'static str>,
    /// JAUS id of the client in control.
    pub controller: Option<String>,
    /// Authority of that client.
    pub authority: Option<u8>,
    /// Whether this operator is in control.
    pub ours: bool,
    /// Why it is not under control although it should be.
    pub obstacle: Option<String>,
    /// State of its stage of the mission.
    pub stage: Option<Stage>,
}

/// A component of the vehicle that has disappeared or fallen silent.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Missing {
    /// JAUS id.
    pub id: String,
    /// Role in the vehicle, for example `primitive_driver`.
    pub role: &'static str,
    /// Display name, for example `Primitive Driver`.
    pub name: String,
    /// `gone` if discovery has lost it, `silent` if its reports have ceased.
    pub how: &'static str,
    /// Milliseconds since its last report.
    pub age_ms: Option<u64>,
}

/// State of a stage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Stage {
    /// State, for example `active`.
    pub state: &'static str,
    /// Progress in percent.
    pub progress: u8,
    /// Why it is blocked.
    pub reason: String,
}

/// Control state of the operator.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Default)]
pub struct Control {
    /// Whether control of the essential part is held: of the primitive driver, or of the planner
    /// while it drives.
    pub held: bool,
    /// Whether control is wanted.
    pub wanted: bool,
    /// Whether this station has resumed the vehicle, and keeps it ready. The vehicle may be ready
    /// without that, as another client has left it.
    pub resumed: bool,
    /// Name of the user who has the vehicle, or had it last. `null` unless this station has or wants
    /// control.
    pub user: Option<String>,
    /// Number of the page that has the vehicle. No other page can drive or release it.
    pub page: Option<u64>,
    /// Whether the planner drives for this station. The operator has to take over before driving.
    pub planner_drives: bool,
    /// Why control is not complete.
    pub reason: String,
    /// JAUS id of the operator whose control this station has requested.
    pub asking: Option<String>,
    /// The requests of other operators for the control that this station has.
    pub requests: Vec<HandoverRequest>,
    /// How control last changed hands or was refused; empty otherwise.
    pub handover: String,
}

/// Another operator's request for control.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HandoverRequest {
    /// JAUS id of the part of the vehicle that has passed it on.
    pub part: String,
    /// JAUS id of the operator.
    pub operator: String,
    /// Authority of the operator.
    pub authority: u8,
    /// Why, in the operator's words.
    pub explanation: String,
}

/// Manual drive.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Drive {
    /// Whether a page drives.
    pub active: bool,
    /// Forward, -1 to 1.
    pub forward: f64,
    /// Right, -1 to 1.
    pub turn: f64,
    /// Why the station refused or ended manual drive although the stick was not released; empty
    /// otherwise.
    pub reason: String,
}

/// The planner's mission.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mission {
    /// Mission number.
    pub mission: u32,
    /// Stage, for example `driving`.
    pub stage: &'static str,
    /// Current attempt.
    pub attempt: u8,
    /// Maximum number of attempts.
    pub attempts: u8,
    /// Progress in percent.
    pub progress: u8,
    /// Metres north and east.
    pub destination: [f64; 2],
    /// Remaining length of the path in metres.
    pub remaining_m: f64,
    /// Why it is blocked.
    pub reason: String,
    /// Points of the path, in metres north and east, at most 500.
    pub path: Vec<[f64; 2]>,
    /// Milliseconds since the report.
    pub age_ms: u64,
    /// The planner, if it was lost while it drove.
    pub lost: Option<LostPlanner>,
}

/// A planner that was lost while it drove.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LostPlanner {
    /// JAUS id.
    pub id: String,
    /// `gone`, `silent` or `restarted`, as for [`Missing`].
    pub how: &'static str,
    /// Whether this station has stopped the drivers, which requires that it controlled the planner.
    pub told_to_stop: bool,
}

/// Events of the station's vehicles.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Events {
    /// Number of the latest event; 0 if there is none.
    pub latest: u64,
    /// The events, oldest first.
    pub events: Vec<LoggedEvent>,
}

/// Something that happened to a vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LoggedEvent {
    /// Its number, counted from 1 since the station started.
    pub number: u64,
    /// Time of day, RFC 3339 in UTC.
    pub time: String,
    /// Milliseconds since it happened, whatever has happened to the clock.
    pub age_ms: u64,
    /// Subsystem number of the vehicle.
    pub vehicle: u16,
    /// What it concerns: `control`, `drive`, `mission`, `emergency`, `fault`, `missing`, `hold`,
    /// `setpoint`, or `log` for the log itself.
    pub kind: &'static str,
    /// How much it matters: `info`, `warn` or `bad`.
    pub level: &'static str,
    /// What happened.
    pub text: String,
}

/// A map of the vehicle's world model, without its cells, which have their own request.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Map {
    /// Map number.
    pub id: u16,
    /// Name.
    pub name: String,
    /// Number of cells along X.
    pub rows: u16,
    /// Number of cells along Y.
    pub columns: u16,
    /// Side length of a cell in metres.
    pub cell_m: f64,
    /// X of the south-west corner, in metres north.
    pub x: f64,
    /// Y of the south-west corner, in metres east.
    pub y: f64,
    /// Revision, raised by every change.
    pub revision: u32,
}

/// A map at a certain revision.
pub(crate) type Edition = (u16, u32);

impl Map {
    pub(crate) const fn edition(&self) -> Edition {
        (self.id, self.revision)
    }
}

/// Writes metres and radians to four decimals: finer ones are noise, by which a vehicle at rest would seem to move.
fn rounded<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    value
        .map(|it| (it * 1e4).round() / 1e4)
        .serialize(serializer)
}

/// Milliseconds since `then`.
pub(super) fn age(now: Instant, then: Instant) -> u64 {
    let age = now.saturating_duration_since(then).as_millis();
    u64::try_from(age).unwrap_or(u64::MAX)
}
