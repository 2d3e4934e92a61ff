//! From the operator's hand to the motor: only a living hand moves a vehicle, and only the one that it
//! holds. Seeded trials in virtual time, of the real programs:
//!
//! | part | what runs |
//! |---|---|
//! | hand | a simulated operator at each of two pages: keys, touch, gamepad, released or lost |
//! | page | all of the page's own JavaScript, in `node`, with a simulated document and clock |
//! | page to station | simulated TCP: delay, jitter, loss as delay, rate, cuts, connections that break |
//! | station | `jaus_ocu::Station` with its server, over streams in memory |
//! | station to vehicles | simulated datagrams: delay, loss, duplicates, copies that are late |
//! | vehicles | two components with the library's primitive driver, and motors with a deadline |
//!
//! Each host has clocks of its own, which run up to 8 % too fast or too slow and may be stepped. Station,
//! vehicles and pages are restarted within less than any limit of silence. The test looks at the motors:
//!
//! * Motion ends within 0.5 s and one way of the last moment when hand, page, links, station and vehicle
//!   were all well; within 0.9 s if two of them fail one after the other.
//! * One page drives forward and the other one backward, so that a motor shows whose hand drives it.
//! * What has stopped after its hand was gone does not move until a hand takes it up.
//! * An emergency stop over links that are free acts within 0.3 s and one way, and nothing moves until it
//!   is cleared.
//! * A stop that is pressed while things go wrong acts once all is well, and holds against every hand.
//! * Once all is well, both operators can drive. Wrong clocks alone interrupt nobody who drives.
//!
//! `JAUS_SEEDS=n` runs n fresh seeds, `JAUS_SEED=n` only seed n, and `JAUS_TRACE=1` prints its events.
//! A seed gives the same mishaps and the same networks again, but not quite the same trial: the programs
//! draw random numbers of their own. So a trial that fails tells its story at once.
#![allow(
    clippy::disallowed_methods,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test with a clock that is paused"
)]

mod air;
mod browser;
mod cable;
mod host;
mod mishaps;
mod operator;
mod page;
#[path = "../../../../tests/sim/seeds.rs"]
mod seeds;
mod station;
mod story;
mod trial;
mod vehicle;
mod witness;
mod world;

use std::sync::Mutex;
use std::time::Duration;

use trial::Outcome;

/// Number of fresh seeds of the tests without `JAUS_SEEDS`, except for the rough trials: about one in 100 of
/// those does not end with both operators driving. Thousands are run by hand.
const FRESH_SEEDS: u64 = 10;

#[test]
fn only_a_living_hand_moves_a_vehicle() {
    check("only_a_living_hand_moves_a_vehicle", 0, trial::run_rough);
}

#[test]
fn a_stop_that_is_pressed_in_trouble_arrives() {
    let totals = check(
        "a_stop_that_is_pressed_in_trouble_arrives",
        FRESH_SEEDS,
        trial::run_stopped,
    );
    assert!(totals.emergencies > 0, "no stop was judged: {totals:?}");
}

#[test]
fn wrong_clocks_stop_no_hand_that_holds() {
    check(
        "wrong_clocks_stop_no_hand_that_holds",
        FRESH_SEEDS,
        trial::run_quiet,
    );
}

fn check(test: &str, usual: u64, run: impl Fn(u64) -> Outcome + Sync) -> Totals {
    let totals = Mutex::new(Totals::default());
    let kept = include_str!("failed_seeds.txt");
    seeds::for_kept_and_fresh_seeds(test, kept, usual, |seed| {
        let outcome = run(seed);
        totals.lock().unwrap().add(&outcome);
        match outcome.broken {
            Some(broken) => Err(format!("{broken}\n{}", story::tell())),
            None => Ok(()),
        }
    });
    let totals = totals.into_inner().unwrap();
    seeds::announce(&format!("{test}: {totals:.3?}"));
    assert!(totals.moved > 0, "nothing moved: {totals:?}");
    totals
}

/// What was seen in all trials.
#[derive(Debug, Default)]
struct Totals {
    trials: u32,
    /// Hands that have moved a vehicle.
    moved: u32,
    emergencies: u32,
    /// The longest motion after a last sign of life, without the time of one way.
    longest: Duration,
}

impl Totals {
    fn add(&mut self, outcome: &Outcome) {
        self.trials += 1;
        self.moved += outcome.moved;
        self.emergencies += outcome.emergencies;
        self.longest = self.longest.max(outcome.longest);
    }
}
