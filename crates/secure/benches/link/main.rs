//! The cost of the secure link between two processes, compared with the plain link.
//!
//! ```text
//! cargo bench -p jaus-secure --bench link               takes two minutes
//! cargo bench -p jaus-secure --bench link -- --quick    few repetitions
//! JAUS_WRITE_FIGURES=1 cargo bench -p jaus-secure --bench link    also writes docs/figures
//! ```
//!
//! Both links are measured in turns in the same run, because the speed of a shared machine varies:
//! read the ratios. The program starts itself as the other node of each link.
#![expect(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a benchmark owns the clock and panics on failure"
)]

mod pair;
#[path = "../../../../benches/transport/placement.rs"]
#[allow(dead_code, reason = "shared with the benchmark of the transport")]
mod placement;
#[path = "../../../../benches/transport/report.rs"]
#[allow(dead_code, reason = "shared with the benchmark of the transport")]
mod report;

use std::env;
use std::time::Duration;

use jaus_test_kit::figures::Figures;

use pair::{Link, Pair};
use placement::Placement;
use report::{median, micros, percentile, quotient, ratio, spread};

/// How much to measure.
#[derive(Clone, Copy)]
struct Effort {
    /// Repetitions of each measurement, alternating between the links.
    runs: usize,
    /// Round trips in one run.
    round_trips: usize,
    /// The time of sending large messages in one run.
    time: Duration,
}

const THOROUGH: Effort = Effort {
    runs: 9,
    round_trips: 5000,
    time: Duration::from_secs(1),
};

const QUICK: Effort = Effort {
    runs: 3,
    round_trips: 1000,
    time: Duration::from_millis(500),
};

/// Octets of a small message.
const SMALL: usize = 64;
/// Octets of a large message.
const LARGE: usize = 1 << 20;
/// The aim: the greatest ratio of round trips.
const ROUND_TRIP_AIM: f64 = 1.6;
/// The aim: the smallest ratio of rates.
const RATE_AIM: f64 = 0.5;

fn main() {
    if let Some(role) = pair::role_of_this_process() {
        placement::settle();
        return pair::echo(&role);
    }
    let is_quick = env::args().any(|argument| argument == "--quick");
    let (effort, flag) = match is_quick {
        true => (QUICK, " -- --quick"),
        false => (THOROUGH, ""),
    };
    let command = format!("cargo bench -p jaus-secure --bench link{flag}");
    let mut figures = Figures::new("secure-link", &command);
    for placement in Placement::pinned() {
        placement.take();
        let mut pairs = Link::ALL.map(|link| Pair::start(link, placement));
        measure_round_trips(&mut pairs, placement, effort, &mut figures);
        measure_rates(&mut pairs, placement, effort, &mut figures);
    }
    Placement::Free.take();
    figures.finish();
}

fn measure_round_trips(
    pairs: &mut [Pair; 2],
    placement: Placement,
    effort: Effort,
    figures: &mut Figures,
) {
    let (mut medians, mut tails) = ([const { Vec::new() }; 2], [const { Vec::new() }; 2]);
    for run in 0..=effort.runs {
        for (index, pair) in pairs.iter_mut().enumerate() {
            let times = pair.round_trips(SMALL, effort.round_trips);
            let times: Vec<_> = times.into_iter().map(micros).collect();
            // The first run only warms up.
            if run > 0 {
                medians[index].push(median(&times));
                tails[index].push(percentile(&times, 99));
            }
        }
    }
    figures.table(
        &format!("Round trip, {SMALL} octets, {} (µs)", placement.name()),
        ["link", "median", "p99", "median to the plain link"],
    );
    for (index, link) in Link::ALL.iter().enumerate() {
        figures.row([
            link.name(),
            &spread(&medians[index], 1),
            &spread(&tails[index], 1),
            &ratio(&medians[index], &medians[0]),
        ]);
    }
    let is_met = quotient(&medians[1], &medians[0]) <= ROUND_TRIP_AIM;
    figures.aim("at most 1.6 × the plain link", [("", is_met)]);
}

fn measure_rates(
    pairs: &mut [Pair; 2],
    placement: Placement,
    effort: Effort,
    figures: &mut Figures,
) {
    let mut rates = [const { Vec::new() }; 2];
    for run in 0..=effort.runs {
        for (index, pair) in pairs.iter_mut().enumerate() {
            let messages = pair.messages_per_second(LARGE, effort.time);
            if run > 0 {
                rates[index].push(messages * LARGE as f64 / 1e6);
            }
        }
    }
    figures.table(
        &format!("Acknowledged messages of 1 MiB, {}", placement.name()),
        ["link", "MB/s", "rate to the plain link"],
    );
    for (index, link) in Link::ALL.iter().enumerate() {
        let rate = spread(&rates[index], 1);
        figures.row([link.name(), &rate, &ratio(&rates[index], &rates[0])]);
    }
    let is_met = quotient(&rates[1], &rates[0]) >= RATE_AIM;
    figures.aim("at least half of the plain link", [("", is_met)]);
}
