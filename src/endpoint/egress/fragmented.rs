//! Large messages without acknowledgement: their fragments leave no faster than receivers can take
//! them, because nobody would send again what overflows a receive buffer.
//!
//! What is counted is not octets but what a datagram occupies in a Linux receive buffer, which is a
//! good deal more: the kernel charges the whole allocation, a power of two, and its own bookkeeping.

use std::time::{Duration, Instant};

use crate::endpoint::large::Cut;
use crate::endpoint::rate::Bucket;
use crate::peer::Intake;
use crate::wire::{Frame, Priority, Version};

/// Headers in front of a datagram and the kernel's notes behind it.
const ENVELOPE: usize = 384;
/// The kernel's description of a datagram.
const DESCRIPTION: usize = 256;

/// How fast the fragments of unacknowledged large messages may leave towards one other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pacing {
    /// Octets of a receive buffer that may be filled at once.
    pub burst: usize,
    /// Octets of a receive buffer that are taken to be emptied each second.
    pub rate: u64,
}

impl Default for Pacing {
    /// A burst fits Linux's default receive buffer of 212992 octets and leaves a tenth to others:
    /// a datagram of 1440 octets occupies 2304 of it, so a message of 100 KiB, in 72 fragments of
    /// the default length, 165888. The rate is that of a gigabit line, 125 MB a second in such
    /// datagrams.
    fn default() -> Self {
        Self {
            burst: 192_000,
            rate: 200_000_000,
        }
    }
}

impl Pacing {
    /// The same for a receiver that takes less.
    pub(in crate::endpoint) fn within(self, intake: Intake) -> Self {
        Self {
            burst: self.burst.min(intake.burst),
            rate: self.rate.min(intake.rate),
        }
    }

    /// Takes room for one datagram, the last one perhaps beyond the burst; or tells how long to wait
    /// for room.
    pub(super) fn take(
        self,
        bucket: &mut Bucket,
        now: Instant,
        datagram: usize,
    ) -> Result<(), Duration> {
        let burst = self.time_for(self.burst as u64);
        let excess = bucket.debt(now).saturating_sub(burst);
        if !excess.is_zero() {
            // Not for each datagram: timers are coarse.
            return Err(excess + burst / 4);
        }
        bucket.spend(now, self.time_for(occupied(datagram)));
        Ok(())
    }

    /// How long it takes to make room for so much.
    fn time_for(self, octets: u64) -> Duration {
        Duration::from_nanos(octets.saturating_mul(1_000_000_000) / self.rate.max(1))
    }
}

/// What a datagram occupies in the receive buffer.
const fn occupied(datagram: usize) -> u64 {
    ((datagram + ENVELOPE).next_power_of_two() + DESCRIPTION) as u64
}

/// A large message of which fragments are to be sent.
#[derive(Clone, Debug)]
pub(in crate::endpoint) struct FragmentedSend {
    /// All of it, without data control.
    whole: Frame,
    cut: Cut,
    /// The serial number of the first fragment.
    first: u64,
    /// The next fragment.
    next: usize,
    /// How fast its fragments may leave; `None` for as fast as the link takes them.
    pub(super) pacing: Option<Pacing>,
}

impl FragmentedSend {
    pub(in crate::endpoint) fn new(
        whole: &Frame,
        cut: Cut,
        first: u64,
        pacing: Option<Pacing>,
    ) -> Self {
        Self {
            whole: whole.clone(),
            cut,
            first,
            next: 0,
            pacing,
        }
    }

    pub(super) fn priority(&self) -> Priority {
        self.whole.flags.priority()
    }

    /// The next fragment.
    pub(super) fn frame(&self) -> Frame {
        let (data, payload) = self.cut.fragment(&self.whole.payload, self.next);
        Frame {
            flags: self.whole.flags.with_data(data),
            sequence: (self.first + self.next as u64) as u16,
            payload,
            ..self.whole.clone()
        }
    }

    /// The next fragment is on its way; whether it was the last.
    pub(super) fn advance(&mut self) -> bool {
        self.next += 1;
        self.next == self.cut.count()
    }

    /// Whether the next fragment has that header and no more octets.
    pub(super) fn continues(&self, (version, octets): (Version, usize)) -> bool {
        self.whole.version == version && self.next_len() <= octets
    }

    /// The octets of the next fragment.
    pub(super) fn next_len(&self) -> usize {
        self.cut.fragment_len(self.next)
    }

    /// How many fragments wait.
    pub(super) fn fragments(&self) -> usize {
        self.cut.count() - self.next
    }

    /// The octets of the fragments that wait.
    pub(super) fn remaining(&self) -> usize {
        (self.next..self.cut.count())
            .map(|index| self.cut.fragment_len(index))
            .sum()
    }
}
