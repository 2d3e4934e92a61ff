//! Waypoints and the speed of travel: 040Ah 040Ch 040Dh, 240Ah to 240Dh, 440Ah to 440Dh.
//!
//! A waypoint driver of the Reference Architecture keeps a list, in which each waypoint has a number;
//! ours drives to one waypoint. So the one with the number 0, as peers count, corresponds to ours,
//! and others are refused: to take each for a new goal would skip those before it.
//!
//! Ours may say how near is near enough and how far off the path is too far. A commanded limit of
//! the path is refused, for the vehicle would not keep it; the tolerance of the waypoint is left out,
//! for the driver has one of its own. In reports both are left out.

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

/// The number of the only element that a driver without a list has.
pub(super) const ONLY: u16 = 0;

/// Refuses all numbers but that of the only element.
pub(super) fn only(number: u16, field: &'static str) -> Result<(), Refusal> {
    match number {
        ONLY => Ok(()),
        _ => Err(Refusal::UnknownValue {
            field,
            value: number.into(),
        }),
    }
}

/// Refuses a limit of the path, unless it is 0, which sets none.
pub(super) fn unlimited(metres: Option<f64>) -> Result<(), Refusal> {
    match metres {
        Some(metres) if metres != 0.0 => Err(Refusal::Inexpressible {
            field: "PathTolerance",
        }),
        _ => Ok(()),
    }
}

/// Waypoints. In a command, what cannot be said is refused; in a report it is left out, and whichever
/// number it has, it is the one being driven to.
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

/// Height, roll, pitch, yaw: the fields that both sides have and that need not be there.
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
