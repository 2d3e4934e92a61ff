//! Keeps a flood of the same entry from filling the log.

use std::time::{Duration, Instant};

use crate::entry::Entry;

/// How long repetitions of an entry are counted before a line says how many there were.
const PERIOD: Duration = Duration::from_secs(10);
/// Different entries whose repetitions are counted at a time. Further ones are written each time.
const MOST: usize = 64;

/// The entries written in the last [`PERIOD`], each with the repetitions since.
#[derive(Debug, Default)]
pub(crate) struct Repeats(Vec<Recent>);

#[derive(Debug)]
struct Recent {
    entry: Entry,
    again: u64,
    due: Instant,
}

impl Repeats {
    /// Whether the entry is to be written now. If not, it has been counted.
    pub(crate) fn is_new(&mut self, now: Instant, entry: &Entry) -> bool {
        if let Some(recent) = self.0.iter_mut().find(|it| entry.repeats(&it.entry)) {
            recent.again += 1;
            recent.entry.time = entry.time;
            return false;
        }
        if self.0.len() < MOST {
            self.0.push(Recent {
                entry: entry.clone(),
                again: 0,
                due: now + PERIOD,
            });
        }
        true
    }

    /// The counted repetitions whose period is over at `now`; all of them without a time.
    pub(crate) fn take(&mut self, now: Option<Instant>) -> Vec<Entry> {
        let is_due = |recent: &mut Recent| now.is_none_or(|now| recent.due <= now);
        let due = self.0.extract_if(.., is_due).filter(|it| it.again > 0);
        due.map(|it| Entry {
            times: it.again,
            ..it.entry
        })
        .collect()
    }

    /// When the next period ends.
    pub(crate) fn due(&self) -> Option<Instant> {
        self.0.iter().map(|it| it.due).min()
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::Outcome;

    fn entry(what: &str) -> Entry {
        Entry::new("console", what, Outcome::Refused)
    }

    #[test]
    fn the_first_is_written_and_the_others_counted_for_ten_seconds() {
        let (start, mut repeats) = (Instant::now(), Repeats::default());
        assert!(repeats.is_new(start, &entry("SetWrenchEffort")));
        for _ in 0..999 {
            assert!(!repeats.is_new(start, &entry("SetWrenchEffort")));
        }
        assert!(repeats.is_new(start, &entry("RequestControl")));
        assert_eq!(repeats.take(Some(start)), []);
        assert_eq!(repeats.due(), Some(start + PERIOD));
        let counted = repeats.take(repeats.due());
        assert_eq!(counted.len(), 1);
        assert_eq!(
            (counted[0].what.as_str(), counted[0].times),
            ("SetWrenchEffort", 999)
        );
        assert!(repeats.is_new(start + PERIOD, &entry("SetWrenchEffort")));
    }

    #[test]
    fn beyond_the_bound_every_entry_is_written() {
        let (start, mut repeats) = (Instant::now(), Repeats::default());
        for index in 0..2 * MOST {
            assert!(repeats.is_new(start, &entry(&index.to_string())));
        }
        assert!(repeats.is_new(start, &entry(&MOST.to_string())));
        assert_eq!(repeats.0.len(), MOST);
    }
}
