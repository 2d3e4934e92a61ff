//! No motion without a living controller: every kind of driver, combined with every fault, in
//! virtual time.
//!
//! A seed determines one trial: the cell, the network's delays and losses, the other peers, the
//! moment of the fault, and the controller's later actions. The vehicle's hardware is simulated
//! outside its program, so that it keeps moving while the program hangs or is dead, until its
//! actuator's deadline. The test measures the motion that the program orders:
//!
//! | driver | moves no longer than |
//! |---|---|
//! | effort, velocity, own service | 1 s after the last setpoint |
//! | vector, and effort and velocity that are held | 2 s after the controller's last message |
//! | waypoint, list, path segment | 5 s after the controller's last message |
//! | any | 5 s after the last Request Control |
//! | any, its program hung | the actuator's deadline |
//!
//! Control is free within 5 s of the last Request Control, there is no motion in the next 30 s, and
//! then a new lease sets the vehicle in motion.
//!
//! `JAUS_SEEDS=n` runs n fresh seeds, `JAUS_SEED=n` only seed n, and `JAUS_TRACE=1` prints its
//! events.

#![expect(clippy::expect_used, clippy::panic, reason = "tests")]

mod cell;
mod client;
mod commands;
mod gateway;
mod plant;
#[path = "../sim/mod.rs"]
mod sim;
mod simulator;
mod table;
mod trial;
mod vehicle;
mod witness;
mod world;

use std::sync::atomic::{AtomicU64, Ordering};

use cell::Cell;
use sim::seeds;
use table::Table;

/// Number of fresh seeds without `JAUS_SEEDS`: one for every third cell. Thousands are run by hand.
const FRESH_SEEDS: u64 = 60;

#[test]
fn every_cell_stops() {
    let (table, next) = (Table::default(), AtomicU64::new(0));
    let cells = Cell::all().count() as u64;
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= cells {
                return;
            }
            table.note(trial::cell_of(seed), seed, &trial::run(seed));
        }
    };
    std::thread::scope(|scope| {
        for _thread in 0..2 {
            scope.spawn(work);
        }
    });
    table.print("every cell once");
    let broken = table.broken();
    assert!(
        broken.is_empty(),
        "{} cells of {cells} are broken; to see one again: \
         JAUS_SEED=… JAUS_TRACE=1 cargo test --test safety fresh_seeds_stop\n{}",
        broken.len(),
        broken.join("\n")
    );
    assert!(table.is_complete(), "not every cell moved before its fault");
}

#[test]
fn fresh_seeds_stop() {
    /// Also prints the table when a seed fails.
    struct Printed(Table);
    impl Drop for Printed {
        fn drop(&mut self) {
            self.0.print("fresh seeds");
        }
    }
    let printed = Printed(Table::default());
    let kept = include_str!("failed_seeds.txt");
    seeds::for_kept_and_fresh_seeds("fresh_seeds_stop", kept, FRESH_SEEDS, |seed| {
        let (cell, outcome) = (trial::cell_of(seed), trial::run(seed));
        printed.0.note(cell, seed, &outcome);
        match outcome.broken.first() {
            Some(broken) => Err(format!("{cell}: {broken}")),
            None => Ok(()),
        }
    });
}

#[test]
fn a_seed_gives_the_same_trial_again() {
    for seed in [0, 13, 58, 100] {
        let runs = [trial::run(seed), trial::run(seed)];
        assert_eq!(runs[0], runs[1], "seed {seed}");
    }
}
