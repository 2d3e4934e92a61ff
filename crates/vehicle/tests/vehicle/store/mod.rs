//! Power cuts during writes: nothing acknowledged is lost, and the store can always be opened
//! again.
//!
//! Some tens of cuts by default. `JAUS_POWER_CUTS=1000` makes 1000 of each kind, and `JAUS_SEED`
//! selects them.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "tests with processes that are killed at random instants"
)]

mod flipped;
mod killed;
mod ledger;
mod torn;

use jaus_test_kit::random::Random;

/// Number of power cuts.
fn cuts(usual: u32) -> u32 {
    number("JAUS_POWER_CUTS").map_or(usual, |cuts| cuts as u32)
}

/// The random generator; prints its seed, so that a failure can be reproduced.
fn chance(test: &str) -> Random {
    let seed = number("JAUS_SEED").unwrap_or_else(|| u64::from(std::process::id()));
    println!("{test}: JAUS_SEED={seed}");
    Random::new(seed)
}

fn number(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    Some(text.parse().expect("a number"))
}
