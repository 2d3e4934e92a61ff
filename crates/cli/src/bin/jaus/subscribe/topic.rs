//! A subscription with its figures, and how its reports are printed.

use std::fmt::Display;
use std::time::Duration;

use bytes::Bytes;
use jaus::component::{PeerClocks, Subscription, Undecoded, Update};
use jaus_cli::failure::Failure;
use jaus_cli::output::Output;
use jaus_cli::runtime::Clock;
use jaus_view::{Dictionary, Line};
use serde::Serialize;
use serde_json::json;

use super::rate::Rate;
use super::sampled::time_stamp;
use crate::queries::in_words;

/// A subscription to one query.
pub(super) struct Topic {
    query: String,
    subscription: Subscription<Undecoded>,
    reports: u64,
    unreadable: u64,
    rate: Rate,
}

impl Topic {
    pub(super) fn new(query: String, subscription: Subscription<Undecoded>) -> Self {
        Self {
            query,
            subscription,
            reports: 0,
            unreadable: 0,
            rate: Rate::default(),
        }
    }

    /// Waits for the next update. Cancel safe.
    pub(super) async fn next(&mut self) -> Option<Update<Undecoded>> {
        self.subscription.next().await
    }

    /// Whether a readable report has arrived.
    pub(super) const fn has_reports(&self) -> bool {
        self.reports > self.unreadable
    }

    fn age(&self) -> Option<f64> {
        self.subscription.age().as_ref().map(Duration::as_secs_f64)
    }
}

/// Prints reports, outages and the figures at the end.
pub(super) struct Printer<'d> {
    output: Output,
    is_json: bool,
    dictionary: &'d Dictionary,
    clock: Clock,
    /// The clocks of the peers, if they are measured.
    peer_clocks: Option<PeerClocks>,
}

/// A report with the figures of its subscription.
#[derive(Serialize)]
struct Report<'d> {
    source: String,
    #[serde(flatten)]
    line: Line<'d>,
    hz: Option<f64>,
    age: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sampled: Option<Sampled>,
    lost: u64,
}

/// How long ago the sample of a report was taken.
#[derive(Serialize)]
struct Sampled {
    /// Seconds since the time stamp of the report.
    age: f64,
    /// The true age differs by this many seconds at most.
    uncertainty: f64,
}

impl<'d> Printer<'d> {
    pub(super) fn new(
        is_json: bool,
        dictionary: &'d Dictionary,
        peer_clocks: Option<PeerClocks>,
    ) -> Self {
        Self {
            output: Output::new(),
            is_json,
            dictionary,
            clock: Clock::start(),
            peer_clocks,
        }
    }

    /// The age of a report by its time stamp, if the clock of its sender is known.
    fn sampled(&self, topic: &Topic, line: &Line<'_>) -> Option<Sampled> {
        let clocks = self.peer_clocks.as_ref()?;
        let age = clocks.age(topic.subscription.peer(), time_stamp(line)?)?;
        Some(Sampled {
            age: rounded(age.seconds),
            uncertainty: rounded(age.uncertainty),
        })
    }

    pub(super) fn report(&mut self, topic: &mut Topic, octets: &Bytes) -> Result<(), Failure> {
        topic.reports += 1;
        topic.rate.count(self.clock.elapsed());
        let line = self.dictionary.line(octets);
        topic.unreadable += u64::from(line.is_error());
        let sampled = self.sampled(topic, &line);
        if !self.is_json {
            let age = sampled.map_or_else(String::new, |sampled| {
                let Sampled { age, uncertainty } = sampled;
                format!("  ({age:.3} s old, ±{uncertainty:.3} s)")
            });
            let words = in_words(self.dictionary, octets);
            return self.timed(format_args!("{words}{age}"));
        }
        let report = Report {
            source: topic.subscription.peer().to_string(),
            line,
            hz: topic.rate.hz().map(rounded),
            age: topic.age().map(rounded),
            sampled,
            lost: topic.subscription.lost(),
        };
        let text = serde_json::to_string(&report).map_err(Failure::of)?;
        self.output.line(text)
    }

    pub(super) fn up(&mut self, topic: &mut Topic) -> Result<(), Failure> {
        topic.rate.reset();
        let (query, peer) = (&topic.query, topic.subscription.peer());
        let hz = topic.subscription.hz();
        if self.is_json {
            return self.event(topic, "up", &json!({ "confirmed_hz": hz.map(rounded) }));
        }
        match hz {
            Some(hz) => self.timed(format_args!(
                "subscribed to {query} of {peer} at {hz:.2} Hz"
            )),
            None => self.timed(format_args!("subscribed to {query} of {peer} on change")),
        }
    }

    pub(super) fn down(&mut self, topic: &mut Topic, why: &dyn Display) -> Result<(), Failure> {
        if self.is_json {
            return self.event(topic, "down", &json!({ "reason": why.to_string() }));
        }
        let (query, peer) = (&topic.query, topic.subscription.peer());
        self.timed(format_args!("no reports for {query} of {peer}: {why}"))
    }

    /// Prints why the peer ended the subscription.
    pub(super) fn ended(&mut self, topic: &Topic) -> Result<(), Failure> {
        let why = topic.subscription.end();
        let why = why.map_or_else(|| "the node has stopped".to_owned(), |why| why.to_string());
        if self.is_json {
            return self.event(topic, "end", &json!({ "reason": why }));
        }
        let (query, peer) = (&topic.query, topic.subscription.peer());
        self.timed(format_args!(
            "no subscription to {query} of {peer} any more: {why}"
        ))
    }

    /// Prints the figures at the end.
    pub(super) fn summary(&mut self, topic: &Topic) -> Result<(), Failure> {
        let (lost, missed) = (topic.subscription.lost(), topic.subscription.missed());
        let (hz, age) = (topic.rate.hz(), topic.age());
        if self.is_json {
            let figures = json!({
                "reports": topic.reports,
                "hz": hz.map(rounded),
                "age": age.map(rounded),
                "lost": lost,
                "missed": missed,
            });
            return self.event(topic, "end", &figures);
        }
        let (query, peer, reports) = (&topic.query, topic.subscription.peer(), topic.reports);
        let rate = hz.map_or_else(String::new, |hz| format!(" at {hz:.1} Hz"));
        let age = age.map_or_else(String::new, |age| format!(", the last {age:.1} s ago"));
        self.output.line(format_args!(
            "{query} of {peer}: {reports} reports{rate}, {lost} lost{age}"
        ))
    }

    fn timed(&mut self, words: impl Display) -> Result<(), Failure> {
        self.output.line(format_args!("{}  {words}", self.clock))
    }

    /// Prints an object with an event and its details.
    fn event(
        &mut self,
        topic: &Topic,
        event: &str,
        details: &serde_json::Value,
    ) -> Result<(), Failure> {
        let mut object = json!({
            "source": topic.subscription.peer().to_string(),
            "query": topic.query,
            "event": event,
        });
        if let (Some(object), Some(details)) = (object.as_object_mut(), details.as_object()) {
            object.extend(details.clone());
        }
        self.output.line(object)
    }
}

/// To the millisecond or millihertz.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
