//! The parts of large messages, which are sent a few at a time: a peer's receive buffer holds no more
//! (OpenJAUS leaves it as the system has it, which is some 25 full datagrams), and what is lost there
//! takes the whole message along, for nobody asks for it again.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::Transmit;

/// Parts that wait for their turn.
#[derive(Debug, Default)]
pub(super) struct Pace {
    waiting: VecDeque<Transmit>,
    /// When the next few may be sent, once that was settled.
    next: Option<Instant>,
}

impl Pace {
    /// How many are sent at once.
    pub(super) const BURST: usize = 8;
    /// Between two bursts; together 8 MB in a second.
    const PAUSE: Duration = Duration::from_millis(4);

    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }

    pub(super) fn push(&mut self, part: Transmit) {
        self.waiting.push_back(part);
    }

    /// Settles when those that wait are sent, unless that is settled.
    pub(super) fn start(&mut self, now: Instant) {
        if !self.waiting.is_empty() {
            self.next.get_or_insert(now + Self::PAUSE);
        }
    }

    /// Those whose turn it is.
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
