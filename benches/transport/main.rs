//! The cost of the transport between processes, compared with the limits of the machine.
//!
//! ```text
//! cargo bench --bench transport                     everything; takes ten minutes
//! cargo bench --bench transport -- round --quick    what has "round" in its name, few repetitions
//! JAUS_WRITE_FIGURES=1 cargo bench --bench transport    also writes the tables to `docs/figures`
//! ```
//!
//! Every figure stands next to a baseline of the same run (raw UDP, a raw Unix stream, bare relays
//! with the same number of hops, a copy in memory), because the speed of a shared machine varies:
//! read the ratios. The program starts itself as child processes for the other components and
//! nodes, all on loopback, pinned to processors, and prints Markdown. `docs/performance.md` shows
//! the written tables. `cargo bench --bench wire` measures the cost of a message within the endpoint
//! alone.

#![expect(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a benchmark owns clock and sockets and panics on failure"
)]

mod baseline;
mod child;
mod fan_out;
mod idle;
mod loss;
mod one_way;
mod place;
mod placement;
mod play;
mod relay;
mod report;
mod roles;
mod round_trip;
mod run;
mod setting;

use std::env;

use jaus_test_kit::figures::Figures;

/// How much to measure.
#[derive(Clone, Copy)]
struct Effort {
    /// Repetitions of each measurement, alternating with the others.
    runs: usize,
    /// Round trips in one run.
    round_trips: usize,
    /// Seconds of sending in one run.
    seconds: f64,
    /// Seconds of watching an idle node.
    idle_seconds: f64,
}

const THOROUGH: Effort = Effort {
    runs: 7,
    round_trips: 5000,
    seconds: 0.5,
    idle_seconds: 20.0,
};

const QUICK: Effort = Effort {
    runs: 3,
    round_trips: 1000,
    seconds: 0.3,
    idle_seconds: 5.0,
};

/// A measurement.
type Measure = fn(Effort, &mut Figures);

/// The measurements by name.
const PARTS: [(&str, Measure); 5] = [
    ("round trip", round_trip::measure),
    ("one way", one_way::measure),
    ("loss", loss::measure),
    ("idle", idle::measure),
    ("fan-out", fan_out::measure),
];

fn main() {
    if let Some(role) = roles::of_this_process() {
        placement::settle();
        return play::play(role);
    }
    let (mut effort, mut quick) = (THOROUGH, "");
    let mut filter = String::new();
    for argument in env::args().skip(1) {
        match argument.as_str() {
            "--quick" => (effort, quick) = (QUICK, " --quick"),
            // Cargo passes it to every benchmark.
            "--bench" => {}
            _ => filter = argument,
        }
    }
    for (name, measure) in PARTS.iter().filter(|(name, _)| name.contains(&filter)) {
        let file = format!("transport-{}", name.replace(' ', "-"));
        let command = format!("cargo bench --bench transport -- \"{name}\"{quick}");
        let mut figures = Figures::new(&file, &command);
        measure(effort, &mut figures);
        figures.finish();
    }
    // Remains if a measurement fails.
    let _ = std::fs::remove_dir_all(run::folder());
}
