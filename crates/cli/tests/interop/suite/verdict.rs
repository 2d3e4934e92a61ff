//! Results of a run: one cell of the table per scenario and direction.

use std::path::PathBuf;
use std::time::Duration;

use crate::suite::scenario::Scenario;

/// Result of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Verdict {
    Passed,
    /// With the reason.
    Failed(String),
    /// With the reason: one of the two parties does not support it.
    NotApplicable(String),
}

/// A cell of the table.
#[derive(Debug, Clone)]
pub(crate) struct Cell {
    pub(crate) scenario: Scenario,
    pub(crate) verdict: Verdict,
    pub(crate) took: Duration,
    /// The recording, if it failed.
    pub(crate) recording: Option<PathBuf>,
}

/// A column of the table: one party acts, the other answers.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    pub(crate) peer: String,
    pub(crate) actor: String,
    pub(crate) answerer: String,
    pub(crate) cells: Vec<Cell>,
}
