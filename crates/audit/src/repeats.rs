//! Keeps a flood of the same entry from filling the log.

use std::time::{Duration, Instant};

use crate::entry::{Entry, Outcome};

/// How long repetitions of an entry are counted before a line says how many there were.
const PERIOD: Duration = Duration::from_secs(10);
/// Different entries whose repetitions are counted at a time. Of further ones refusals are counted
/// together, so that a flood of them does not fill the log, and all others are written.
const MOST: usize = 64;

/// The entries written in the last [`PERIOD`], each with the repetitions since.
#[derive(Debug, Default)]
pub(crate) struct Repeats {
    recent: Vec<Recent>,
    /// Refusals beyond the bound.
    others: u64,
}

#[derive(Debug)]
struct Recent {
    entry: Entry,
    again: u64,
    due: Instant,
}

impl Repeats {
    /// Whether the entry is to be written now. If not, it has been counted.
    pub(crate) fn is_new(&mut self, now: Instant, entry: &Entry) -> bool {
        if let Some(recent) = self.recent.iter_mut().find(|it| entry.repeats(&it.entry)) {
            recent.again += 1;
            recent.entry.time = entry.time;
            return false;
        }
        if self.recent.len() < MOST {
            self.recent.push(Recent {
                entry: entry.clone(),
                again: 0,
                due: now + PERIOD,
            });
            return true;
        }
        let is_counted = entry.result == Outcome::Refused;
        self.others += u64::from(is_counted);
        !is_counted
    }

    /// The counted repetitions whose period is over at `now`; all of them without a time.
    pub(crate) fn take(&mut self, now: Option<Instant>) -> Vec<Entry> {
        let is_due = |recent: &mut Recent| now.is_none_or(|now| recent.due <= now);
        let due: Vec<_> = self.recent.extract_if(.., is_due).collect();
        let others = match due.is_empty() {
            true => 0,
            false => std::mem::take(&mut self.others),
        };
        let again = |it: Recent| Entry {
            times: it.again,
            ..it.entry
        };
        let others = (others > 0).then(|| Entry {
            times: others,
            ..Entry::new("several", "various", Outcome::Refused)
                .because("more different refusals at once than are listed")
        });
        let due = due.into_iter().filter(|it| it.again > 0).map(again);
        due.chain(others).collect()
    }

    /// When the next period ends.
    pub(crate) fn due(&self) -> Option<Instant> {
        self.recent.iter().map(|it| it.due).min()
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

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
    fn beyond_the_bound_refusals_are_counted_together_and_others_written() {
        let (start, mut repeats) = (Instant::now(), Repeats::default());
        for index in 0..MOST {
            assert!(repeats.is_new(start, &entry(&index.to_string())));
        }
        for index in MOST..1000 {
            assert!(!repeats.is_new(start, &entry(&index.to_string())));
        }
        let allowed = Entry::new("console", "Reset", Outcome::Allowed);
        assert!(repeats.is_new(start, &allowed) && repeats.is_new(start, &allowed));
        let counted = repeats.take(repeats.due());
        assert_eq!(counted.len(), 1);
        assert_eq!(counted[0].times, 1000 - MOST as u64);
        assert!(repeats.is_new(start + PERIOD, &entry("1000")));
    }
}
