//! Random scenarios on a simulated network: what endpoints and services promise holds for every
//! seed.
//!
//! A seed gives the nodes and their networks, their settings, the traffic, and what goes wrong.
//! Each run takes seeds that no run before had, prints them, and repeats those of
//! `failed_seeds.txt`. What happened in all of them is printed too, and none of it may be missing.
//!
//! | here | what it does |
//! |---|---|
//! | [`scenario`] | messages between endpoints: the timeline, the traffic, the time after healing |
//! | [`plan`] | what a seed chooses beforehand: networks, routers, settings of each node |
//! | [`nodes`] | the nodes on their networks, through restarts |
//! | [`faults`] | what goes wrong and when it ends |
//! | [`ledger`] | what was promised, and whether what comes out keeps it |
//! | [`judges`] | what endpoints keep to whatever happens: bounds, and rest when all is quiet |
//! | [`totals`] | what has happened over all seeds |
//! | [`large`], [`streams`], [`control`], [`directories`] | scenarios of their own: one large message, subscriptions, operators, discovery |
//!
//! `JAUS_SEEDS=n` tries so many seeds, `JAUS_SEED=n` exactly that one, and `JAUS_TRACE=1` prints
//! what happens in it. A hundred thousand, as fast as a debug build allows:
//!
//! ```sh
//! JAUS_SEEDS=100000 CARGO_PROFILE_TEST_OPT_LEVEL=2 cargo test --test simulation every_seed
//! ```

#![expect(clippy::expect_used, clippy::panic, reason = "tests")]

mod control;
mod directories;
mod faults;
mod judges;
mod large;
mod ledger;
mod network;
mod nodes;
mod plan;
mod producer;
mod rules;
mod scenario;
#[path = "../sim/mod.rs"]
mod sim;
mod streams;
mod totals;
mod vehicle;

use totals::run_seeds;

/// So many seeds are tried if nobody says otherwise.
const SEEDS: u64 = 1000;
/// So many of them send a large message: it has 736 fragments.
const LARGE_SEEDS: u64 = 100;
/// So many of them have operators contend for a vehicle for two minutes.
const CONTROL_SEEDS: u64 = 50;
/// So many of them have clients subscribe to reports for three minutes.
const STREAM_SEEDS: u64 = 15;
/// So many of them have components look for each other for two minutes.
const DIRECTORY_SEEDS: u64 = 20;

#[test]
fn every_seed_keeps_the_promises() {
    run_seeds("every_seed_keeps_the_promises", SEEDS, |seed| {
        scenario::run(seed).map(|summary| summary.counts)
    });
}

#[test]
fn one_mib_acknowledged_arrives_over_loss_and_reordering() {
    let test = "one_mib_acknowledged_arrives_over_loss_and_reordering";
    run_seeds(test, LARGE_SEEDS, large::run);
}

#[test]
fn a_stream_runs_at_its_rate_or_its_client_knows_that_it_is_down() {
    let test = "a_stream_runs_at_its_rate_or_its_client_knows_that_it_is_down";
    run_seeds(test, STREAM_SEEDS, streams::run);
}

#[test]
fn one_client_at_a_time_controls_and_an_emergency_stops_it() {
    let test = "one_client_at_a_time_controls_and_an_emergency_stops_it";
    run_seeds(test, CONTROL_SEEDS, control::run);
}

#[test]
fn directories_agree_once_the_wire_is_good() {
    let test = "directories_agree_once_the_wire_is_good";
    run_seeds(test, DIRECTORY_SEEDS, directories::run);
}

#[test]
fn a_seed_gives_the_same_run_again() {
    for seed in 0..20 {
        let runs = [scenario::run(seed), scenario::run(seed)];
        assert_eq!(runs[0], runs[1], "seed {seed}");
    }
    assert_ne!(scenario::run(1), scenario::run(2));
}
