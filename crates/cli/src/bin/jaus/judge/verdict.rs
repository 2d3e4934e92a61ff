//! Results of a run: one per step, with all messages.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;

use super::step::{Form, Name, Step};

/// Result of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Verdict {
    Passed,
    /// With the reason as text.
    Failed(String),
    /// With the reason as text, such as a missing service.
    Skipped(String),
    /// Skipped by the user's choice, with the reason as text.
    LeftOut(String),
}

impl Verdict {
    pub(super) const fn name(&self) -> &'static str {
        match self {
            Self::Passed => "ok",
            Self::Failed(_) => "failed",
            Self::Skipped(_) | Self::LeftOut(_) => "skipped",
        }
    }

    /// The reason of a failure or a skip.
    pub(super) fn reason(&self) -> Option<&str> {
        match self {
            Self::Passed => None,
            Self::Failed(reason) | Self::Skipped(reason) | Self::LeftOut(reason) => Some(reason),
        }
    }
}

/// A step with its result.
#[derive(Debug)]
pub(super) struct StepResult {
    pub(super) name: Name,
    pub(super) title: String,
    pub(super) form: Form,
    pub(super) verdict: Verdict,
    pub(super) took: Duration,
    /// Messages in order, up to the first failure.
    pub(super) proceedings: Vec<Proceeding>,
}

impl StepResult {
    /// A step that the user has left out.
    pub(super) fn left_out(step: &Step, form: Form, reason: &str) -> Self {
        Self {
            name: step.name,
            title: step.title.to_string(),
            form,
            verdict: Verdict::LeftOut(reason.to_owned()),
            took: Duration::ZERO,
            proceedings: Vec::new(),
        }
    }
}

/// One exchange or observation of a step.
#[derive(Debug)]
pub(super) struct Proceeding {
    pub(super) sent: Option<ObservedMessage>,
    /// The required messages, as text; empty if none.
    pub(super) expected: Vec<String>,
    pub(super) received: Vec<ObservedMessage>,
    /// The measurement, as text.
    pub(super) measured: Option<String>,
    /// From the request to the last required answer.
    pub(super) latency: Option<Duration>,
}

/// A message between the judge and the subject.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ObservedMessage {
    pub(super) from: JausId,
    pub(super) to: JausId,
    pub(super) octets: Bytes,
}

/// Results of a whole run, in numbers.
#[derive(Debug, Default)]
pub(super) struct Tally {
    pub(super) passed: usize,
    pub(super) failed: usize,
    pub(super) skipped: usize,
    /// How many of the skipped steps the user has left out.
    pub(super) left_out: usize,
    latencies: Vec<Duration>,
}

impl Tally {
    pub(super) fn count(&mut self, result: &StepResult) {
        match result.verdict {
            Verdict::Passed => self.passed += 1,
            Verdict::Failed(_) => self.failed += 1,
            Verdict::Skipped(_) => self.skipped += 1,
            Verdict::LeftOut(_) => {
                self.skipped += 1;
                self.left_out += 1;
            }
        }
        let latencies = result.proceedings.iter().filter_map(|one| one.latency);
        self.latencies.extend(latencies);
    }

    pub(super) const fn steps(&self) -> usize {
        self.passed + self.failed + self.skipped
    }

    /// Whether the subject conforms, as tested: at least one step passed and none failed.
    pub(super) const fn conforms(&self) -> bool {
        self.failed == 0 && self.passed > 0
    }

    /// The median and the maximum of the answer times.
    pub(super) fn latency(&self) -> Option<(Duration, Duration)> {
        let mut sorted = self.latencies.clone();
        sorted.sort_unstable();
        let most = *sorted.last()?;
        Some((sorted[sorted.len() / 2], most))
    }
}
