//! Runs many seeds, on both cores of a small machine, and prints how to repeat a failing one.

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;

const THREADS: usize = 2;

fn number_in(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    let number = text.parse();
    Some(number.unwrap_or_else(|_| panic!("{variable}={text}: a number is expected")))
}

/// Whether to print the trace.
pub(crate) fn is_traced() -> bool {
    std::env::var_os("JAUS_TRACE").is_some_and(|value| value != "0")
}

/// Runs `JAUS_SEED` if it is set; otherwise the seeds of this test in `kept`, and `JAUS_SEEDS` (or
/// `usual`) fresh random seeds, whose numbers it prints.
///
/// `kept` has a line for each seed that once failed: the test, the seed, and after `#` the failure.
/// Returns whether all fresh seeds were run, so that their totals are meaningful.
pub(crate) fn for_kept_and_fresh_seeds(
    test: &str,
    kept: &str,
    usual: u64,
    run: impl Fn(u64) -> Result<(), String> + Sync,
) -> bool {
    run_seeds(test, kept_seeds(test, kept), &run);
    // The operating system's randomness, through the hasher's keys. Fewer digits are easier to
    // type.
    let first = RandomState::new().hash_one(test) % 1_000_000_000_000;
    let seeds = match number_in("JAUS_SEED") {
        Some(seed) => seed..seed + 1,
        None => first..first + number_in("JAUS_SEEDS").unwrap_or(usual),
    };
    if seeds.is_empty() {
        return true;
    }
    announce(&format!(
        "{test}: seeds {} to {}",
        seeds.start,
        seeds.end - 1
    ));
    run_seeds(test, seeds, &run);
    number_in("JAUS_SEED").is_none() && number_in("JAUS_SEEDS").is_none_or(|seeds| seeds >= usual)
}

/// Empty if `JAUS_SEED` chooses a seed.
fn kept_seeds(test: &str, kept: &str) -> impl Iterator<Item = u64> {
    let lines = kept.lines().filter(|_| number_in("JAUS_SEED").is_none());
    let lines = lines.map(|line| line.split('#').next().unwrap_or_default());
    let words = lines.map(|line| line.split_whitespace().collect::<Vec<_>>());
    let seed = move |words: Vec<&str>| match words[..] {
        [] => None,
        [name, seed] => (name == test).then(|| seed.parse().expect("a seed")),
        _ => panic!("a test and a seed are expected: {words:?}"),
    };
    words.filter_map(seed)
}

/// Prints a line directly to standard error: the test harness hides the output of passing tests.
pub(crate) fn announce(line: &str) {
    // If printing fails, the tests still count.
    let _written = writeln!(std::io::stderr().lock(), "{line}");
}

fn run_seeds(
    test: &str,
    seeds: impl Iterator<Item = u64> + Send,
    run: impl Fn(u64) -> Result<(), String> + Sync,
) {
    let (left, failed) = (Mutex::new(Some(seeds)), Mutex::new(Vec::new()));
    let next = || {
        let mut left = left.lock().expect("no panic");
        left.as_mut().and_then(Iterator::next)
    };
    let work = || {
        while let Some(seed) = next() {
            let outcome = catch_unwind(AssertUnwindSafe(|| run(seed)));
            let reason = match outcome {
                Ok(Ok(())) => continue,
                Ok(Err(reason)) => reason,
                Err(_) => "it panics; see above".to_owned(),
            };
            failed.lock().expect("no panic").push((seed, reason));
            // The remaining seeds would only repeat the failure.
            *left.lock().expect("no panic") = None;
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
