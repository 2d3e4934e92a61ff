//! Reports of vehicle parts, decoded from messages into SI units.

use super::georeference::Fix;
use super::state;
use jaus::address::JausId;
use jaus::messages::core::report_time::TimeStamp;
use jaus::messages::core::{ReportControl, ReportStatus};
use jaus::messages::mobility::{
    ReportGlobalPose, ReportLocalOperatingZone, ReportLocalPose, ReportVelocityState,
};
use jaus::service::{Age, SampleStamp};
use jaus_vehicle::ground::{StageState, reported_scan, reported_zones};
use jaus_vehicle::messages::environment_sensing::ReportRangeSensorData;
use jaus_vehicle::messages::ground::{
    ReportMission, ReportPlannedPath, ReportRasterMaps, ReportStage,
};
use jaus_vehicle::sensing::Scan;
use jaus_vehicle::zones::Zones;

/// A report of a part.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Report {
    /// Number of the Management state.
    Status(u8),
    /// The client in control, with its authority.
    Control(Option<(JausId, u8)>),
    Stage(state::Stage),
    Pose(state::Pose, Sampled),
    /// The position on the globe; `None` if it is unknown.
    GlobalPose(Option<Fix>),
    Velocity(state::Velocity, Sampled),
    Mission(Mission),
    Path(Vec<[f64; 2]>),
    Maps(Vec<state::Map>),
    /// The operating zones, or why they are unusable.
    Zones(Result<Zones, String>),
    /// What the range sensor sees; `None` if it does not measure.
    Scan(Option<Scan>),
    /// A subscription has lost or regained its reports.
    Subscription {
        is_up: bool,
    },
}

impl Report {
    /// The time of its sample, if the report is of a kind that has one.
    pub(super) const fn sampled(&mut self) -> Option<&mut Sampled> {
        match self {
            Self::Pose(_, sampled) | Self::Velocity(_, sampled) => Some(sampled),
            _ => None,
        }
    }
}

/// What is known of the time of a sample when its report arrives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sampled {
    stamp: Option<TimeStamp>,
    /// By the measured offset of the sender's clock.
    measured: Option<Age>,
}

impl Sampled {
    fn new(stamp: Option<u32>) -> Self {
        Self {
            stamp: stamp.map(TimeStamp),
            measured: None,
        }
    }

    /// Enters the age that `measured` gives for the stamp.
    pub(super) fn measure(&mut self, measured: impl FnOnce(TimeStamp) -> Option<Age>) {
        self.measured = self.stamp.and_then(measured);
    }

    /// `None` without a valid stamp.
    pub(super) fn stamp(&self) -> Option<SampleStamp> {
        SampleStamp::of_report(self.stamp?, self.measured)
    }
}

/// State of the planner's mission.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mission {
    pub(super) number: u32,
    pub(super) stage: MissionStage,
    attempt: u8,
    attempts: u8,
    progress: u8,
    destination: [f64; 2],
    remaining: f64,
    reason: String,
}

/// Mission stage, by its number in Report Mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct MissionStage(u8);

impl MissionStage {
    const NAMES: [&str; 12] = [
        "idle",
        "map",
        "planning",
        "awaiting_approval",
        "path",
        "vector",
        "primitive",
        "driving",
        "arrived",
        "failed",
        "stopped",
        "waiting",
    ];

    pub(super) fn name(self) -> &'static str {
        let name = Self::NAMES.get(usize::from(self.0));
        name.copied().unwrap_or("unknown")
    }

    /// Whether no mission was given since the planner started.
    pub(super) const fn is_idle(self) -> bool {
        self.0 == 0
    }

    pub(super) const fn awaits_approval(self) -> bool {
        self.0 == 3
    }

    /// Whether there is no mission: none was given, or it has ended.
    pub(super) const fn is_over(self) -> bool {
        matches!(self.0, 0 | 8..=10)
    }

    /// Whether the planner drives the vehicle or is about to.
    pub(super) const fn is_driven(self) -> bool {
        matches!(self.0, 4..=7)
    }
}

impl Mission {
    /// Why it is blocked or has ended; empty otherwise.
    pub(super) fn reason(&self) -> &str {
        &self.reason
    }

    /// Snapshot for pages, without the path.
    pub(super) fn state(&self) -> state::Mission {
        state::Mission {
            mission: self.number,
            stage: self.stage.name(),
            attempt: self.attempt,
            attempts: self.attempts,
            progress: self.progress,
            destination: self.destination,
            remaining_m: self.remaining,
            reason: self.reason.clone(),
            path: Vec::new(),
            age_ms: 0,
            lost: None,
        }
    }
}

impl From<ReportStatus> for Report {
    fn from(report: ReportStatus) -> Self {
        Self::Status(report.status.0)
    }
}

impl From<ReportControl> for Report {
    fn from(report: ReportControl) -> Self {
        let id = JausId::new(report.subsystem_id, report.node_id, report.component_id);
        Self::Control((id.to_u32() != 0).then_some((id, report.authority_code)))
    }
}

impl From<ReportStage> for Report {
    fn from(report: ReportStage) -> Self {
        Self::Stage(state::Stage {
            state: StageState::of(&report).map_or("unknown", StageState::name),
            progress: report.progress,
            reason: report.reason.to_string(),
        })
    }
}

impl From<ReportLocalPose> for Report {
    fn from(report: ReportLocalPose) -> Self {
        let pose = state::Pose {
            x: report.x_m(),
            y: report.y_m(),
            yaw: report.yaw_rad(),
            age_ms: 0,
        };
        Self::Pose(pose, Sampled::new(report.time_stamp.map(|it| it.0)))
    }
}

impl From<ReportGlobalPose> for Report {
    fn from(report: ReportGlobalPose) -> Self {
        Self::GlobalPose(Fix::of(&report))
    }
}

impl From<ReportVelocityState> for Report {
    fn from(report: ReportVelocityState) -> Self {
        let velocity = state::Velocity {
            x: report.velocity_x_m_per_s(),
            yaw_rate: report.yaw_rate_rad_per_s(),
            age_ms: 0,
        };
        Self::Velocity(velocity, Sampled::new(report.time_stamp.map(|it| it.0)))
    }
}

impl From<ReportMission> for Report {
    fn from(report: ReportMission) -> Self {
        Self::Mission(Mission {
            number: report.mission,
            stage: MissionStage(report.stage.0),
            attempt: report.attempt,
            attempts: report.attempts,
            progress: report.progress,
            destination: [report.destination_x, report.destination_y],
            remaining: f64::from(report.remaining),
            reason: report.reason.to_string(),
        })
    }
}

impl From<ReportLocalOperatingZone> for Report {
    fn from(report: ReportLocalOperatingZone) -> Self {
        Self::Zones(reported_zones(&report))
    }
}

impl From<ReportRangeSensorData> for Report {
    fn from(report: ReportRangeSensorData) -> Self {
        Self::Scan(reported_scan(&report).map(|(_, scan)| scan))
    }
}

/// Maximum number of path points in a snapshot.
const MOST_POINTS: usize = 500;

impl From<ReportPlannedPath> for Report {
    fn from(report: ReportPlannedPath) -> Self {
        let points = report.point_list;
        // Keep every n-th point, and always the last.
        let step = points.len().div_ceil(MOST_POINTS - 1).max(1);
        let mut thin: Vec<_> = points.iter().step_by(step).map(|it| [it.x, it.y]).collect();
        if let Some(last) = points
            .last()
            .filter(|_| !(points.len() - 1).is_multiple_of(step))
        {
            thin.push([last.x, last.y]);
        }
        Self::Path(thin)
    }
}

/// Maximum number of maps kept.
const MOST_MAPS: usize = 256;

impl From<ReportRasterMaps> for Report {
    fn from(report: ReportRasterMaps) -> Self {
        let maps = report.map_list.into_iter().take(MOST_MAPS);
        let maps = maps.map(|it| state::Map {
            id: it.map,
            name: it.name.to_string(),
            rows: it.rows,
            columns: it.columns,
            cell_m: f64::from(it.cell_size),
            x: it.x,
            y: it.y,
            revision: it.revision,
        });
        Self::Maps(maps.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jaus_vehicle::messages::ground::report_planned_path::PointRec;

    #[test]
    fn a_long_path_is_thinned_out_and_keeps_its_ends() {
        for count in [0, 1, 2, 499, 500, 501, 998, 999, 65_535] {
            let point = |x: u16| PointRec {
                x: x.into(),
                y: 0.0,
            };
            let report = ReportPlannedPath {
                point_list: (0..count).map(point).collect(),
                ..ReportPlannedPath::default()
            };
            let Report::Path(path) = report.into() else {
                panic!("not a path");
            };
            assert!(path.len() <= MOST_POINTS, "{count}: {}", path.len());
            let ends = (count > 0).then(|| ([0.0, 0.0], [f64::from(count - 1), 0.0]));
            let kept = path.first().copied().zip(path.last().copied());
            assert_eq!(kept, ends, "{count}");
        }
    }

    #[test]
    fn what_a_report_does_not_say_is_unknown_and_not_zero() {
        let pose = state::Pose {
            x: None,
            y: None,
            yaw: None,
            age_ms: 0,
        };
        assert_eq!(
            Report::from(ReportLocalPose::default()),
            Report::Pose(pose, Sampled::new(None))
        );
        let velocity = state::Velocity {
            x: None,
            yaw_rate: None,
            age_ms: 0,
        };
        assert_eq!(
            Report::from(ReportVelocityState::default()),
            Report::Velocity(velocity, Sampled::new(None))
        );
    }

    #[test]
    fn nobody_in_control_is_nobody() {
        let report = ReportControl::default();
        assert_eq!(Report::from(report), Report::Control(None));
    }
}
