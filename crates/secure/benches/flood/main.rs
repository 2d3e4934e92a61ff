//! The cost of forged first packets, and what a flood of them does to sessions and to new links.
//!
//! ```text
//! cargo bench -p jaus-secure --bench flood               takes two minutes
//! cargo bench -p jaus-secure --bench flood -- --quick    few repetitions
//! ```
//!
//! The baseline of each figure is measured in the same run: a datagram of a session, or no flood. The
//! flood, the vehicle and the operator share the processors of one machine, over loopback sockets.
#![expect(
    clippy::expect_used,
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a benchmark owns the clock and the sockets, and panics on failure"
)]

mod packets;
#[path = "../../../../benches/transport/report.rs"]
#[allow(dead_code, reason = "shared with the benchmark of the transport")]
mod report;
mod scene;

use std::env;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use jaus_secure::transport::Counter;
use jaus_test_kit::figures::Figures;

use packets::{Kind, Pair};
use report::{median, micros, percentile, spread};
use scene::{Flood, Scene};

/// How much to measure.
#[derive(Clone, Copy)]
struct Effort {
    /// Repetitions of the measurement of a packet.
    runs: usize,
    /// New links under each flood.
    links: usize,
    /// Round trips of the existing session under each flood.
    round_trips: usize,
}

const THOROUGH: Effort = Effort {
    runs: 9,
    links: 20,
    round_trips: 500,
};

const QUICK: Effort = Effort {
    runs: 3,
    links: 5,
    round_trips: 100,
};

/// Packets in one run.
const PACKETS: usize = 2000;
/// Rates of the floods, in packets per second; the last one is as fast as the machine can.
const RATES: [u32; 3] = [0, 20_000, u32::MAX];
/// The rate for which there is an aim.
const AIMED: u32 = 20_000;

fn main() {
    let is_quick = env::args().any(|argument| argument == "--quick");
    let (effort, flag) = match is_quick {
        true => (QUICK, " -- --quick"),
        false => (THOROUGH, ""),
    };
    let command = format!("cargo bench -p jaus-secure --bench flood{flag}");
    let mut figures = Figures::new("secure-flood", &command);
    measure_packets(effort, &mut figures);
    measure_floods(effort, &mut figures);
    figures.finish();
}

/// The time that a node spends on one packet, without sockets.
fn measure_packets(effort: Effort, figures: &mut Figures) {
    figures.table(
        "Processor time for one datagram, without sockets (µs)",
        ["datagram", "time", "answered"],
    );
    for kind in Kind::ALL {
        let (mut times, mut answered) = (Vec::new(), 0);
        for run in 0..=effort.runs {
            let (time, answers) = Pair::new().receive(kind, PACKETS);
            answered = answers;
            // The first run only warms up.
            if run > 0 {
                times.push(micros(time) / PACKETS as f64);
            }
        }
        let share = format!("{} %", 100 * answered / PACKETS);
        figures.row([kind.name(), &spread(&times, 2), &share]);
    }
}

/// New links and an existing session under floods from their own address.
fn measure_floods(effort: Effort, figures: &mut Figures) {
    figures.table(
        "Under a flood of first packets from the operator's address (ms)",
        [
            "packets/s",
            "new link, median",
            "new link, worst",
            "round trip, median",
            "round trip, worst",
            "sessions lost",
        ],
    );
    let mut aims = Vec::new();
    for rate in RATES {
        let scene = Scene::start();
        let flood = Flood::start(scene.vehicle, rate);
        let trips = scene.round_trips(effort.round_trips);
        let links: Vec<_> = (0..effort.links).map(|_| new_link(&scene)).collect();
        let sent = flood.stop();
        let lost = scene.established(Counter::SessionsEstablished) - 1;
        let ms = |times: &[f64], percent| format!("{:.1}", percentile(times, percent) / 1e3);
        figures.row([
            &format!("{sent}"),
            &ms(&links, 50),
            &ms(&links, 100),
            &ms(&trips, 50),
            &ms(&trips, 100),
            &format!("{lost}"),
        ]);
        if rate == AIMED {
            aims.push(("", median(&links) < 1e6 && percentile(&links, 100) < 3e6));
        }
    }
    figures.aim(
        "at 20 000 packets/s a new link within 1 s (median) and 3 s (worst)",
        aims,
    );
}

/// The time until a new link is up, in µs.
fn new_link(scene: &Scene) -> f64 {
    let start = Instant::now();
    assert!(scene.dial(Duration::from_secs(30)), "no link within 30 s");
    micros(start.elapsed())
}

fn any_port() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 0))
}
