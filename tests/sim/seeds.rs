//! Runs many seeds, on both threads of a small machine, and prints how to repeat the one that
//! fails.

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

const THREADS: usize = 2;

fn number_in(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    let number = text.parse();
    Some(number.unwrap_or_else(|_| panic!("{variable}={text}: a number is expected")))
}

/// Whether what happens is to be printed.
pub(crate) fn is_traced() -> bool {
    std::env::var_os("JAUS_TRACE").is_some_and(|value| value != "0")
}

/// Runs `JAUS_SEED` if it is set, or else the first `JAUS_SEEDS` (or `usual`) seeds.
pub(crate) fn for_each_seed(
    test: &str,
    usual: u64,
    run: impl Fn(u64) -> Result<(), String> + Sync,
) {
    run_seeds(test, 0, usual, run);
}

/// Runs `JAUS_SEED` if it is set, or else `JAUS_SEEDS` (or `usual`) seeds that no run before had:
/// they are printed.
pub(crate) fn for_fresh_seeds(
    test: &str,
    usual: u64,
    run: impl Fn(u64) -> Result<(), String> + Sync,
) {
    // The hasher's keys are the operating system's randomness. Fewer digits are easier to type.
    let first = RandomState::new().hash_one(test) % 1_000_000_000_000;
    run_seeds(test, first, usual, run);
}

/// Prints a line past the test harness, which keeps the output of tests that pass.
pub(crate) fn announce(line: &str) {
    // Where nothing can be printed, the tests still count.
    let _written = writeln!(std::io::stderr().lock(), "{line}");
}

fn run_seeds(test: &str, first: u64, usual: u64, run: impl Fn(u64) -> Result<(), String> + Sync) {
    let (first, end) = match number_in("JAUS_SEED") {
        Some(seed) => (seed, seed + 1),
        None => (first, first + number_in("JAUS_SEEDS").unwrap_or(usual)),
    };
    if first > 0 {
        announce(&format!("{test}: seeds {first} to {}", end - 1));
    }
    let (next, failed) = (AtomicU64::new(first), Mutex::new(Vec::new()));
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= end {
                return;
            }
            let outcome = catch_unwind(AssertUnwindSafe(|| run(seed)));
            let reason = match outcome {
                Ok(Ok(())) => continue,
                Ok(Err(reason)) => reason,
                Err(_) => "it panics; see above".to_owned(),
            };
            failed.lock().expect("no panic").push((seed, reason));
            // The others would only repeat it.
            next.fetch_add(end, Ordering::Relaxed);
        }
    };
    std::thread::scope(|scope| {
        for _thread in 0..THREADS {
            scope.spawn(work);
        }
    });
    let failed = failed.into_inner().expect("no panic");
    if let Some((seed, reason)) = failed.iter().min() {
        panic!(
            "seed {seed}: {reason}\nto see it again: \
             JAUS_SEED={seed} JAUS_TRACE=1 cargo test --test {} {test}",
            env!("CARGO_CRATE_NAME"),
        );
    }
}
