//! Power cuts during writes: nothing acknowledged is lost, and the store can always be opened
//! again.
//!
//! Some tens of cuts by default; `JAUS_POWER_CUTS=1000` makes 1000 of each kind, and `JAUS_SEED`
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

/// How many cuts to make.
fn cuts(usual: u32) -> u32 {
    number("JAUS_POWER_CUTS").map_or(usual, |cuts| cuts as u32)
}

/// Where chance begins: printed, so that a failure can be had again.
fn chance(test: &str) -> Chance {
    let seed = number("JAUS_SEED").unwrap_or_else(|| u64::from(std::process::id()));
    println!("{test}: JAUS_SEED={seed}");
    Chance(seed)
}

fn number(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    Some(text.parse().expect("a number"))
}

/// Numbers that look random (SplitMix64).
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// One of the numbers below `end`.
    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }
}
