//! Random scenarios on a simulated network: the guarantees of endpoints and services hold for every
//! seed.
//!
//! A seed determines the nodes and their networks, their settings, the traffic, and the faults.
//! Each run uses fresh seeds, prints them, and repeats those of `failed_seeds.txt`. It also prints
//! the events of all seeds; a full run fails if a kind of event never occurred.
//!
//! | module | content |
//! |---|---|
//! | [`scenario`] | messages between endpoints: the timeline, the traffic, the time after healing |
//! | [`plan`] | choices of a seed: networks, routers, settings of each node |
//! | [`nodes`] | the nodes on their networks, across restarts |
//! | [`faults`] | faults and their ends |
//! | [`ledger`] | sent messages, and checks of their delivery |
//! | [`judges`] | invariants of endpoints: bounds, and silence when all is quiet |
//! | [`totals`] | events over all seeds |
//! | [`answers`] | a large answer over a slow wire |
//! | [`clocks`] | clocks of two hosts, measured over JAUS Time |
//! | [`large`], [`streams`], [`control`], [`directories`] | separate scenarios: a large message, subscriptions, operators, discovery |
//!
//! `JAUS_SEEDS=n` runs n seeds, `JAUS_SEED=n` only seed n, and `JAUS_TRACE=1` prints its events. A
//! hundred thousand, as fast as a debug build allows:
//!
//! ```sh
//! JAUS_SEEDS=100000 CARGO_PROFILE_TEST_OPT_LEVEL=2 cargo test --test simulation every_seed
//! ```

#![expect(clippy::expect_used, clippy::panic, reason = "tests")]

mod answers;
mod clocks;
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

/// The default number of seeds.
const SEEDS: u64 = 300;
/// Default number of seeds that send a large message: it has 736 fragments.
const LARGE_SEEDS: u64 = 30;
/// Default number of seeds with operators that contend for a vehicle for two minutes.
const CONTROL_SEEDS: u64 = 25;
/// Default number of seeds with clients that subscribe to reports for three minutes.
const STREAM_SEEDS: u64 = 8;
/// Default number of seeds with components that discover each other for two minutes.
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
