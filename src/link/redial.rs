//! Reopens a lost connection or device, with growing pauses between attempts.

use std::fmt;
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::ops::RangeInclusive;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};

/// An attempt to open a connection or device.
pub(super) type Attempt<T> = Pin<Box<dyn Future<Output = io::Result<T>> + Send>>;

/// The reconnection of one connection or device: its schedule and the current attempt.
#[derive(Debug)]
pub(super) struct Redial<T> {
    /// The timeout of an attempt; [`Duration::MAX`] for none.
    timeout: Duration,
    /// The first and the longest pause. The pause doubles with each failure, ± 25 % at random, so
    /// that many nodes do not reconnect to a restarted peer at the same time.
    pauses: RangeInclusive<Duration>,
    state: State<T>,
    failures: u32,
}

enum State<T> {
    /// The connection or device is open.
    Up,
    Attempting {
        attempt: Attempt<T>,
        until: Option<Instant>,
    },
    /// No attempt before this time; `None` means at once.
    Pausing(Option<Instant>),
}

impl<T> fmt::Debug for State<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Up => f.write_str("Up"),
            Self::Attempting { until, .. } => write!(f, "Attempting until {until:?}"),
            Self::Pausing(until) => write!(f, "Pausing until {until:?}"),
        }
    }
}

impl<T> Redial<T> {
    /// For a closed connection or device. The first attempt is due at once.
    pub(super) const fn new(timeout: Duration, pauses: RangeInclusive<Duration>) -> Self {
        Self {
            timeout,
            pauses,
            state: State::Pausing(None),
            failures: 0,
        }
    }

    /// For an open connection or device.
    #[cfg(feature = "serial")]
    pub(super) fn up(timeout: Duration, pauses: RangeInclusive<Duration>) -> Self {
        Self {
            state: State::Up,
            ..Self::new(timeout, pauses)
        }
    }

    pub(super) const fn is_up(&self) -> bool {
        matches!(self.state, State::Up)
    }

    /// Whether it pauses after a failure or a loss.
    pub(super) const fn is_pausing(&self) -> bool {
        matches!(self.state, State::Pausing(Some(_)))
    }

    /// When to poll even if nothing happens.
    pub(super) const fn deadline(&self) -> Option<Instant> {
        match self.state {
            State::Up => None,
            State::Attempting { until, .. } | State::Pausing(until) => until,
        }
    }

    /// Polls the current attempt, and starts one with `attempt` when due. Ready with the opened
    /// connection or device, or with the error.
    pub(super) fn poll(
        &mut self,
        cx: &mut Context<'_>,
        now: Instant,
        attempt: impl FnOnce() -> Attempt<T>,
    ) -> Poll<io::Result<T>> {
        if let State::Pausing(until) = self.state
            && until.is_none_or(|until| until <= now)
        {
            self.state = State::Attempting {
                attempt: attempt(),
                until: now.checked_add(self.timeout),
            };
        }
        let State::Attempting { attempt, until } = &mut self.state else {
            return Poll::Pending;
        };
        let outcome = match attempt.as_mut().poll(cx) {
            Poll::Pending if until.is_some_and(|until| until <= now) => {
                Err(io::ErrorKind::TimedOut.into())
            }
            outcome => ready!(outcome),
        };
        match outcome {
            Ok(_) => self.state = State::Up,
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
        self.state = State::Pausing(Some(now + pause));
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
                ..Redial::new(Duration::MAX, first..=longest)
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
