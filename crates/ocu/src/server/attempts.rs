//! Limits on failed logins. Wrong guesses delay the guesser: a device from which the user has logged
//! in before, or else an address. Other devices wait no longer than [`SLOWED`].

use std::time::{Duration, Instant};

use jaus_limits::{Buckets, Rate, Source};

use super::devices::DeviceId;

/// Failed logins of one device or of one address: five at once, and one each 10 s.
const BY_GUESSER: Rate = Rate::new(1, 50);
/// Tokens of a guesser for each.
const GUESS: u32 = 10;
/// Failed logins of one user from all addresses together. Beyond them logins from addresses are
/// slowed, not refused: otherwise anyone could lock a user out. Ten at once, and one each 5 s.
const BY_USER: Rate = Rate::new(1, 50);
/// Tokens of a user for each.
const GUESS_OF_USER: u32 = 5;
/// Delay of a login while the user's password is being guessed.
const SLOWED: Duration = Duration::from_secs(1);
/// The most guessers, and the most users, whose failures are remembered.
const REMEMBERED: usize = 1024;

/// Who tries to log in.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Guesser {
    /// A device from which the user has logged in before.
    Device(DeviceId),
    /// Anyone else at this address.
    Address(Source),
}

/// Recent failed logins.
#[derive(Debug)]
pub(super) struct Attempts {
    by_guesser: Buckets<Guesser>,
    by_user: Buckets<String>,
}

impl Attempts {
    pub(super) fn new() -> Self {
        Self {
            by_guesser: Buckets::displacing(BY_GUESSER, REMEMBERED),
            by_user: Buckets::displacing(BY_USER, REMEMBERED),
        }
    }

    /// Begins an attempt, which counts as failed until [`succeeded`](Self::succeeded). Returns the
    /// time by which to delay it.
    ///
    /// # Errors
    /// The time until the guesser's next attempt, if it has failed too often.
    pub(super) fn begin(
        &mut self,
        now: Instant,
        guesser: &Guesser,
        user: &str,
    ) -> Result<Duration, Duration> {
        self.by_guesser.take_many(now, guesser.clone(), GUESS)?;
        match guesser {
            Guesser::Device(_) => Ok(Duration::ZERO),
            Guesser::Address(_) => {
                let user = user.to_owned();
                let is_quiet = self.by_user.take_many(now, user, GUESS_OF_USER);
                Ok(if is_quiet.is_ok() {
                    Duration::ZERO
                } else {
                    SLOWED
                })
            }
        }
    }

    /// The attempt was successful.
    pub(super) fn succeeded(&mut self, guesser: &Guesser, user: &str) {
        self.by_guesser.give_back(guesser, GUESS);
        if matches!(guesser, Guesser::Address(_)) {
            self.by_user.give_back(&user.to_owned(), GUESS_OF_USER);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(last: u8) -> Guesser {
        Guesser::Address(Source::of(([10, 0, 0, last], 9).into()))
    }

    #[test]
    fn guesses_of_one_address_are_refused_beyond_five_and_others_log_in() {
        let now = Instant::now();
        let mut attempts = Attempts::new();
        let allowed = (0..100).filter(|_| attempts.begin(now, &at(1), "anna").is_ok());
        assert_eq!(allowed.count(), 5);
        let wait = attempts.begin(now, &at(1), "ben").unwrap_err();
        assert_eq!(wait, Duration::from_secs(10));
        assert_eq!(attempts.begin(now, &at(2), "anna"), Ok(Duration::ZERO));
        assert!(attempts.begin(now + wait, &at(1), "ben").is_ok());
    }

    #[test]
    fn guesses_of_many_addresses_slow_a_fresh_one_and_refuse_nobody() {
        let now = Instant::now();
        let mut attempts = Attempts::new();
        for guess in 0..200_u8 {
            attempts.begin(now, &at(guess / 5), "anna").unwrap();
        }
        assert_eq!(attempts.begin(now, &at(250), "anna"), Ok(SLOWED));
        assert_eq!(attempts.begin(now, &at(251), "ben"), Ok(Duration::ZERO));
    }

    #[test]
    fn a_known_device_is_not_slowed_by_guesses_elsewhere_nor_at_its_own_address() {
        let now = Instant::now();
        let mut attempts = Attempts::new();
        for guess in 0..250_u8 {
            let _ = attempts.begin(now, &at(guess % 3), "anna");
        }
        let device = Guesser::Device(DeviceId::of("anna", "0123456789abcdef"));
        assert_eq!(attempts.begin(now, &device, "anna"), Ok(Duration::ZERO));
        let rest = (0..100).filter(|_| attempts.begin(now, &device, "anna").is_ok());
        assert_eq!(rest.count(), 4, "a stolen device guesses no faster");
    }

    #[test]
    fn a_login_that_succeeds_is_no_failure() {
        let now = Instant::now();
        let mut attempts = Attempts::new();
        for _ in 0..100 {
            assert_eq!(attempts.begin(now, &at(1), "anna"), Ok(Duration::ZERO));
            attempts.succeeded(&at(1), "anna");
        }
    }
}
