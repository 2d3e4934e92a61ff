//! What a run finds: one result for each step, with everything that was said.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;

use super::step::{Form, Name};

/// What became of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Verdict {
    Passed,
    /// With the reason in words.
    Failed(String),
    /// With the reason in words, such as a service that the subject does not offer.
    Skipped(String),
}

impl Verdict {
    pub(super) const fn name(&self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed(_) => "failed",
            Self::Skipped(_) => "skipped",
        }
    }

    /// Why it failed or was skipped.
    pub(super) fn reason(&self) -> Option<&str> {
        match self {
            Self::Passed => None,
            Self::Failed(reason) | Self::Skipped(reason) => Some(reason),
        }
    }
}

/// A step that was carried out, or skipped.
#[derive(Debug)]
pub(super) struct StepResult {
    pub(super) name: Name,
    pub(super) title: String,
    pub(super) form: Form,
    pub(super) verdict: Verdict,
    pub(super) took: Duration,
    /// What was said and heard, in order, up to the first thing that was wrong.
    pub(super) proceedings: Vec<Proceeding>,
}

/// One exchange or observation of a step.
#[derive(Debug)]
pub(super) struct Proceeding {
    pub(super) sent: Option<ObservedMessage>,
    /// What had to come, in words; empty if nothing had to.
    pub(super) expected: Vec<String>,
    pub(super) came: Vec<ObservedMessage>,
    /// What was measured, in words.
    pub(super) measured: Option<String>,
    /// From the request to the last of the answers that had to come.
    pub(super) latency: Option<Duration>,
}

/// A message between the judge and the subject.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ObservedMessage {
    pub(super) from: JausId,
    pub(super) to: JausId,
    pub(super) octets: Bytes,
}

/// How a whole run ended, in numbers.
#[derive(Debug, Default)]
pub(super) struct Tally {
    pub(super) passed: usize,
    pub(super) failed: usize,
    pub(super) skipped: usize,
    latencies: Vec<Duration>,
}

impl Tally {
    pub(super) fn count(&mut self, result: &StepResult) {
        match result.verdict {
            Verdict::Passed => self.passed += 1,
            Verdict::Failed(_) => self.failed += 1,
            Verdict::Skipped(_) => self.skipped += 1,
        }
        let latencies = result.proceedings.iter().filter_map(|one| one.latency);
        self.latencies.extend(latencies);
    }

    pub(super) const fn steps(&self) -> usize {
        self.passed + self.failed + self.skipped
    }

    /// Whether the subject may be said to conform, as tested: something was, and nothing failed.
    pub(super) const fn conforms(&self) -> bool {
        self.failed == 0 && self.passed > 0
    }

    /// The median and the greatest of the times that answers took.
    pub(super) fn latency(&self) -> Option<(Duration, Duration)> {
        let mut sorted = self.latencies.clone();
        sorted.sort_unstable();
        let most = *sorted.last()?;
        Some((sorted[sorted.len() / 2], most))
    }
}
