//! Tries many seeds, on both threads of a small machine, and tells how to repeat the one that
//! fails.

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

/// Tries `JAUS_SEED` if it is set, or else the first `JAUS_SEEDS` (or `usual`) seeds.
pub(crate) fn for_each_seed(
    test: &str,
    usual: u64,
    run: impl Fn(u64) -> Result<(), String> + Sync,
) {
    let (first, end) = match number_in("JAUS_SEED") {
        Some(seed) => (seed, seed + 1),
        None => (0, number_in("JAUS_SEEDS").unwrap_or(usual)),
    };
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
             JAUS_SEED={seed} JAUS_TRACE=1 cargo test --test simulation {test}"
        );
    }
}
