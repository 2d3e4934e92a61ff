//! Random scenarios on a simulated network: what endpoints promise holds for every seed.
//!
//! A seed gives the nodes, their settings, the traffic, and what goes wrong: loss, repetition,
//! detours, small sockets, short datagrams only, partitions, restarts. The [`ledger`] knows what was
//! sent and judges what comes out.
//!
//! `JAUS_SEEDS=n` tries so many seeds, `JAUS_SEED=n` exactly that one, and `JAUS_TRACE=1` prints
//! what happens in it.

#![expect(clippy::expect_used, clippy::panic, reason = "tests")]

mod control;
mod large;
mod ledger;
mod producer;
mod rules;
mod scenario;
#[path = "../sim/mod.rs"]
mod sim;
mod streams;
mod vehicle;

use sim::seeds::for_each_seed;

/// So many seeds are tried if nobody says otherwise.
const SEEDS: u64 = 2000;
/// So many of them send a large message: it has 736 fragments.
const LARGE_SEEDS: u64 = 1000;
/// So many of them have operators contend for a vehicle for two minutes.
const CONTROL_SEEDS: u64 = 100;
/// So many of them have clients subscribe to reports for three minutes.
const STREAM_SEEDS: u64 = 20;

#[test]
fn every_seed_keeps_the_promises() {
    for_each_seed("every_seed_keeps_the_promises", SEEDS, |seed| {
        scenario::run(seed).map(drop)
    });
}

#[test]
fn one_mib_acknowledged_arrives_over_loss_and_reordering() {
    for_each_seed(
        "one_mib_acknowledged_arrives_over_loss_and_reordering",
        LARGE_SEEDS,
        large::run,
    );
}

#[test]
fn a_stream_runs_at_its_rate_or_its_client_knows_that_it_is_down() {
    for_each_seed(
        "a_stream_runs_at_its_rate_or_its_client_knows_that_it_is_down",
        STREAM_SEEDS,
        streams::run,
    );
}

#[test]
fn one_client_at_a_time_controls_and_an_emergency_stops_it() {
    for_each_seed(
        "one_client_at_a_time_controls_and_an_emergency_stops_it",
        CONTROL_SEEDS,
        control::run,
    );
}

#[test]
fn a_seed_gives_the_same_run_again() {
    for seed in 0..20 {
        let runs = [scenario::run(seed), scenario::run(seed)];
        assert_eq!(runs[0], runs[1], "seed {seed}");
    }
    assert_ne!(scenario::run(1), scenario::run(2));
}
