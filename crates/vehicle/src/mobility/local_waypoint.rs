//! A waypoint in the local frame, independent of the message version.

use super::wanted::Wanted;
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
    pub(super) fn report(&self, wanted: Wanted) -> Result<ReportLocalWaypoint, OutOfRange> {
        let tolerance = fields::WaypointTolerance::new;
        Ok(ReportLocalWaypoint {
            x: fields::X::new(self.x)?,
            y: fields::Y::new(self.y)?,
            z: wanted.optional(0, self.z, fields::Z::new),
            roll: wanted.optional(1, self.roll, fields::Roll::new),
            pitch: wanted.optional(2, self.pitch, fields::Pitch::new),
            yaw: wanted.optional(3, self.yaw, fields::Yaw::new),
            waypoint_tolerance: wanted.optional(4, self.waypoint_tolerance, tolerance),
            path_tolerance: wanted.optional(5, self.path_tolerance, fields::PathTolerance::new),
        })
    }

    /// The report of version 1.1.
    pub(super) fn report_ext(&self, wanted: Wanted) -> Result<ReportLocalWaypointExt, OutOfRange> {
        let tolerance = ext::WaypointTolerance::new;
        let z = wanted.optional(0, self.z, ZPositionZLocal::new);
        Ok(ReportLocalWaypointExt {
            x: ext::X::new(self.x)?,
            y: ext::Y::new(self.y)?,
            z_position: z.map(ZPosition::ZLocal),
            roll: wanted.optional(1, self.roll, ext::Roll::new),
            pitch: wanted.optional(2, self.pitch, ext::Pitch::new),
            heading: wanted.optional(3, self.yaw, ext::Heading::new),
            waypoint_tolerance: wanted.optional(4, self.waypoint_tolerance, tolerance),
            path_tolerance: wanted.optional(5, self.path_tolerance, ext::PathTolerance::new),
        })
    }
}
