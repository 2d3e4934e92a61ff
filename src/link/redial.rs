//! Reopens a lost connection or device, with growing pauses between attempts.

use std::hash::{BuildHasher, RandomState};
use std::io;
use std::ops::RangeInclusive;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use tokio::task::JoinSet;

/// The reconnection of one connection or device: its schedule and the current attempt.
#[derive(Debug)]
pub(super) struct Redial<T> {
    /// The timeout of an attempt; [`Duration::MAX`] for none.
    timeout: Duration,
    /// The first and the longest pause. The pause doubles with each failure, ± 25 % at random, so
    /// that many nodes do not reconnect to a restarted peer at the same time.
    pauses: RangeInclusive<Duration>,
    failures: u32,
    /// Whether the connection or device is open.
    is_up: bool,
    /// The task of the current attempt, if any. Dropping this ends it.
    attempt: JoinSet<io::Result<T>>,
    /// When the attempt or the pause ends.
    until: Option<Instant>,
}

impl<T: Send + 'static> Redial<T> {
    /// For a connection or device that is open or not. If not, the first attempt is due at once.
    pub(super) fn new(is_up: bool, timeout: Duration, pauses: RangeInclusive<Duration>) -> Self {
        Self {
            timeout,
            pauses,
            failures: 0,
            is_up,
            attempt: JoinSet::new(),
            until: None,
        }
    }

    pub(super) const fn is_up(&self) -> bool {
        self.is_up
    }

    /// Whether it pauses after a failure or a loss.
    pub(super) fn is_pausing(&self) -> bool {
        self.until.is_some() && self.attempt.is_empty()
    }

    /// When to poll even if nothing happens.
    pub(super) const fn deadline(&self) -> Option<Instant> {
        self.until
    }

    /// Polls the current attempt, and starts one with `attempt` when due. Ready with the opened
    /// connection or device, or with the error.
    pub(super) fn poll(
        &mut self,
        cx: &mut Context<'_>,
        now: Instant,
        attempt: impl FnOnce(&mut JoinSet<io::Result<T>>),
    ) -> Poll<io::Result<T>> {
        let is_over = |until| until <= now;
        if !self.is_up && self.attempt.is_empty() && self.until.is_none_or(is_over) {
            attempt(&mut self.attempt);
            self.until = now.checked_add(self.timeout);
        }
        let outcome = match self.attempt.poll_join_next(cx) {
            // An attempt that the runtime has cancelled counts as failed.
            Poll::Ready(Some(outcome)) => outcome.map_err(io::Error::from).flatten(),
            Poll::Pending if self.until.is_some_and(is_over) => Err(io::ErrorKind::TimedOut.into()),
            _ => return Poll::Pending,
        };
        match outcome {
            Ok(_) => (self.is_up, self.until) = (true, None),
            Err(_) => self.pause(now),
        }
        Poll::Ready(outcome)
    }

    /// Handles a loss. `was_good` means that the connection had worked, which resets the pause.
    pub(super) fn lost(&mut self, now: Instant, was_good: bool) {
        if was_good {
            self.failures = 0;
        }
        self.pause(now);
    }

    fn pause(&mut self, now: Instant) {
        let pause = self.next_pause(RandomState::new().hash_one(()));
        self.is_up = false;
        self.attempt = JoinSet::new();
        self.until = Some(now + pause);
        self.failures = self.failures.saturating_add(1);
    }

    fn next_pause(&self, chance: u64) -> Duration {
        let doubled = self
            .pauses
            .start()
            .saturating_mul(1 << self.failures.min(16));
        let permille = 750 + (chance % 501) as u32;
        doubled.min(*self.pauses.end()) * permille / 1000
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_to_a_bound_and_differ() {
        let (first, longest) = (Duration::from_millis(250), Duration::from_secs(15));
        let pause = |failures, chance| {
            let redial = Redial::<()> {
                failures,
                ..Redial::new(false, Duration::MAX, first..=longest)
            };
            redial.next_pause(chance)
        };
        assert_eq!(pause(0, 0), first * 3 / 4);
        assert_eq!(pause(0, 500), first * 5 / 4);
        assert_eq!(pause(3, 0), first * 6);
        for failures in [10, 100, u32::MAX] {
            assert_eq!(pause(failures, 500), longest * 5 / 4);
        }
    }
}
