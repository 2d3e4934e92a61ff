//! The stages of a mission, and the reported states of the driver chain.

use std::fmt;

/// Stage of a mission. The numbers are those of Report Mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Stage {
    /// No mission yet.
    #[default]
    Idle = 0,
    /// Fetching the map, or waiting for the next attempt.
    Map = 1,
    /// Planning a path.
    Planning = 2,
    /// Waiting for the operator to approve the path.
    AwaitingApproval = 3,
    /// Handing the path to the path segment driver.
    Path = 4,
    /// The path segment driver is active; waiting for the vector driver under its control.
    Vector = 5,
    /// The vector driver is active; waiting for the primitive driver under its control.
    Primitive = 6,
    /// The vehicle is driving.
    Driving = 7,
    /// The vehicle is at its destination.
    Arrived = 8,
    /// The mission was given up.
    Failed = 9,
    /// The mission was ended by the operator or an emergency.
    Stopped = 10,
    /// The vehicle was stopped for a fault, and waits until the operator continues the mission.
    Waiting = 11,
}

impl Stage {
    /// Whether the mission is still in progress.
    #[must_use]
    pub const fn is_under_way(self) -> bool {
        !matches!(
            self,
            Self::Idle | Self::Arrived | Self::Failed | Self::Stopped
        )
    }

    /// Whether the drivers are involved.
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
            Self::Waiting => "waiting",
        })
    }
}

/// A driver of the chain. Each commands the next.
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
    /// All drivers, from first to last.
    pub const ALL: [Self; 3] = [Self::Path, Self::Vector, Self::Primitive];

    /// The stage in which the driver starts.
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

/// State of a driver of the chain.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum LinkState {
    /// No report yet, or reports have ceased.
    #[default]
    Silent,
    /// Nothing to do.
    Idle,
    /// Taking control of the next driver.
    Engaging,
    /// Executing the command.
    Active,
    /// Unable to continue, with the reason.
    Blocked(String),
    /// The command is complete.
    Done,
}

impl LinkState {
    pub(super) const fn is_success(&self) -> bool {
        matches!(self, Self::Active | Self::Done)
    }
}
