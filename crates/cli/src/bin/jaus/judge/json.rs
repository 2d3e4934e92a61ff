//! Writes the run as JSON lines, one per step and one for the end.

use std::time::Duration;

use jaus_view::{Dictionary, Line};
use serde::Serialize;

use super::report::conclusion;
use super::subject::Subject;
use super::verdict::{ObservedMessage, Proceeding, StepResult, Tally};

/// A line for a step.
#[derive(Serialize)]
struct Step<'a> {
    step: String,
    title: &'a str,
    form: &'a str,
    verdict: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'a str>,
    seconds: f64,
    proceedings: Vec<Exchange<'a>>,
}

#[derive(Serialize)]
struct Exchange<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    sent: Option<Message<'a>>,
    expected: &'a [String],
    received: Vec<Message<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    latency_ms: Option<f64>,
}

#[derive(Serialize)]
struct Message<'a> {
    source: String,
    destination: String,
    #[serde(flatten)]
    line: Line<'a>,
}

/// The last line.
#[derive(Serialize)]
struct End<'a> {
    subject: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    ok: usize,
    failed: usize,
    skipped: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    latency_median_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    latency_most_ms: Option<f64>,
    conforms: bool,
    conclusion: String,
}

/// The line of a step, without a line break.
pub(super) fn step(dictionary: &Dictionary, result: &StepResult) -> String {
    let proceedings = result.proceedings.iter();
    let step = Step {
        step: result.name.to_string(),
        title: &result.title,
        form: result.form.name(),
        verdict: result.verdict.name(),
        reason: result.verdict.reason(),
        seconds: rounded(result.took.as_secs_f64()),
        proceedings: proceedings.map(|one| exchange(dictionary, one)).collect(),
    };
    to_line(&step)
}

/// The last line.
pub(super) fn end(subject: &Subject, tally: &Tally, against: &str) -> String {
    let latency = tally.latency();
    to_line(&End {
        subject: subject.id.to_string(),
        name: subject.name.as_deref(),
        ok: tally.passed,
        failed: tally.failed,
        skipped: tally.skipped,
        latency_median_ms: latency.map(|(median, _)| millis(median)),
        latency_most_ms: latency.map(|(_, most)| millis(most)),
        conforms: tally.conforms(),
        conclusion: conclusion(subject, tally, against),
    })
}

fn exchange<'a>(dictionary: &'a Dictionary, proceeding: &'a Proceeding) -> Exchange<'a> {
    let said = |said| message(dictionary, said);
    Exchange {
        sent: proceeding.sent.as_ref().map(said),
        expected: &proceeding.expected,
        received: proceeding.received.iter().map(said).collect(),
        measured: proceeding.measured.as_deref(),
        latency_ms: proceeding.latency.map(millis),
    }
}

fn message<'a>(dictionary: &'a Dictionary, said: &ObservedMessage) -> Message<'a> {
    Message {
        source: said.from.to_string(),
        destination: said.to.to_string(),
        line: dictionary.line(&said.octets),
    }
}

fn to_line(value: &impl Serialize) -> String {
    // Serialisation into memory fails only for maps without text keys; there are none.
    serde_json::to_string(value).unwrap_or_default()
}

fn millis(time: Duration) -> f64 {
    rounded(time.as_secs_f64() * 1e3)
}

fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
