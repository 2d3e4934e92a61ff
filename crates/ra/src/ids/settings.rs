//! Settings of the id mapping, from code or (feature `serde`) from a file such as
//!
//! ```toml
//! [ids]
//! ra_offset = 1000                # RA subsystem 20 appears as JAUS subsystem 1020
//! jaus_offset = 0                 # JAUS subsystem 101 appears as RA subsystem 101
//! # Subsystems that need another number:
//! ra_subsystems = [{ ra = 20, jaus = 1200 }]
//! jaus_subsystems = [{ jaus = 4711, ra = 101 }]
//! # Components that need another id:
//! ra_components = [{ ra = "20.1.70.1", jaus = "1200.1.200" }]
//! jaus_components = [{ jaus = "4711.1.9", ra = "101.1.33.1" }]
//! ```
//!
//! All settings are optional: the rules of [`IdTable`](super::IdTable) cover the common cases.

use jaus::address::JausId;

use super::RaId;

/// Id mapping between RA and JAUS systems.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Settings {
    /// Added to the number of an RA subsystem to get its JAUS number.
    pub ra_offset: i32,
    /// Added to the number of a JAUS subsystem to get its RA number.
    pub jaus_offset: i32,
    /// RA subsystems with a JAUS number other than the offset gives.
    pub ra_subsystems: Vec<SubsystemEntry>,
    /// JAUS subsystems with an RA number other than the offset gives.
    pub jaus_subsystems: Vec<SubsystemEntry>,
    /// RA components with a JAUS number other than the rule gives.
    pub ra_components: Vec<ComponentEntry>,
    /// JAUS components with an RA instance other than the rule gives; the component number of `ra`
    /// is the type.
    pub jaus_components: Vec<ComponentEntry>,
}

/// The two numbers of a subsystem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SubsystemEntry {
    /// RA number, 1 to 254.
    pub ra: u8,
    /// JAUS number, 1 to 65534.
    pub jaus: u16,
}

/// The two ids of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComponentEntry {
    /// RA id, `20.1.70.1`.
    pub ra: RaId,
    /// JAUS id, `1020.1.200`.
    pub jaus: JausId,
}
