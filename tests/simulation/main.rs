//! Random scenarios on a simulated network: what endpoints promise holds for every seed.
//!
//! A seed gives the nodes, their settings, the traffic, and what goes wrong: loss, repetition,
//! detours, small sockets, short datagrams only, partitions, restarts. The [`ledger`] knows what was
//! sent and judges what comes out.
//!
//! `JAUS_SEEDS=n` tries so many seeds, `JAUS_SEED=n` exactly that one, and `JAUS_TRACE=1` prints
//! what happens in it.

#![expect(clippy::expect_used, clippy::panic, reason = "tests")]

mod ledger;
mod scenario;
mod seeds;
#[path = "../sim/mod.rs"]
mod sim;

use seeds::for_each_seed;

/// So many seeds are tried if nobody says otherwise.
const SEEDS: u64 = 2000;

#[test]
fn every_seed_keeps_the_promises() {
    for_each_seed("every_seed_keeps_the_promises", SEEDS, |seed| {
        scenario::run(seed).map(drop)
    });
}

#[test]
fn a_seed_gives_the_same_run_again() {
    for seed in 0..20 {
        let runs = [scenario::run(seed), scenario::run(seed)];
        assert_eq!(runs[0], runs[1], "seed {seed}");
    }
    assert_ne!(scenario::run(1), scenario::run(2));
}
