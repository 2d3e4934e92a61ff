//! Results of a load test: as a table, as JSON, and as a chart.

use std::fmt;
use std::path::Path;
use std::time::Duration;

use jaus_cli::failure::Failure;
use jaus_vehicle::parts::tester::plot::{Line, Plot};
use serde::{Deserialize, Serialize};

use super::Rate;
use super::process::Tally;

/// Content of a `--save` file.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Report {
    /// Name of the measurement in the chart.
    pub(super) name: String,
    pub(super) components: u16,
    /// Number of processes with components.
    pub(super) processes: u16,
    /// Per message.
    pub(super) octets: u16,
    pub(super) window: u32,
    pub(super) burst: u32,
    /// Per row.
    pub(super) seconds: f64,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) rows: Vec<Row>,
}

/// One step of the schedule; times in milliseconds.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Row {
    /// Messages per second; `None` for as many as possible.
    pub(super) wanted: Option<u32>,
    /// Acknowledged messages per second.
    pub(super) per_second: f64,
    pub(super) sent: u64,
    pub(super) lost: u64,
    pub(super) refused: u64,
    pub(super) mean: f64,
    pub(super) p50: f64,
    pub(super) p99: f64,
    pub(super) p999: f64,
    pub(super) max: f64,
    /// Microseconds of processor time per acknowledged message, in all processes; `None` if the
    /// operating system does not report it.
    pub(super) processor: Option<f64>,
}

impl Row {
    pub(super) const HEAD: &str = "| wanted/s | acknowledged/s | sent | lost | refused | mean ms | \
        p50 ms | p99 ms | p99.9 ms | max ms | CPU µs |\n\
        |---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|";

    pub(super) fn new(rate: Rate, tally: &Tally, time: Duration, used: Option<Duration>) -> Self {
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        let latencies = &tally.latencies;
        let [p50, p99, p999, max] =
            [0.5, 0.99, 0.999, 1.0].map(|share| milliseconds(latencies.percentile(share)));
        Self {
            wanted: match rate {
                Rate::PerSecond(rate) => Some(rate),
                Rate::Max => None,
            },
            per_second: latencies.count() as f64 / time.as_secs_f64(),
            sent: tally.sent,
            lost: tally.lost(),
            refused: tally.refused,
            mean: milliseconds(latencies.mean()),
            p50,
            p99,
            p999,
            max,
            processor: used.map(|used| used.as_secs_f64() * 1e6 / tally.all.max(1) as f64),
        }
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wanted = self
            .wanted
            .map_or("max".to_owned(), |rate| rate.to_string());
        write!(
            f,
            "| {wanted:>7} | {:>9.0} | {:>8} | {:>4} | {:>4} |",
            self.per_second, self.sent, self.lost, self.refused
        )?;
        for time in [self.mean, self.p50, self.p99, self.p999, self.max] {
            write!(f, " {time:>8.3} |")?;
        }
        match self.processor {
            Some(microseconds) => write!(f, " {microseconds:>6.1} |"),
            None => f.write_str("      – |"),
        }
    }
}

impl Report {
    pub(super) fn read(file: &Path) -> Result<Self, Failure> {
        let text = std::fs::read_to_string(file).map_err(|error| Failure::file(file, &error))?;
        let file = file.display();
        serde_json::from_str(&text)
            .map_err(|error| Failure::new(format!("{file} is not a load report: {error}")))
    }

    pub(super) fn title(&self) -> String {
        format!(
            "{}: {} components, {} octets",
            self.name, self.components, self.octets
        )
    }

    /// Chart of round trips over the reached rate.
    pub(super) fn plot(&self, beside: Option<&Self>) -> Plot {
        let lines = std::iter::once(self).chain(beside).flat_map(Self::lines);
        Plot {
            title: format!(
                "Acknowledged messages of {} octets between {} components",
                self.octets, self.components
            ),
            across: "messages per second".to_owned(),
            up: "round trip in milliseconds".to_owned(),
            lines: lines.collect(),
        }
    }

    fn lines(&self) -> [Line; 2] {
        let line = |what: &str, time: fn(&Row) -> f64| {
            let points = self.rows.iter().map(|row| (row.per_second, time(row)));
            let mut points: Vec<_> = points.collect();
            // An overloaded step may reach less than the one before it.
            points.sort_by(|one, other| one.0.total_cmp(&other.0));
            let name = format!("{} {what}", self.name);
            Line { name, points }
        };
        [line("p99", |row| row.p99), line("mean", |row| row.mean)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(name: &str, sent: u64, acknowledged: u64) -> Report {
        let mut tally = Tally {
            all: sent,
            sent,
            ..Tally::default()
        };
        (0..acknowledged).for_each(|_| tally.latencies.add(Duration::from_micros(500)));
        let time = Duration::from_secs(2);
        Report {
            name: name.to_owned(),
            components: 2,
            processes: 1,
            octets: 170,
            window: 2,
            burst: 1,
            seconds: 2.0,
            rows: [Rate::PerSecond(50), Rate::Max]
                .map(|rate| Row::new(rate, &tally, time, None))
                .into(),
        }
    }

    #[test]
    fn messages_without_acknowledgement_are_lost() {
        let row = &report("one", 100, 90).rows[0];
        assert_eq!((row.sent, row.lost, row.per_second), (100, 10, 45.0));
        assert!((row.mean - 0.5).abs() < 1e-9, "{row}");
    }

    #[test]
    fn a_report_survives_its_file_and_stands_beside_another() {
        let text = serde_json::to_string(&report("other", 10, 10)).unwrap();
        let other: Report = serde_json::from_str(&text).unwrap();
        assert_eq!(
            (other.rows[0].wanted, other.rows[1].wanted),
            (Some(50), None)
        );
        let svg = report("one", 10, 10).plot(Some(&other)).to_string();
        for name in ["one mean", "one p99", "other mean", "other p99"] {
            assert!(svg.contains(name), "{name} is missing: {svg}");
        }
    }
}
