//! What is worth a line in the log: each matter once, until it is over.

use std::collections::BTreeSet;
use std::time::Instant;

use jaus_limits::{Bucket, Rate};

/// Matters that were logged.
///
/// Anyone on the zenoh network may invent any number of them, so they have a rate, and the table has a
/// bound. What exceeds the rate is logged later, if it happens again then.
#[derive(Debug)]
pub(crate) struct Notices<M> {
    logged: BTreeSet<M>,
    bucket: Bucket,
}

/// The most lines.
const RATE: Rate = Rate::new(1, 32);
/// The most matters that are remembered. Then all are forgotten, and may be logged once more.
const MOST: usize = 1024;

impl<M> Default for Notices<M> {
    fn default() -> Self {
        Self {
            logged: BTreeSet::new(),
            bucket: Bucket::default(),
        }
    }
}

impl<M: Ord> Notices<M> {
    /// Whether to log this matter now.
    pub(crate) fn is_due(&mut self, now: Instant, matter: M) -> bool {
        if self.logged.contains(&matter) || self.bucket.take(now, RATE, 1).is_err() {
            return false;
        }
        if self.logged.len() >= MOST {
            self.logged.clear();
        }
        self.logged.insert(matter)
    }

    /// These matters are over. When they begin again, they are logged again.
    pub(crate) fn end(&mut self, is_over: impl Fn(&M) -> bool) {
        self.logged.retain(|matter| !is_over(matter));
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "the tests start at an arbitrary instant"
)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_matter_is_logged_once_until_it_is_over() {
        let (now, mut notices) = (Instant::now(), Notices::default());
        assert!(notices.is_due(now, 1));
        assert!(!notices.is_due(now + Duration::from_secs(3600), 1));
        assert!(notices.is_due(now, 2));
        notices.end(|matter| *matter == 1);
        assert!(notices.is_due(now, 1));
        assert!(!notices.is_due(now, 2));
    }

    #[test]
    fn inventing_matters_neither_floods_the_log_nor_silences_it_for_good() {
        let (now, mut notices) = (Instant::now(), Notices::default());
        let due = (0..10_000).filter(|it| notices.is_due(now, *it)).count();
        assert_eq!(due, 32);
        let later = now + Duration::from_secs(1);
        assert!(notices.is_due(later, 10_000));
        for number in 0..2 * MOST {
            let at = later + Duration::from_secs(number as u64);
            notices.is_due(at, 20_000 + number);
            assert!(notices.logged.len() <= MOST);
        }
    }
}
