//! A waypoint in the local frame, independent of the message version.

use crate::motion::Waypoint;
use jaus::codec::OutOfRange;
use jaus::messages::mobility::report_local_waypoint as fields;
use jaus::messages::mobility::report_local_waypoint_ext as ext;
use jaus::messages::mobility::set_local_waypoint_ext::{ZPosition, ZPositionZLocal};
use jaus::messages::mobility::{
    ReportLocalWaypoint, ReportLocalWaypointExt, SetLocalWaypoint, SetLocalWaypointExt,
};

/// A waypoint in the local frame, in metres and radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LocalWaypoint {
    x: f64,
    y: f64,
    z: Option<f64>,
    roll: Option<f64>,
    pitch: Option<f64>,
    yaw: Option<f64>,
    waypoint_tolerance: Option<f64>,
    path_tolerance: Option<f64>,
}

impl From<SetLocalWaypoint> for LocalWaypoint {
    fn from(message: SetLocalWaypoint) -> Self {
        Self {
            x: message.x_m(),
            y: message.y_m(),
            z: message.z_m(),
            roll: message.roll_rad(),
            pitch: message.pitch_rad(),
            yaw: message.yaw_rad(),
            waypoint_tolerance: message.waypoint_tolerance_m(),
            path_tolerance: message.path_tolerance_m(),
        }
    }
}

impl From<SetLocalWaypointExt> for LocalWaypoint {
    fn from(message: SetLocalWaypointExt) -> Self {
        let z = match message.z_position {
            Some(ZPosition::ZLocal(z)) => Some(z.value()),
            // A ground vehicle cannot choose its height.
            _ => None,
        };
        Self {
            x: message.x_m(),
            y: message.y_m(),
            z,
            roll: message.roll_rad(),
            pitch: message.pitch_rad(),
            yaw: message.heading_rad(),
            waypoint_tolerance: message.waypoint_tolerance_m(),
            path_tolerance: message.path_tolerance_m(),
        }
    }
}

impl LocalWaypoint {
    /// The waypoint for the pilot.
    pub(super) fn waypoint(&self) -> Waypoint {
        Waypoint {
            x: self.x,
            y: self.y,
            heading: self.yaw,
            tolerance: self.waypoint_tolerance.unwrap_or(Waypoint::TOLERANCE),
        }
    }

    /// The report of version 1.0.
    pub(super) fn report(&self) -> Result<ReportLocalWaypoint, OutOfRange> {
        let tolerance = fields::WaypointTolerance::new;
        Ok(ReportLocalWaypoint {
            x: fields::X::new(self.x)?,
            y: fields::Y::new(self.y)?,
            z: self.z.and_then(|it| fields::Z::new(it).ok()),
            roll: self.roll.and_then(|it| fields::Roll::new(it).ok()),
            pitch: self.pitch.and_then(|it| fields::Pitch::new(it).ok()),
            yaw: self.yaw.and_then(|it| fields::Yaw::new(it).ok()),
            waypoint_tolerance: self.waypoint_tolerance.and_then(|it| tolerance(it).ok()),
            path_tolerance: self
                .path_tolerance
                .and_then(|it| fields::PathTolerance::new(it).ok()),
        })
    }

    /// The report of version 1.1.
    pub(super) fn report_ext(&self) -> Result<ReportLocalWaypointExt, OutOfRange> {
        let tolerance = ext::WaypointTolerance::new;
        let z = self.z.and_then(|it| ZPositionZLocal::new(it).ok());
        Ok(ReportLocalWaypointExt {
            x: ext::X::new(self.x)?,
            y: ext::Y::new(self.y)?,
            z_position: z.map(ZPosition::ZLocal),
            roll: self.roll.and_then(|it| ext::Roll::new(it).ok()),
            pitch: self.pitch.and_then(|it| ext::Pitch::new(it).ok()),
            heading: self.yaw.and_then(|it| ext::Heading::new(it).ok()),
            waypoint_tolerance: self.waypoint_tolerance.and_then(|it| tolerance(it).ok()),
            path_tolerance: self
                .path_tolerance
                .and_then(|it| ext::PathTolerance::new(it).ok()),
        })
    }
}
