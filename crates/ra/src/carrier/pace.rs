//! Paces the parts of large messages: a peer's receive buffer holds only a few (OpenJAUS keeps the
//! system default, some 25 full datagrams), and a lost part costs the whole message, as there is no
//! retransmission.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::Transmit;

/// Queued parts.
#[derive(Debug, Default)]
pub(super) struct Pace {
    waiting: VecDeque<Transmit>,
    /// Time of the next burst, once set.
    next: Option<Instant>,
}

impl Pace {
    /// Parts per burst.
    pub(super) const BURST: usize = 8;
    /// Interval between bursts; together 8 MB per second.
    const PAUSE: Duration = Duration::from_millis(4);

    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }

    pub(super) fn push(&mut self, part: Transmit) {
        self.waiting.push_back(part);
    }

    /// Schedules the next burst, unless it is scheduled.
    pub(super) fn start(&mut self, now: Instant) {
        if !self.waiting.is_empty() {
            self.next.get_or_insert(now + Self::PAUSE);
        }
    }

    /// The parts of a due burst.
    pub(super) fn take_due(&mut self, now: Instant) -> Vec<Transmit> {
        if self.next.is_none_or(|next| next > now) {
            return Vec::new();
        }
        self.next = None;
        let burst = self.waiting.len().min(Self::BURST);
        let due = self.waiting.drain(..burst).collect();
        self.start(now);
        due
    }

    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        self.next
    }
}
