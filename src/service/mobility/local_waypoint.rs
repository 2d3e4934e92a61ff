//! A waypoint in the local frame, whatever message it came in.

use super::exchange::Exchange;
use super::place::{Kind, Place};
use super::wanted::Wanted;
use crate::codec::{Message, OutOfRange, ServiceId};
use crate::messages::mobility::report_local_waypoint as fields;
use crate::messages::mobility::report_local_waypoint_ext as ext;
use crate::messages::mobility::set_local_waypoint_ext::{ZPosition, ZPositionZLocal};
use crate::messages::mobility::{
    QueryLocalWaypoint, QueryLocalWaypointExt, ReportLocalWaypoint, ReportLocalWaypointExt,
    SetLocalWaypoint, SetLocalWaypointExt, local_waypoint_driver, local_waypoint_list_driver,
};
use crate::service::Handled;
use crate::vehicle::Waypoint;

/// A waypoint in the local frame: metres and radians.
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

impl From<SetLocalWaypoint> for Place {
    fn from(message: SetLocalWaypoint) -> Self {
        Self::Local(LocalWaypoint {
            x: message.x_m(),
            y: message.y_m(),
            z: message.z_m(),
            roll: message.roll_rad(),
            pitch: message.pitch_rad(),
            yaw: message.yaw_rad(),
            waypoint_tolerance: message.waypoint_tolerance_m(),
            path_tolerance: message.path_tolerance_m(),
        })
    }
}

impl From<SetLocalWaypointExt> for Place {
    fn from(message: SetLocalWaypointExt) -> Self {
        let z = match message.z_position {
            Some(ZPosition::ZLocal(z)) => Some(z.value()),
            // A ground vehicle has no choice of heights.
            _ => None,
        };
        Self::Local(LocalWaypoint {
            x: message.x_m(),
            y: message.y_m(),
            z,
            roll: message.roll_rad(),
            pitch: message.pitch_rad(),
            yaw: message.heading_rad(),
            waypoint_tolerance: message.waypoint_tolerance_m(),
            path_tolerance: message.path_tolerance_m(),
        })
    }
}

impl LocalWaypoint {
    /// What the vehicle is to drive to.
    pub(super) fn waypoint(&self) -> Waypoint {
        Waypoint {
            x: self.x,
            y: self.y,
            heading: self.yaw,
            tolerance: self.waypoint_tolerance.unwrap_or(Waypoint::TOLERANCE),
        }
    }

    fn report(&self, wanted: Wanted) -> Result<ReportLocalWaypoint, OutOfRange> {
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

    fn report_ext(&self, wanted: Wanted) -> Result<ReportLocalWaypointExt, OutOfRange> {
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

/// Waypoints in the local frame.
pub(super) struct Local;

impl Kind for Local {
    const DRIVER: ServiceId = local_waypoint_driver::V1_1;
    const LIST_DRIVER: ServiceId = local_waypoint_list_driver::V1_1;
    type Set = SetLocalWaypoint;
    type SetExt = SetLocalWaypointExt;

    fn handle_query(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        let Some(Place::Local(waypoint)) = exchange.cockpit.place() else {
            return Handled::No;
        };
        match code {
            QueryLocalWaypoint::CODE => {
                if let Some(query) = exchange.query::<QueryLocalWaypoint>() {
                    exchange.reply_if(waypoint.report(Wanted(query.presence_vector.into())));
                }
            }
            QueryLocalWaypointExt::CODE => {
                if let Some(query) = exchange.query::<QueryLocalWaypointExt>() {
                    exchange.reply_if(waypoint.report_ext(Wanted(query.presence_vector.into())));
                }
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }
}
