//! Why a command to a mission was refused, and why planning failed.

use super::Stage;
use crate::mission::NoPath;

/// Why an approval or a continuation was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The command concerns a mission that has been replaced.
    #[error("mission {wanted} was replaced by mission {current}")]
    Replaced {
        /// The mission in the command.
        wanted: u32,
        /// The current mission.
        current: u32,
    },
    /// The mission is over.
    #[error("mission {mission} is over ({stage})")]
    Over {
        /// The mission in the command.
        mission: u32,
        /// Its final stage.
        stage: Stage,
    },
    /// A fault has stopped the mission, and an approval does not continue it.
    #[error("mission {mission} was stopped by a fault: continue it, or set a new destination")]
    Waiting {
        /// The mission in the command.
        mission: u32,
    },
    /// The mission to be continued does not wait.
    #[error("mission {mission} does not wait to be continued: its stage is {stage}")]
    NotWaiting {
        /// The mission in the command.
        mission: u32,
        /// Its stage.
        stage: Stage,
    },
}

/// Why planning failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotPlanned {
    /// The reason, as text for the operator.
    pub reason: String,
    /// Whether a retry would fail in the same way.
    pub hopeless: bool,
}

impl From<NoPath> for NotPlanned {
    fn from(error: NoPath) -> Self {
        Self {
            reason: error.to_string(),
            hopeless: !error.may_pass(),
        }
    }
}
