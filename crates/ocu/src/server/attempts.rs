//! Limits on failed logins, for each address and each user.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use jaus_view::places::Source;

use super::bounds::{Buckets, Rate};

/// Failed logins of one address, by password or token.
const BY_SOURCE: Rate = Rate {
    burst: 5,
    period: Duration::from_secs(10),
};
/// Failed logins of one user from all addresses, except the one of the last successful login.
const BY_USER: Rate = Rate {
    burst: 10,
    period: Duration::from_secs(5),
};
/// The most addresses, and the most users, whose failures are remembered.
const REMEMBERED: usize = 1024;

/// Recent failed logins.
#[derive(Debug)]
pub(super) struct Attempts {
    by_source: Buckets<Source>,
    by_user: Buckets<String>,
    /// From where users have logged in last: failures elsewhere do not lock them out there.
    last: HashMap<String, Source>,
}

impl Attempts {
    pub(super) fn new() -> Self {
        Self {
            by_source: Buckets::new(BY_SOURCE, REMEMBERED),
            by_user: Buckets::new(BY_USER, REMEMBERED),
            last: HashMap::new(),
        }
    }

    /// Begins an attempt, which counts as failed until [`succeeded`](Self::succeeded). Refused
    /// attempts return the time until the next one is possible.
    pub(super) fn begin(
        &mut self,
        now: Instant,
        source: Source,
        user: Option<&str>,
    ) -> Result<(), Duration> {
        self.by_source.take(now, &source)?;
        match user.filter(|user| self.last.get(*user) != Some(&source)) {
            Some(user) => self.by_user.take(now, &user.to_owned()),
            None => Ok(()),
        }
    }

    /// The attempt was successful. `user` has been authenticated, so their number is limited.
    pub(super) fn succeeded(&mut self, source: Source, user: Option<&str>) {
        self.by_source.give_back(&source);
        if let Some(user) = user {
            self.by_user.give_back(&user.to_owned());
            self.last.insert(user.to_owned(), source);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(last: u8) -> Source {
        Source::of(([10, 0, 0, last], 9).into())
    }

    #[test]
    fn guesses_of_one_address_are_slowed_and_others_log_in() {
        let now = Instant::now();
        let mut attempts = Attempts::new();
        let allowed = (0..100).filter(|_| attempts.begin(now, source(1), Some("anna")).is_ok());
        assert_eq!(allowed.count(), 5);
        let wait = attempts.begin(now, source(1), Some("ben")).unwrap_err();
        assert_eq!(wait, BY_SOURCE.period);
        assert!(attempts.begin(now, source(2), Some("anna")).is_ok());
        assert!(attempts.begin(now + wait, source(1), Some("ben")).is_ok());
    }

    #[test]
    fn guesses_of_many_addresses_are_slowed_too_and_do_not_lock_the_user_out() {
        let now = Instant::now();
        let mut attempts = Attempts::new();
        attempts.begin(now, source(1), Some("anna")).unwrap();
        attempts.succeeded(source(1), Some("anna"));
        let guesses = (2..250).filter(|it| attempts.begin(now, source(*it), Some("anna")).is_ok());
        assert_eq!(guesses.count(), 10);
        assert!(attempts.begin(now, source(1), Some("anna")).is_ok());
    }

    #[test]
    fn a_login_that_succeeds_is_no_failure() {
        let now = Instant::now();
        let mut attempts = Attempts::new();
        for _ in 0..100 {
            attempts.begin(now, source(1), Some("anna")).unwrap();
            attempts.succeeded(source(1), Some("anna"));
            attempts.begin(now, source(2), None).unwrap();
            attempts.succeeded(source(2), None);
        }
    }
}
