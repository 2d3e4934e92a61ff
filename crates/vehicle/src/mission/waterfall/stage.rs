//! The stages of a mission, and what a stage of the chain of drivers says of itself.

use std::fmt;

/// How far a mission is. The numbers are those of Report Mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Stage {
    /// There is none yet.
    #[default]
    Idle = 0,
    /// The map is fetched, or an attempt waits for its beginning.
    Map = 1,
    /// A path is looked for.
    Planning = 2,
    /// There is a path; the operator has to approve it.
    AwaitingApproval = 3,
    /// The path goes to the path segment driver.
    Path = 4,
    /// The path segment driver has succeeded; the vector driver is to obey it.
    Vector = 5,
    /// The vector driver has succeeded; the primitive driver is to obey it.
    Primitive = 6,
    /// The vehicle drives.
    Driving = 7,
    /// The vehicle is where it was to be.
    Arrived = 8,
    /// It was given up.
    Failed = 9,
    /// It was ended by the operator, or in an emergency.
    Stopped = 10,
}

impl Stage {
    /// Whether something is still to happen.
    #[must_use]
    pub const fn is_under_way(self) -> bool {
        !matches!(
            self,
            Self::Idle | Self::Arrived | Self::Failed | Self::Stopped
        )
    }

    /// Whether the drivers have something to do with it.
    #[must_use]
    pub const fn is_handed_over(self) -> bool {
        matches!(
            self,
            Self::Path | Self::Vector | Self::Primitive | Self::Driving
        )
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Idle => "idle",
            Self::Map => "map",
            Self::Planning => "planning",
            Self::AwaitingApproval => "awaiting approval",
            Self::Path => "path",
            Self::Vector => "vector",
            Self::Primitive => "primitive",
            Self::Driving => "driving",
            Self::Arrived => "arrived",
            Self::Failed => "failed",
            Self::Stopped => "stopped",
        })
    }
}

/// A driver of the chain; each commands the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Link {
    /// The path segment driver.
    Path,
    /// The vector driver.
    Vector,
    /// The primitive driver.
    Primitive,
}

impl Link {
    /// All of them, from the first to the last.
    pub const ALL: [Self; 3] = [Self::Path, Self::Vector, Self::Primitive];

    /// The stage in which it begins.
    pub(super) const fn stage(self) -> Stage {
        match self {
            Self::Path => Stage::Path,
            Self::Vector => Stage::Vector,
            Self::Primitive => Stage::Primitive,
        }
    }
}

impl fmt::Display for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Path => "path segment driver",
            Self::Vector => "vector driver",
            Self::Primitive => "primitive driver",
        })
    }
}

/// How a driver of the chain is doing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum LinkState {
    /// It has not said anything, or can not be heard any more.
    #[default]
    Silent,
    /// It has nothing to do.
    Idle,
    /// It takes the next one under control.
    Engaging,
    /// It does what it was told.
    Active,
    /// It can not go on, and says why.
    Blocked(String),
    /// It has done what it was told.
    Done,
}

impl LinkState {
    pub(super) const fn is_success(&self) -> bool {
        matches!(self, Self::Active | Self::Done)
    }
}
