//! Pose and velocity, 2402h to 2404h and 4402h to 4404h: global pose, local pose, velocity state.
//!
//! Presence vectors agree bit by bit, and so do frames and signs: latitude and longitude in WGS 84,
//! angles about the axes forward, right and down, yaw clockwise from north or from the local X
//! axis. The ranges differ. The Reference Architecture cannot represent a local Z below -10 km or
//! above 35 km, a speed above 65.534 m/s or a rate above 32.767 rad/s; such a message is refused.

use super::carry::{same_bits, same_fields, same_presence};
use super::pair::Pair;
use crate::messages::ra33;
use jaus::messages::mobility;

pub(super) const PAIRS: &[Pair] = &[
    Pair::of::<ra33::QueryGlobalPose, mobility::QueryGlobalPose>(),
    Pair::of::<ra33::ReportGlobalPose, mobility::ReportGlobalPose>(),
    Pair::of::<ra33::QueryLocalPose, mobility::QueryLocalPose>(),
    Pair::of::<ra33::ReportLocalPose, mobility::ReportLocalPose>(),
    Pair::of::<ra33::QueryVelocityState, mobility::QueryVelocityState>(),
    Pair::of::<ra33::ReportVelocityState, mobility::ReportVelocityState>(),
];

same_fields! {
    ra33::ReportGlobalPose, mobility::ReportGlobalPose {
        latitude, longitude, position_rms, roll, pitch, yaw, attitude_rms, time_stamp;
        elevation = altitude,
    }
    ra33::ReportLocalPose, mobility::ReportLocalPose {
        x, y, z, position_rms, roll, pitch, yaw, attitude_rms, time_stamp,
    }
    ra33::ReportVelocityState, mobility::ReportVelocityState {
        velocity_x, velocity_y, velocity_z, velocity_rms,
        roll_rate, pitch_rate, yaw_rate, rate_rms, time_stamp,
    }
}

same_bits! {
    ra33::report_global_pose::TimeStamp, mobility::report_global_pose::TimeStamp;
}

same_presence! {
    ra33::QueryGlobalPose, mobility::QueryGlobalPose: 9 fields;
    ra33::QueryLocalPose, mobility::QueryLocalPose: 9 fields;
    ra33::QueryVelocityState, mobility::QueryVelocityState: 9 fields;
}
