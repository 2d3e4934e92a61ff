//! Dials a configured peer: reconnects with growing pauses.

use std::fmt;
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use bytes::Bytes;
use tokio::net::TcpStream;

use super::settings::{BACKLOG, CONNECT_TIMEOUT, FIRST_PAUSE, LONGEST_PAUSE};
use crate::link::backlog::Backlog;
use crate::wire::Priority;

type Connecting = Pin<Box<dyn Future<Output = io::Result<TcpStream>> + Send>>;

/// A peer to connect to.
#[derive(Debug)]
pub(super) struct Dial {
    pub(super) address: SocketAddr,
    state: State,
    failures: u32,
    /// Messages for the peer during an attempt.
    pub(super) waiting: Backlog<(Priority, Bytes)>,
}

enum State {
    /// There is a connection.
    Connected,
    Connecting {
        attempt: Connecting,
        until: Instant,
    },
    /// No attempt before this time; `None` means at once.
    Pausing(Option<Instant>),
}

impl fmt::Debug for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Connected => f.write_str("Connected"),
            Self::Connecting { until, .. } => write!(f, "Connecting until {until:?}"),
            Self::Pausing(until) => write!(f, "Pausing until {until:?}"),
        }
    }
}

impl Dial {
    pub(super) fn new(address: SocketAddr) -> Self {
        Self {
            address,
            state: State::Pausing(None),
            failures: 0,
            waiting: Backlog::new(BACKLOG),
        }
    }

    /// Whether there is a connection.
    pub(super) const fn is_connected(&self) -> bool {
        matches!(self.state, State::Connected)
    }

    /// Queues a message for the connection, before the first attempt and during each one. In the
    /// pauses it would wait too long to be useful. Returns how many messages were dropped, this one
    /// or others, or `None` if messages are not queued now.
    pub(super) fn keep(&mut self, priority: Priority, payload: &Bytes) -> Option<u64> {
        let keeps = matches!(self.state, State::Connecting { .. } | State::Pausing(None));
        let waiting = (priority, payload.clone());
        keeps.then(|| self.waiting.push(priority, payload.len(), waiting))
    }

    /// When to poll again if nothing happens before.
    pub(super) const fn deadline(&self) -> Option<Instant> {
        match self.state {
            State::Connected => None,
            State::Connecting { until, .. } => Some(until),
            State::Pausing(until) => until,
        }
    }

    /// A new connection, or the error of a failed attempt.
    pub(super) fn poll(
        &mut self,
        cx: &mut Context<'_>,
        now: Instant,
    ) -> Poll<io::Result<TcpStream>> {
        loop {
            match &mut self.state {
                State::Connected => return Poll::Pending,
                State::Pausing(Some(until)) if now < *until => return Poll::Pending,
                State::Pausing(_) => {
                    self.state = State::Connecting {
                        attempt: Box::pin(TcpStream::connect(self.address)),
                        until: now + CONNECT_TIMEOUT,
                    };
                }
                State::Connecting { attempt, until } => {
                    let outcome = match attempt.as_mut().poll(cx) {
                        Poll::Ready(outcome) => outcome,
                        Poll::Pending if now >= *until => Err(io::ErrorKind::TimedOut.into()),
                        Poll::Pending => return Poll::Pending,
                    };
                    match outcome {
                        Ok(_) => self.state = State::Connected,
                        Err(_) => self.pause(now),
                    }
                    return Poll::Ready(outcome);
                }
            }
        }
    }

    /// Handles the loss of the connection; `was_good` if a valid message had arrived on it.
    pub(super) fn lost(&mut self, now: Instant, was_good: bool) {
        if was_good {
            self.failures = 0;
        }
        self.pause(now);
    }

    fn pause(&mut self, now: Instant) {
        self.state = State::Pausing(Some(
            now + pause(self.failures, RandomState::new().hash_one(())),
        ));
        self.failures = self.failures.saturating_add(1);
    }
}

/// The pause after this many earlier failures, ± 25 % at random.
fn pause(failures: u32, chance: u64) -> Duration {
    let doubled = FIRST_PAUSE
        .saturating_mul(1 << failures.min(16))
        .min(LONGEST_PAUSE);
    let permille = 750 + (chance % 501) as u32;
    doubled * permille / 1000
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_to_a_bound_and_differ() {
        let shortest = |failures| pause(failures, 0);
        let longest = |failures| pause(failures, 500);
        assert_eq!(shortest(0), FIRST_PAUSE * 3 / 4);
        assert_eq!(longest(0), FIRST_PAUSE * 5 / 4);
        assert_eq!(shortest(3), FIRST_PAUSE * 6);
        for failures in [10, 100, u32::MAX] {
            assert_eq!(longest(failures), LONGEST_PAUSE * 5 / 4);
        }
    }
}
