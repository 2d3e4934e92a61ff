//! A configured address, and when to dial it.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use jaus::endpoint::SessionId;

/// The pause after the first failure; it doubles with each further one.
const FIRST_PAUSE: Duration = Duration::from_millis(250);
/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_secs(8);

#[derive(Debug)]
pub(super) struct Dial {
    address: SocketAddr,
    /// The attempt, or the session with the peer at the address.
    pub(super) session: Option<SessionId>,
    pause: Duration,
    /// When the next attempt is due; `None` at once.
    due: Option<Instant>,
}

impl Dial {
    pub(super) const fn new(address: SocketAddr) -> Self {
        Self {
            address,
            session: None,
            pause: FIRST_PAUSE,
            due: None,
        }
    }

    /// When the next attempt is due, unless there is a session or this is the first attempt.
    pub(super) const fn due(&self) -> Option<Instant> {
        match self.session {
            Some(_) => None,
            None => self.due,
        }
    }

    /// The address, if an attempt is due.
    pub(super) fn start(&mut self, now: Instant) -> Option<SocketAddr> {
        if self.session.is_some() || self.due.is_some_and(|due| due > now) {
            return None;
        }
        self.due = None;
        Some(self.address)
    }

    /// Makes the next attempt due at once.
    pub(super) const fn hasten(&mut self) {
        self.due = None;
    }

    pub(super) const fn established(&mut self, session: SessionId) {
        self.session = Some(session);
        self.pause = FIRST_PAUSE;
    }

    /// Handles the end of the session or attempt. After a session that `was_good`, the next attempt
    /// follows soon.
    pub(super) fn lost(&mut self, now: Instant, was_good: bool) {
        self.session = None;
        if was_good {
            self.pause = FIRST_PAUSE;
        }
        self.due = Some(now + self.pause);
        self.pause = (2 * self.pause).min(LONGEST_PAUSE);
    }
}
