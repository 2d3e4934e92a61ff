//! Counts messages by kind and sender, with their rates.

use std::collections::BTreeMap;

use jaus_text::quoted;
use jaus_view::{Entry, Timestamp};

/// Maximum number of kinds, as an attacker may invent more.
const MOST: usize = 4096;

/// Counts by sender and message.
#[derive(Default)]
pub(super) struct Tally {
    counts: BTreeMap<(String, String), u64>,
    total: u64,
    lost: u64,
    span: Option<(f64, f64)>,
}

impl Tally {
    pub(super) fn add(&mut self, entry: &Entry) {
        self.total += 1;
        let text = |key| entry.text(key).map(|it| quoted(it).into_owned());
        let message = match entry.event_report() {
            Some(report) => format!("{report} (event)"),
            None => entry.name(),
        };
        let message = quoted(&message).into_owned();
        let key = (text("source").unwrap_or_default(), message);
        if self.counts.len() < MOST || self.counts.contains_key(&key) {
            *self.counts.entry(key).or_default() += 1;
        }
        let time = entry.text("time").and_then(|time| time.parse().ok());
        if let Some(time) = time.map(seconds) {
            let (first, last) = self.span.unwrap_or((time, time));
            self.span = Some((first.min(time), last.max(time)));
        }
    }

    pub(super) fn lose(&mut self, count: u64) {
        self.lost += count;
    }

    pub(super) fn lines(&self) -> Vec<String> {
        let span = self.span.map_or(0.0, |(first, last)| last - first);
        let mut lines = vec![format!(
            "{:>9} {:>9}  {:<12} message",
            "count", "per s", "from"
        )];
        let mut counts: Vec<_> = self.counts.iter().collect();
        counts.sort_by(|a, b| b.1.cmp(a.1));
        for ((source, message), &count) in counts {
            let rate = if span > 0.0 {
                format!("{:.1}", count as f64 / span)
            } else {
                "-".to_owned()
            };
            lines.push(format!("{count:>9} {rate:>9}  {source:<12} {message}"));
        }
        lines.push(format!(
            "{} messages in {span:.1} s; {} lost",
            self.total, self.lost
        ));
        lines
    }
}

fn seconds(time: Timestamp) -> f64 {
    time.seconds() as f64 + f64::from(time.subsec_nanos()) / 1e9
}

#[cfg(test)]
mod tests {
    use serde_json::{Value as Json, json};

    use super::*;

    #[test]
    fn an_event_counts_as_its_report_apart_from_answers_to_queries() {
        let mut tally = Tally::default();
        for (code, message) in [("41F1", "Event"), ("4404", "ReportVelocityState")] {
            let carried = json!({"code": "4404", "message": "ReportVelocityState"});
            let mut line = json!({"source": "101.2.42", "code": code, "message": message});
            if code == "41F1" {
                line["carries"] = carried;
            }
            if let Json::Object(line) = line {
                tally.add(&Entry::of_object(line));
            }
        }
        let lines = tally.lines().join("\n");
        assert!(
            lines.contains("101.2.42     ReportVelocityState (event)\n"),
            "{lines}"
        );
        assert!(
            lines.contains("101.2.42     ReportVelocityState\n"),
            "{lines}"
        );
    }
}
