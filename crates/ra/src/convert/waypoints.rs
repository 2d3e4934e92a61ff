//! Waypoints and travel speed: 040Ah 040Ch 040Dh, 240Ah to 240Dh, 440Ah to 440Dh.
//!
//! An RA waypoint driver keeps a list of numbered waypoints; ours drives to one waypoint. Number 0,
//! the first one of RA peers, corresponds to ours, and others are refused: as a new goal each of
//! them would skip its predecessors.
//!
//! Ours may specify a tolerance of the waypoint and a limit of the path deviation. A commanded
//! limit of the path is refused, as the vehicle would not keep it; the tolerance of the waypoint is
//! left out, as the driver has its own. In reports both are left out.

use super::carry::{Carry, Counterpart, same_fields};
use super::pair::Pair;
use super::{Context, Refusal};
use crate::messages::ra33;
use jaus::messages::mobility;

pub(super) const PAIRS: &[Pair] = &[
    Pair::of::<ra33::SetTravelSpeed, mobility::SetTravelSpeed>(),
    Pair::of::<ra33::QueryTravelSpeed, mobility::QueryTravelSpeed>(),
    Pair::of::<ra33::ReportTravelSpeed, mobility::ReportTravelSpeed>(),
    Pair::of::<ra33::SetGlobalWaypoint, mobility::SetGlobalWaypoint>(),
    Pair::of::<ra33::QueryGlobalWaypoint, mobility::QueryGlobalWaypoint>(),
    Pair::of::<ra33::ReportGlobalWaypoint, mobility::ReportGlobalWaypoint>(),
    Pair::of::<ra33::SetLocalWaypoint, mobility::SetLocalWaypoint>(),
    Pair::of::<ra33::QueryLocalWaypoint, mobility::QueryLocalWaypoint>(),
    Pair::of::<ra33::ReportLocalWaypoint, mobility::ReportLocalWaypoint>(),
];

same_fields! {
    ra33::SetTravelSpeed, mobility::SetTravelSpeed { speed }
    ra33::QueryTravelSpeed, mobility::QueryTravelSpeed {}
    ra33::ReportTravelSpeed, mobility::ReportTravelSpeed { speed }
}

/// Number of the only element of a driver without a list.
pub(super) const ONLY: u16 = 0;

/// Refuses every number except that of the only element.
pub(super) fn only(number: u16, field: &'static str) -> Result<(), Refusal> {
    match number {
        ONLY => Ok(()),
        _ => Err(Refusal::UnknownValue {
            field,
            value: number.into(),
        }),
    }
}

/// Refuses a limit of the path, unless it is 0, which means none.
pub(super) fn unlimited(metres: Option<f64>) -> Result<(), Refusal> {
    match metres {
        Some(metres) if metres != 0.0 => Err(Refusal::Inexpressible {
            field: "PathTolerance",
        }),
        _ => Ok(()),
    }
}

/// Waypoints. Fields without counterpart are refused in a command and left out in a report; a
/// reported waypoint of any number is the current goal.
macro_rules! waypoints {
    ($($ra:path, $jaus:path { $($theirs:ident = $ours:ident),* }, $is_command:expr;)*) => {$(
        impl Counterpart<$jaus> for $ra {
            fn counterpart(self, _: Context<'_>) -> Result<$jaus, Refusal> {
                type There = $jaus;
                if $is_command {
                    only(self.waypoint_number, "WaypointNumber")?;
                }
                Ok(There {
                    $($ours: self.$theirs.carry()?,)*
                    roll: self.roll.carry()?,
                    pitch: self.pitch.carry()?,
                    yaw: self.yaw.carry()?,
                    waypoint_tolerance: None,
                    path_tolerance: None,
                })
            }
        }

        impl Counterpart<$ra> for $jaus {
            fn counterpart(self, _: Context<'_>) -> Result<$ra, Refusal> {
                type There = $ra;
                if $is_command {
                    unlimited(self.path_tolerance_m())?;
                }
                Ok(There {
                    waypoint_number: ONLY,
                    $($theirs: self.$ours.carry()?,)*
                    roll: self.roll.carry()?,
                    pitch: self.pitch.carry()?,
                    yaw: self.yaw.carry()?,
                })
            }
        }
    )*};
}

waypoints! {
    ra33::SetGlobalWaypoint, mobility::SetGlobalWaypoint {
        latitude = latitude, longitude = longitude, elevation = altitude
    }, true;
    ra33::ReportGlobalWaypoint, mobility::ReportGlobalWaypoint {
        latitude = latitude, longitude = longitude, elevation = altitude
    }, false;
    ra33::SetLocalWaypoint, mobility::SetLocalWaypoint { x = x, y = y, z = z }, true;
    ra33::ReportLocalWaypoint, mobility::ReportLocalWaypoint { x = x, y = y, z = z }, false;
}

/// Height, roll, pitch, yaw: optional fields of both sides.
const COMMON: u8 = 0b1111;

macro_rules! queries {
    ($($ra:path, $jaus:path;)*) => {$(
        impl Counterpart<$jaus> for $ra {
            fn counterpart(self, _: Context<'_>) -> Result<$jaus, Refusal> {
                type There = $jaus;
                only(self.waypoint_number, "WaypointNumber")?;
                Ok(There { presence_vector: COMMON })
            }
        }

        impl Counterpart<$ra> for $jaus {
            fn counterpart(self, _: Context<'_>) -> Result<$ra, Refusal> {
                type There = $ra;
                Ok(There { waypoint_number: ONLY })
            }
        }
    )*};
}

queries! {
    ra33::QueryGlobalWaypoint, mobility::QueryGlobalWaypoint;
    ra33::QueryLocalWaypoint, mobility::QueryLocalWaypoint;
}
