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
//! | any, the controller restarted (of another product: after 8 s at least) | 0.5 s after the new process is there |
//! | any, its program hung | the actuator's deadline |
//! | global vector and waypoint, no position | 2.5 s after the receiver's fault |
//! | global vector and waypoint, a doubtful position | 0.5 s |
//! | any, a zone set on top of it | a braking distance deeper into the zone |
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
mod order;
mod plant;
mod positioning;
#[path = "../sim/mod.rs"]
mod sim;
mod simulator;
mod table;
mod trial;
mod vehicle;
mod witness;
mod world;

use std::sync::atomic::{AtomicU64, Ordering};

use cell::{Cell, Fault};
use sim::seeds;
use table::Table;

/// Number of fresh seeds without `JAUS_SEEDS`: one for every third cell. Thousands are run by hand.
const FRESH_SEEDS: u64 = 60;

#[test]
fn every_cell_stops() {
    check_each(
        "every cell once",
        "fresh_seeds_stop",
        Cell::of_local_drivers().collect(),
    );
}

#[test]
fn every_cell_of_the_globe_and_zones_stops() {
    let test = "fresh_seeds_of_the_globe_and_zones_stop";
    check_each(
        "the globe and zones",
        test,
        Cell::of_the_globe_and_zones().collect(),
    );
}

#[test]
fn fresh_seeds_stop() {
    check_fresh_seeds(
        "fresh_seeds_stop",
        FRESH_SEEDS,
        Cell::of_local_drivers().collect(),
    );
}

#[test]
fn fresh_seeds_of_controllers_that_restart_stop() {
    let all = Cell::of_local_drivers().chain(Cell::of_the_globe_and_zones());
    check_fresh_seeds(
        "fresh_seeds_of_controllers_that_restart_stop",
        FRESH_SEEDS / 3,
        all.filter(|cell| cell.fault == Fault::Restarted).collect(),
    );
}

#[test]
fn every_cell_of_foreign_controllers_that_restart_stops() {
    check_each(
        "foreign controllers that restart",
        "fresh_seeds_of_foreign_controllers_that_restart_stop",
        Cell::of_foreign_restarts().collect(),
    );
}

#[test]
fn fresh_seeds_of_foreign_controllers_that_restart_stop() {
    check_fresh_seeds(
        "fresh_seeds_of_foreign_controllers_that_restart_stop",
        FRESH_SEEDS / 3,
        Cell::of_foreign_restarts().collect(),
    );
}

#[test]
fn fresh_seeds_of_the_globe_and_zones_stop() {
    let test = "fresh_seeds_of_the_globe_and_zones_stop";
    check_fresh_seeds(
        test,
        FRESH_SEEDS / 3,
        Cell::of_the_globe_and_zones().collect(),
    );
}

/// Runs each cell once. `fresh` is the test that repeats a seed.
fn check_each(title: &str, fresh: &str, cells: Vec<Cell>) {
    let (table, next) = (Table::new(cells), AtomicU64::new(0));
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= table.cells().len() as u64 {
                return;
            }
            let cell = cell_of(table.cells(), seed);
            table.note(cell, seed, &trial::run(cell, seed));
        }
    };
    std::thread::scope(|scope| {
        for _thread in 0..2 {
            scope.spawn(work);
        }
    });
    table.print(title);
    let broken = table.broken();
    assert!(
        broken.is_empty(),
        "{} cells of {} are broken; to see one again: \
         JAUS_SEED=… JAUS_TRACE=1 cargo test --test safety {fresh}\n{}",
        broken.len(),
        table.cells().len(),
        broken.join("\n")
    );
    assert!(table.is_complete(), "not every cell moved before its fault");
}

fn check_fresh_seeds(test: &str, usual: u64, cells: Vec<Cell>) {
    /// Also prints the table when a seed fails.
    struct Printed(Table);
    impl Drop for Printed {
        fn drop(&mut self) {
            self.0.print("fresh seeds");
        }
    }
    let printed = Printed(Table::new(cells));
    let kept = include_str!("failed_seeds.txt");
    seeds::for_kept_and_fresh_seeds(test, kept, usual, |seed| {
        let cell = cell_of(printed.0.cells(), seed);
        let outcome = trial::run(cell, seed);
        printed.0.note(cell, seed, &outcome);
        match outcome.broken.first() {
            Some(broken) => Err(format!("{cell}: {broken}")),
            None => Ok(()),
        }
    });
}

/// The cell of a seed. The first seeds cover each cell once.
fn cell_of(cells: &[Cell], seed: u64) -> Cell {
    cells[(seed % cells.len() as u64) as usize]
}

#[test]
fn a_seed_gives_the_same_trial_again() {
    let cells: Vec<_> = Cell::of_local_drivers().collect();
    let globe: Vec<_> = Cell::of_the_globe_and_zones().collect();
    for (cells, seed) in [
        (&cells, 0),
        (&cells, 13),
        (&cells, 58),
        (&cells, 100),
        (&globe, 41),
    ] {
        let cell = cell_of(cells, seed);
        let runs = [trial::run(cell, seed), trial::run(cell, seed)];
        assert_eq!(runs[0], runs[1], "seed {seed}");
    }
}
