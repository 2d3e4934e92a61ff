//! A waypoint on the globe, independent of the message version.

use crate::motion::{Frame, GlobalPose, Waypoint};
use jaus::codec::OutOfRange;
use jaus::messages::mobility::report_global_waypoint as fields;
use jaus::messages::mobility::report_global_waypoint_ext as ext;
use jaus::messages::mobility::set_global_waypoint_ext::{ZPosition, ZPositionAltitudeMsl};
use jaus::messages::mobility::{
    ReportGlobalWaypoint, ReportGlobalWaypointExt, SetGlobalWaypoint, SetGlobalWaypointExt,
};

/// A waypoint on the globe, in degrees, metres and radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GlobalWaypoint {
    latitude: f64,
    longitude: f64,
    altitude: Option<f64>,
    roll: Option<f64>,
    pitch: Option<f64>,
    yaw: Option<f64>,
    waypoint_tolerance: Option<f64>,
    path_tolerance: Option<f64>,
}

impl From<SetGlobalWaypoint> for GlobalWaypoint {
    fn from(message: SetGlobalWaypoint) -> Self {
        Self {
            latitude: message.latitude_deg(),
            longitude: message.longitude_deg(),
            altitude: message.altitude_m(),
            roll: message.roll_rad(),
            pitch: message.pitch_rad(),
            yaw: message.yaw_rad(),
            waypoint_tolerance: message.waypoint_tolerance_m(),
            path_tolerance: message.path_tolerance_m(),
        }
    }
}

impl From<SetGlobalWaypointExt> for GlobalWaypoint {
    fn from(message: SetGlobalWaypointExt) -> Self {
        let altitude = match message.z_position {
            Some(ZPosition::AltitudeMsl(altitude)) => Some(altitude.value()),
            // A ground vehicle cannot choose its height.
            _ => None,
        };
        Self {
            latitude: message.latitude_deg(),
            longitude: message.longitude_deg(),
            altitude,
            roll: message.roll_rad(),
            pitch: message.pitch_rad(),
            yaw: message.heading_rad(),
            waypoint_tolerance: message.waypoint_tolerance_m(),
            path_tolerance: message.path_tolerance_m(),
        }
    }
}

impl GlobalWaypoint {
    /// The waypoint in the local frame, for the pilot.
    pub(super) fn waypoint(&self, frame: &Frame) -> Waypoint {
        let place = frame.to_local(&GlobalPose {
            latitude: self.latitude,
            longitude: self.longitude,
            yaw: self.yaw.unwrap_or_default(),
            ..GlobalPose::default()
        });
        Waypoint {
            x: place.x,
            y: place.y,
            heading: self.yaw.map(|_| place.yaw),
            tolerance: self.waypoint_tolerance.unwrap_or(Waypoint::TOLERANCE),
        }
    }

    /// The report of version 1.0.
    pub(super) fn report(&self) -> Result<ReportGlobalWaypoint, OutOfRange> {
        let tolerance = fields::WaypointTolerance::new;
        Ok(ReportGlobalWaypoint {
            latitude: fields::Latitude::new(self.latitude)?,
            longitude: fields::Longitude::new(self.longitude)?,
            altitude: self.altitude.and_then(|it| fields::Altitude::new(it).ok()),
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
    pub(super) fn report_ext(&self) -> Result<ReportGlobalWaypointExt, OutOfRange> {
        let tolerance = ext::WaypointTolerance::new;
        let altitude = self
            .altitude
            .and_then(|it| ZPositionAltitudeMsl::new(it).ok());
        Ok(ReportGlobalWaypointExt {
            latitude: ext::Latitude::new(self.latitude)?,
            longitude: ext::Longitude::new(self.longitude)?,
            z_position: altitude.map(ZPosition::AltitudeMsl),
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
