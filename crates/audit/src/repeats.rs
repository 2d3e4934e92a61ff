//! Keeps a flood of the same entry from filling the log.

use std::time::{Duration, Instant, SystemTime};

use crate::entry::{Entry, Outcome};

/// How long repetitions of an entry are counted before a line says how many there were.
const PERIOD: Duration = Duration::from_secs(10);
/// Different entries whose repetitions are counted at a time. Further refusals are counted together, so that
/// a flood of them does not fill the log, and all others are written.
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
    /// Without its time and number.
    entry: Entry,
    again: u64,
    last: SystemTime,
    due: Instant,
}

impl Repeats {
    /// Whether the entry is to be written now. If not, it has been counted. Evidence is always written: when
    /// control was granted and ended shows in its times and order.
    pub(crate) fn is_new(&mut self, now: Instant, entry: &Entry) -> bool {
        if entry.is_evidence() {
            return true;
        }
        let timeless = Entry {
            time: SystemTime::UNIX_EPOCH,
            times: 1,
            ..entry.clone()
        };
        if let Some(recent) = self.recent.iter_mut().find(|it| it.entry == timeless) {
            recent.again += entry.times;
            recent.last = entry.time;
            return false;
        }
        if self.recent.len() < MOST {
            self.recent.push(Recent {
                entry: timeless,
                again: 0,
                last: entry.time,
                due: now + PERIOD,
            });
            return true;
        }
        let is_counted = entry.result == Outcome::Refused;
        self.others += entry.times * u64::from(is_counted);
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
            time: it.last,
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
        let counted = repeats.take(repeats.due());
        assert_eq!(counted.len(), 1);
        assert_eq!(counted[0].times, 1000 - MOST as u64);
        assert!(repeats.is_new(start + PERIOD, &entry("1000")));
    }

    #[test]
    fn evidence_is_written_each_time_and_what_everybody_may_is_counted() {
        let (now, mut repeats) = (Instant::now(), Repeats::default());
        for what in ["control granted", "control ended"].repeat(2) {
            assert!(repeats.is_new(now, &Entry::new("console", what, Outcome::Allowed)));
        }
        let release = Entry {
            is_free: true,
            ..Entry::new("console", "control released", Outcome::Allowed).times(3)
        };
        assert!(repeats.is_new(now, &release) && !repeats.is_new(now, &release));
        assert_eq!(repeats.take(None)[0].times, 3, "those of the second entry");
    }
}
