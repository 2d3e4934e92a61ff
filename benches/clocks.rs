//! How precisely the clock of a peer is known over the Time service, by the delays of the network and the time since
//! the first exchange. The network and the clocks are simulated, so that the true offset is known.
//!
//! ```text
//! cargo bench --bench clocks
//! JAUS_WRITE_FIGURES=1 cargo bench --bench clocks    also writes docs/figures
//! ```
#![expect(
    clippy::expect_used,
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant, and a benchmark panics on failure"
)]

use std::time::{Duration, Instant};

use jaus::messages::core::ReportTime;
use jaus::messages::core::report_time::TimeStamp;
use jaus::service::{ClockEstimator, ClockOffset};
use jaus_test_kit::figures::Figures;

/// The pause between two exchanges, as of `jaus::component::PeerClocks` with up to 16 peers.
const PERIOD: Duration = Duration::from_secs(5);
/// What the clock of the peer gains, in seconds per second: 30 parts per million, a common crystal.
const DRIFT: f64 = 30e-6;
/// Runs with other delays.
const RUNS: u64 = 200;
/// The least and greatest delay of one direction, in milliseconds.
const NETWORKS: [(&str, f64, f64); 4] = [
    ("one host", 0.05, 0.2),
    ("local network", 0.2, 1.0),
    ("Wi-Fi", 1.0, 20.0),
    ("modem", 40.0, 400.0),
];
/// When the estimate is looked at.
const AFTER: [(&str, u32); 4] = [
    ("first exchange", 1),
    ("1 min", 12),
    ("10 min", 120),
    ("1 h", 720),
];

fn main() {
    let mut figures = Figures::new("clocks", "cargo bench --bench clocks");
    figures.table(
        "Uncertainty of the offset, and the greatest error of all runs, in ms",
        [
            "one-way delay",
            "first exchange",
            "1 min",
            "10 min",
            "1 h",
            "drift known after",
        ],
    );
    for (name, least, most) in NETWORKS {
        let runs: Vec<_> = (1..=RUNS).map(|seed| run(seed, least, most)).collect();
        let cells: Vec<_> = (0..AFTER.len()).map(|place| cell(&runs, place)).collect();
        let known = runs.iter().filter_map(|run| run.drift_known);
        let known = known.max().map_or_else(
            || "not in 1 h".to_owned(),
            |it| format!("{} s", it.as_secs()),
        );
        let network = format!("{name}, {least} to {most} ms");
        figures.row([&network, &cells[0], &cells[1], &cells[2], &cells[3], &known]);
    }
    figures.finish();
}

/// The median uncertainty and the greatest error of all runs.
fn cell(runs: &[Run], place: usize) -> String {
    let mut uncertainties: Vec<f64> = runs.iter().map(|run| run.seen[place].0).collect();
    uncertainties.sort_by(f64::total_cmp);
    let error = runs.iter().map(|run| run.seen[place].1).fold(0.0, f64::max);
    let median = uncertainties[uncertainties.len() / 2];
    format!("± {:.2}, error {:.2}", median * 1e3, error * 1e3)
}

/// Exchanges over an hour.
struct Run {
    /// Uncertainty and error in seconds at each time of [`AFTER`].
    seen: Vec<(f64, f64)>,
    drift_known: Option<Duration>,
}

fn run(seed: u64, least: f64, most: f64) -> Run {
    let mut random = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut delay = || {
        // xorshift64: reproducible, and random enough for delays.
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let part = (random >> 11) as f64 / (1_u64 << 53) as f64;
        Duration::from_secs_f64((least + part * (most - least)) / 1e3)
    };
    let start = Instant::now();
    let noon = Duration::from_secs(20_000 * 86_400 + 43_200) + delay() * 7;
    let first_offset = 1.234_567;
    let offset_at = |since: Duration| first_offset + DRIFT * since.as_secs_f64();
    let mut estimator = ClockEstimator::default();
    let (mut seen, mut drift_known) = (Vec::new(), None);
    for exchange in 1..=720 {
        let sent = PERIOD * exchange;
        let read = sent + delay();
        let received = read + delay();
        let peer = noon + read + Duration::from_secs_f64(offset_at(read));
        let report = ReportTime {
            time_stamp: Some(TimeStamp::at(peer)),
            date_stamp: None,
        };
        estimator.handle_report(start + sent, start + received, noon + received, &report);
        let offset: ClockOffset = estimator.offset().expect("an exchange gives an estimate");
        let error = (offset.seconds - offset_at(received)).abs();
        assert!(error <= offset.uncertainty, "{error} s: {offset:?}");
        if offset.drift.is_some() {
            drift_known.get_or_insert(sent);
        }
        if AFTER.iter().any(|(_, count)| *count == exchange) {
            seen.push((offset.uncertainty, error));
        }
    }
    Run { seen, drift_known }
}
