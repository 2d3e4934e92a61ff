//! Wrench effort, 0405h 2405h 4405h: six propulsive and six resistive efforts in percent. Fields,
//! ranges and presence vectors agree; only the integers on the wire differ.

use super::carry::{same_fields, same_presence};
use super::pair::Pair;
use crate::messages::ra33;
use jaus::messages::mobility;

pub(super) const PAIRS: &[Pair] = &[
    Pair::of::<ra33::SetWrenchEffort, mobility::SetWrenchEffort>(),
    Pair::of::<ra33::QueryWrenchEffort, mobility::QueryWrenchEffort>(),
    Pair::of::<ra33::ReportWrenchEffort, mobility::ReportWrenchEffort>(),
];

same_fields! {
    ra33::SetWrenchEffort, mobility::SetWrenchEffort {
        propulsive_linear_effort_x, propulsive_linear_effort_y, propulsive_linear_effort_z,
        propulsive_rotational_effort_x, propulsive_rotational_effort_y,
        propulsive_rotational_effort_z,
        resistive_linear_effort_x, resistive_linear_effort_y, resistive_linear_effort_z,
        resistive_rotational_effort_x, resistive_rotational_effort_y,
        resistive_rotational_effort_z,
    }
    ra33::ReportWrenchEffort, mobility::ReportWrenchEffort {
        propulsive_linear_effort_x, propulsive_linear_effort_y, propulsive_linear_effort_z,
        propulsive_rotational_effort_x, propulsive_rotational_effort_y,
        propulsive_rotational_effort_z,
        resistive_linear_effort_x, resistive_linear_effort_y, resistive_linear_effort_z,
        resistive_rotational_effort_x, resistive_rotational_effort_y,
        resistive_rotational_effort_z,
    }
}

same_presence! {
    ra33::QueryWrenchEffort, mobility::QueryWrenchEffort: 12 fields;
}
