//! What can be wrong with ids: in the settings, when one is looked up, when two sides meet.

use std::fmt;
use std::ops::RangeInclusive;

use super::RaId;
use jaus::address::JausId;

/// One of the two kinds of systems.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// Systems of the Reference Architecture.
    Ra,
    /// Systems of the SAE standards, as we are.
    Jaus,
}

impl Side {
    /// The side across.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Ra => Self::Jaus,
            Self::Jaus => Self::Ra,
        }
    }

    /// The numbers that a subsystem can have.
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

/// Settings that make no table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidIds {
    /// A number that no subsystem can have.
    #[error(
        "{side} subsystem {number} in {} cannot be: choose from {} to {}",
        home.entries(), side.subsystems().start(), side.subsystems().end()
    )]
    Subsystem {
        /// Whose entry it is.
        home: Side,
        /// Whose number it is.
        side: Side,
        /// The number.
        number: u16,
    },
    /// Two entries for one subsystem, or with one number.
    #[error("{side} subsystem {number} is twice in {}: leave one entry out, or give it another number", home.entries())]
    SubsystemTwice {
        /// Whose entries they are.
        home: Side,
        /// Whose number it is.
        side: Side,
        /// The number.
        number: u16,
    },
    /// An offset that leaves no subsystem with a number.
    #[error(
        "{} {offset} gives no {home} subsystem a number from {} to {}: choose a smaller one, or leave it out",
        home.offset(), home.other().subsystems().start(), home.other().subsystems().end()
    )]
    Offset {
        /// Whose offset it is.
        home: Side,
        /// The offset.
        offset: i32,
    },
    /// An id with 0 or with a number that stands for all.
    #[error("{ra} = {jaus} in {} cannot be: an entry names one component, with no field that is 0 or stands for all", home.components())]
    NotUnicast {
        /// Whose entry it is.
        home: Side,
        /// The RA id of the entry.
        ra: RaId,
        /// The JAUS id of the entry.
        jaus: JausId,
    },
    /// An entry for a component that leads out of its node.
    #[error(
        "{ra} = {jaus} in {} cannot be, for a component stays in its node: {expected}",
        home.components()
    )]
    LeavesNode {
        /// Whose entry it is.
        home: Side,
        /// The RA id of the entry.
        ra: RaId,
        /// The JAUS id of the entry.
        jaus: JausId,
        /// What to do.
        expected: String,
    },
    /// An entry for the node manager or the communicator, which stand for the node itself.
    #[error(
        "{0} in jaus_components cannot be: components 1 (node manager) and 35 (communicator) stand for \
         the node itself; name the type of a service, such as 33"
    )]
    Reserved(RaId),
    /// Two entries for one component.
    #[error("{ra} = {jaus} in {} names an id that another entry has: leave one out", home.components())]
    ComponentTwice {
        /// Whose entry it is.
        home: Side,
        /// The RA id of the later entry.
        ra: RaId,
        /// The JAUS id of the later entry.
        jaus: JausId,
    },
}

/// Why an id has no counterpart on the other side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unmapped {
    /// A field is 0 or stands for all.
    #[error("the id does not name one component")]
    NotUnicast,
    /// The subsystem's number is out of what the other side has.
    #[error("{side} subsystem {number} has no number on the other side: give it one in {} (or choose another {})", side.entries(), side.offset())]
    Subsystem {
        /// Whose subsystem.
        side: Side,
        /// Its number.
        number: u16,
    },
    /// Another subsystem has got the number by an entry.
    #[error("{side} subsystem {number} would get the number that {} gives to {by}: add an entry for it", side.entries())]
    SubsystemTaken {
        /// Whose subsystem.
        side: Side,
        /// Its number.
        number: u16,
        /// The subsystem of the entry.
        by: u16,
    },
    /// A component or instance for which there is no rule.
    #[error(
        "RA component {0} is out of what the rule covers (components 1 to 63, instances 1 to 3): give it a number in ra_components, best 64, 128 or 192 to 254"
    )]
    Component(RaId),
    /// Another component has got the number by an entry.
    #[error("another component of the node got that number in {}: add an entry for this one", .0.components())]
    ComponentTaken(Side),
    /// The node manager and the communicator stand for the node itself.
    #[error("components 1 and 35 stand for the node itself")]
    Reserved,
}

/// Two subsystems that would have the same number on one side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{home} subsystem {number} cannot be shown: there is a {} subsystem {shown_as} already; choose a {} that keeps \
     them apart, or add an entry to {}",
    home.other(), home.offset(), home.entries()
)]
pub struct Collision {
    /// The side of the subsystem that cannot be shown on the other.
    pub home: Side,
    /// Its number there.
    pub number: u16,
    /// The number that it would have on the other side.
    pub shown_as: u16,
}
