//! Totals of events over all seeds of a test: an untriggered guarantee is untested.

use std::collections::BTreeMap;
use std::sync::Mutex;

use crate::sim::seeds::{announce, for_kept_and_fresh_seeds};

/// Number of occurrences of each kind of event.
pub(crate) type Counts = BTreeMap<&'static str, u64>;

/// Runs the kept and the fresh seeds of a test, prints the totals, and fails if any kind of event
/// never occurred.
pub(crate) fn run_seeds(
    test: &str,
    usual: u64,
    run: impl Fn(u64) -> Result<Counts, String> + Sync,
) {
    let kept = include_str!("failed_seeds.txt");
    let totals = Mutex::new(Counts::new());
    let is_whole = for_kept_and_fresh_seeds(test, kept, usual, |seed| {
        let counts = run(seed)?;
        let mut totals = totals.lock().expect("no panic");
        for (what, count) in counts {
            *totals.entry(what).or_default() += count;
        }
        Ok(())
    });
    let totals = totals.into_inner().expect("no panic");
    let words = totals.iter().map(|(what, count)| format!("{count} {what}"));
    announce(&format!("{test}: {}", words.collect::<Vec<_>>().join(", ")));
    let never: Vec<_> = totals.iter().filter(|(_, count)| **count == 0).collect();
    assert!(!is_whole || never.is_empty(), "never happened: {never:?}");
}
