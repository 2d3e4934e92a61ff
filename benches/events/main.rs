//! Benchmark of events: their cost, and how closely they keep their rate.
//!
//! ```sh
//! cargo bench --bench events               # a little over a minute
//! cargo bench --bench events -- --quick    # ten seconds of it
//! JAUS_WRITE_FIGURES=1 cargo bench --bench events    # also writes docs/figures/events.md
//! ```
//!
//! *Cost* is measured without a network: a component answers a query, or fires a subscription to
//! it; both end with a message ready to send. *Rate* is measured between two nodes on loopback in
//! this process, each with its own thread: the interval between two events of one subscription at
//! its client.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a benchmark owns the clock and panics on failure"
)]

mod cost;
mod rate;

use std::time::Duration;

use jaus_test_kit::figures::Figures;

fn main() {
    let quick = std::env::args().any(|argument| argument == "--quick");
    let mut figures = Figures::new("events", "cargo bench --bench events");
    cost::measure(if quick { 5 } else { 15 }, &mut figures);
    rate::measure(
        Duration::from_secs(if quick { 10 } else { 60 }),
        &mut figures,
    );
    figures.finish();
}

/// A quantile of the sorted values.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    sorted[(last as f64 * share).round() as usize]
}
