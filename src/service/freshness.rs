//! How old what a client says can be, by the stamps that it echoes.
//!
//! Messages are standard and carry no age, and a network may hold them up: a queue that grows, or somebody who
//! delays datagrams, also those of a secure link. So a component stamps its queries for the
//! [`Incarnation`](super::Incarnation) of its client, and the client echoes the stamps. What arrives after an echo
//! was sent after the query that it answers, and is no older than that query: a bound that needs no clock but one's
//! own, and grows by itself when the way back or forth is held up.
//!
//! Single messages may still be held up while the echoes pass. They are recognised by their sequence numbers, for our
//! own nodes have one counter for all that they send: what is behind an echo is older than that echo.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::order::{MEMORY, Mark, Settled};

/// The stamps sent to a client, and its echoes.
#[derive(Debug)]
pub(super) struct Freshness {
    stamp: u32,
    /// The stamps that were not echoed, oldest first, and when they were sent.
    sent: VecDeque<(u32, Instant)>,
    /// When the stamp was sent that was echoed last.
    echoed: Option<Instant>,
    /// Since when it is asked again and again.
    begun: Option<Instant>,
    /// What setpoints and what other messages must not be behind.
    late: Settled,
    outdated: Settled,
}

impl Default for Freshness {
    fn default() -> Self {
        Self {
            stamp: 0,
            sent: VecDeque::new(),
            echoed: None,
            begun: None,
            late: Settled::after(Self::LATE),
            outdated: Settled::after(MEMORY),
        }
    }
}

impl Freshness {
    /// A setpoint may be so old: a round trip, the interval of queries, and what a lossy network loses of both.
    pub(super) const OLDEST: Duration = Duration::from_secs(1);
    /// A setpoint that was overtaken by so much is late.
    const LATE: Duration = Duration::from_millis(500);
    /// Stamps that are remembered: more than are sent within [`OLDEST`](Self::OLDEST).
    const MOST: usize = 16;

    /// It is asked again and again from now on. Until its first echo is due it gets the benefit of the doubt, because
    /// some clients send a single command as soon as they are in control.
    pub(super) const fn begin(&mut self, now: Instant) {
        self.begun = Some(now);
    }

    /// The stamp of a query that is sent now; never 0.
    pub(super) fn stamp(&mut self, now: Instant) -> u32 {
        self.stamp = self.stamp.checked_add(1).unwrap_or(1);
        self.sent.push_back((self.stamp, now));
        if self.sent.len() > Self::MOST {
            self.sent.pop_front();
        }
        self.stamp
    }

    /// Notes the echo of a stamp, and the number of the message that brought it.
    pub(super) fn note(&mut self, now: Instant, stamp: u32, number: Option<u16>) {
        let Some(at) = self.sent.iter().position(|(sent, _)| *sent == stamp) else {
            return;
        };
        self.echoed = self.sent.drain(..=at).next_back().map(|(_, sent)| sent);
        if let Some(number) = number {
            let mark = Mark { number, at: now };
            self.late.note(mark);
            self.outdated.note(mark);
        }
    }

    /// When it was certainly alive: the time of the query that it has answered last.
    pub(super) const fn last_sign(&self) -> Option<Instant> {
        self.echoed
    }

    /// How old what it says now can be; `None` if it was never asked.
    pub(super) fn age(&self, now: Instant) -> Option<Duration> {
        let since = self.echoed.max(self.begun)?;
        Some(now.saturating_duration_since(since))
    }

    /// Whether what it says now is young enough to move something.
    pub(super) fn is_fresh(&self, now: Instant) -> bool {
        self.age(now).is_none_or(|age| age <= Self::OLDEST)
    }

    /// Whether the setpoint with this number was held up by itself.
    pub(super) fn is_late(&self, number: u16) -> bool {
        self.late.is_behind(number)
    }

    /// Whether the message with this number is older than any retransmission.
    pub(super) fn is_outdated(&self, number: u16) -> bool {
        self.outdated.is_behind(number)
    }
}
