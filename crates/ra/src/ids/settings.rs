//! What is set about ids, from code or (feature `serde`) from a file such as
//!
//! ```toml
//! [ids]
//! ra_offset = 1000                # RA subsystem 20 appears as JAUS subsystem 1020
//! jaus_offset = 0                 # JAUS subsystem 101 appears as RA subsystem 101
//! # Subsystems that the offset does not suit:
//! ra_subsystems = [{ ra = 20, jaus = 1200 }]
//! jaus_subsystems = [{ jaus = 4711, ra = 101 }]
//! # Components that the rule does not suit:
//! ra_components = [{ ra = "20.1.70.1", jaus = "1200.1.200" }]
//! jaus_components = [{ jaus = "4711.1.9", ra = "101.1.33.1" }]
//! ```
//!
//! Nothing of this is needed: the rules of [`IdTable`](super::IdTable) cover what is common.

use jaus::address::JausId;

use super::RaId;

/// How ids are mapped between RA systems and ours.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Settings {
    /// Added to the number of an RA subsystem to get the number by which JAUS sees it.
    pub ra_offset: i32,
    /// Added to the number of a JAUS subsystem to get the number by which RA systems see it.
    pub jaus_offset: i32,
    /// RA subsystems that JAUS sees by other numbers than the offset gives.
    pub ra_subsystems: Vec<SubsystemEntry>,
    /// JAUS subsystems that RA systems see by other numbers than the offset gives.
    pub jaus_subsystems: Vec<SubsystemEntry>,
    /// RA components that JAUS sees by other numbers than the rule gives.
    pub ra_components: Vec<ComponentEntry>,
    /// JAUS components that RA systems see as other instances than the rule gives; the component
    /// number of `ra` names the type that is meant.
    pub jaus_components: Vec<ComponentEntry>,
}

/// Two numbers of one subsystem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SubsystemEntry {
    /// Its number among RA systems, 1 to 254.
    pub ra: u8,
    /// Its number among ours, 1 to 65534.
    pub jaus: u16,
}

/// Two ids of one component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComponentEntry {
    /// Its id among RA systems, `20.1.70.1`.
    pub ra: RaId,
    /// Its id among ours, `1020.1.200`.
    pub jaus: JausId,
}
