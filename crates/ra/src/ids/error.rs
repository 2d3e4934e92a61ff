//! Errors of the id mapping: invalid settings, unmapped ids, collisions.

use std::fmt;
use std::ops::RangeInclusive;

use super::RaId;
use jaus::address::JausId;

/// One of the two kinds of systems.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// Systems of the Reference Architecture.
    Ra,
    /// Systems of the SAE standards, such as ours.
    Jaus,
}

impl Side {
    /// The opposite side.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Ra => Self::Jaus,
            Self::Jaus => Self::Ra,
        }
    }

    /// The valid subsystem numbers.
    pub(super) const fn subsystems(self) -> RangeInclusive<u16> {
        match self {
            Self::Ra => 1..=254,
            Self::Jaus => 1..=JausId::ANY_SUBSYSTEM - 1,
        }
    }

    const fn offset(self) -> &'static str {
        match self {
            Self::Ra => "ra_offset",
            Self::Jaus => "jaus_offset",
        }
    }

    const fn entries(self) -> &'static str {
        match self {
            Self::Ra => "ra_subsystems",
            Self::Jaus => "jaus_subsystems",
        }
    }

    const fn components(self) -> &'static str {
        match self {
            Self::Ra => "ra_components",
            Self::Jaus => "jaus_components",
        }
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Ra => "RA",
            Self::Jaus => "JAUS",
        })
    }
}

/// Invalid id settings.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidIds {
    /// An invalid subsystem number.
    #[error(
        "{side} subsystem {number} in {} is out of range: choose from {} to {}",
        home.entries(), side.subsystems().start(), side.subsystems().end()
    )]
    Subsystem {
        /// Side of the entry.
        home: Side,
        /// Side of the number.
        side: Side,
        /// The number.
        number: u16,
    },
    /// Two entries for one subsystem, or with one number.
    #[error("{side} subsystem {number} appears twice in {}: remove one entry, or give it another \
        number", home.entries())]
    SubsystemTwice {
        /// Side of the entries.
        home: Side,
        /// Side of the number.
        side: Side,
        /// The number.
        number: u16,
    },
    /// An offset that leaves no subsystem with a valid number.
    #[error(
        "{} {offset} maps no {home} subsystem to a number from {} to {}: choose a smaller one, or \
         remove it",
        home.offset(), home.other().subsystems().start(), home.other().subsystems().end()
    )]
    Offset {
        /// Side of the offset.
        home: Side,
        /// The offset.
        offset: i32,
    },
    /// An id with 0 or with a wildcard number.
    #[error("{ra} = {jaus} in {} is invalid: an entry names one component, without zeros or \
        wildcards", home.components())]
    NotUnicast {
        /// Side of the entry.
        home: Side,
        /// The RA id of the entry.
        ra: RaId,
        /// The JAUS id of the entry.
        jaus: JausId,
    },
    /// An entry that moves a component to another node.
    #[error(
        "{ra} = {jaus} in {} is invalid, because a component stays in its node: {expected}",
        home.components()
    )]
    LeavesNode {
        /// Side of the entry.
        home: Side,
        /// The RA id of the entry.
        ra: RaId,
        /// The JAUS id of the entry.
        jaus: JausId,
        /// The remedy.
        expected: String,
    },
    /// An entry for the node manager or the communicator, which represent the node itself.
    #[error(
        "{0} in jaus_components is invalid: components 1 (node manager) and 35 (communicator) \
         represent the node itself; name the type of a service, such as 33"
    )]
    Reserved(RaId),
    /// Two entries for one component.
    #[error("{ra} = {jaus} in {} repeats an id of another entry: remove one", home.components())]
    ComponentTwice {
        /// Side of the entry.
        home: Side,
        /// The RA id of the later entry.
        ra: RaId,
        /// The JAUS id of the later entry.
        jaus: JausId,
    },
}

/// Reason why an id has no counterpart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unmapped {
    /// A field is 0 or a wildcard.
    #[error("the id does not name a single component")]
    NotUnicast,
    /// The other side has no such subsystem number.
    #[error("{side} subsystem {number} has no number on the other side: assign one in {} (or \
        choose another {})", side.entries(), side.offset())]
    Subsystem {
        /// Side of the subsystem.
        side: Side,
        /// Its number.
        number: u16,
    },
    /// An entry assigns the number to another subsystem.
    #[error("{side} subsystem {number} would get the number that {} assigns to {by}: add an entry \
        for it", side.entries())]
    SubsystemTaken {
        /// Side of the subsystem.
        side: Side,
        /// Its number.
        number: u16,
        /// The subsystem of the entry.
        by: u16,
    },
    /// A component or instance outside the default rule.
    #[error(
        "RA component {0} is outside the default mapping (components 1 to 63, instances 1 to 3): \
         assign a number in ra_components, preferably 64, 128 or 192 to 254"
    )]
    Component(RaId),
    /// An entry assigns the number to another component.
    #[error("another component of the node has that number in {}: add an entry for this one", .0.components())]
    ComponentTaken(Side),
    /// The node manager and the communicator represent the node itself.
    #[error("components 1 and 35 represent the node itself")]
    Reserved,
}

/// Two subsystems with the same number on one side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "cannot expose {home} subsystem {number}: there is a {} subsystem {shown_as} already; choose \
     a {} that separates them, or add an entry to {}",
    home.other(), home.offset(), home.entries()
)]
pub struct Collision {
    /// Side of the subsystem that cannot be shown on the other.
    pub home: Side,
    /// Its number there.
    pub number: u16,
    /// The number that it would have on the other side.
    pub shown_as: u16,
}
