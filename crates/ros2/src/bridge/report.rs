//! What the bridge's subscriptions deliver.

use bytes::Bytes;
use jaus::address::JausId;
use jaus::messages::core::{ReportControl, ReportStatus};
use jaus::messages::mobility::{ReportGlobalPose, ReportLocalPose, ReportVelocityState};
use jaus_vehicle::messages::ground::ReportMission;
use jaus_vehicle::messages::ground::report_mission::Stage;

use super::definition::Definition;
use super::goal::{Mission, MissionEnd};
use super::vehicle::Controller;

/// A report of a component.
#[derive(Debug, Clone)]
pub(super) enum Report {
    /// The code of its state.
    Status(u8),
    Control(Controller),
    Mission(Mission),
    LocalPose(Box<ReportLocalPose>),
    GlobalPose(Box<ReportGlobalPose>),
    Velocity(Box<ReportVelocityState>),
    /// Any report, from its message code.
    Undecoded {
        definition: Definition,
        octets: Bytes,
    },
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

impl From<ReportMission> for Report {
    fn from(report: ReportMission) -> Self {
        let end = match report.stage {
            Stage::ARRIVED => Some(MissionEnd::Arrived),
            // ROS has no way to continue a mission that a fault has stopped: a new goal replaces it.
            Stage::FAILED | Stage::STOPPED | Stage::IDLE | Stage::WAITING => {
                Some(MissionEnd::Failed(report.reason.to_string()))
            }
            _ => None,
        };
        let number = report.mission;
        Self::Mission(Mission { number, end })
    }
}

impl From<ReportLocalPose> for Report {
    fn from(report: ReportLocalPose) -> Self {
        Self::LocalPose(Box::new(report))
    }
}

impl From<ReportGlobalPose> for Report {
    fn from(report: ReportGlobalPose) -> Self {
        Self::GlobalPose(Box::new(report))
    }
}

impl From<ReportVelocityState> for Report {
    fn from(report: ReportVelocityState) -> Self {
        Self::Velocity(Box::new(report))
    }
}
