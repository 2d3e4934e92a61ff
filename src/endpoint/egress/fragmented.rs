//! Pacing of large messages without acknowledgement: fragments leave no faster than receivers can
//! take them, because a fragment lost to a full receive buffer is not retransmitted.
//!
//! The unit is not payload octets but the space that a datagram occupies in a Linux receive buffer,
//! which is a good deal more: the kernel charges the whole allocation, a power of two, plus its own
//! bookkeeping.

use std::time::{Duration, Instant};

use crate::endpoint::large::Cut;
use crate::endpoint::rate::Bucket;
use crate::peer::Pacing;
use crate::wire::Frame;

/// Headers before a datagram and kernel metadata after it.
const ENVELOPE: usize = 384;
/// The kernel's descriptor of a datagram.
const DESCRIPTION: usize = 256;

impl Default for Pacing {
    /// The burst fits Linux's default receive buffer of 212992 octets and leaves a tenth to other
    /// senders. A datagram of 1440 octets occupies 2304 of it, so a message of 100 KiB, in 72
    /// fragments of the default length, occupies 165888. The rate is that of a gigabit link: 125 MB
    /// per second in such datagrams.
    fn default() -> Self {
        Self {
            burst: 192_000,
            rate: 200_000_000,
        }
    }
}

impl Pacing {
    /// The pacing for a receiver with less capacity.
    pub(in crate::endpoint) fn within(self, other: Self) -> Self {
        Self {
            burst: self.burst.min(other.burst),
            rate: self.rate.min(other.rate),
        }
    }

    /// Reserves room for one datagram, which may overrun the burst; or returns how long to wait for
    /// room.
    pub(super) fn take(
        self,
        bucket: &mut Bucket,
        now: Instant,
        datagram: usize,
    ) -> Result<(), Duration> {
        let burst = self.time_for(self.burst as u64);
        let excess = bucket.debt(now).saturating_sub(burst);
        if !excess.is_zero() {
            // Not per datagram: timers are coarse.
            return Err(excess + burst / 4);
        }
        bucket.spend(now, self.time_for(occupied(datagram)));
        Ok(())
    }

    /// How long it takes to free this much room.
    fn time_for(self, octets: u64) -> Duration {
        Duration::from_nanos(octets.saturating_mul(1_000_000_000) / self.rate.max(1))
    }
}

/// The space that a datagram occupies in the receive buffer.
const fn occupied(datagram: usize) -> u64 {
    ((datagram + ENVELOPE).next_power_of_two() + DESCRIPTION) as u64
}

/// A large message that is being sent in fragments.
#[derive(Clone, Debug)]
pub(in crate::endpoint) struct FragmentedSend {
    /// The whole message, without data control.
    pub(in crate::endpoint) whole: Frame,
    pub(in crate::endpoint) cut: Cut,
    /// The serial number of the first fragment.
    pub(in crate::endpoint) first: u64,
    /// The next fragment.
    pub(in crate::endpoint) next: usize,
    /// The pacing of its fragments; `None` sends as fast as the link accepts them.
    pub(in crate::endpoint) pacing: Option<Pacing>,
}

impl FragmentedSend {
    /// The next fragment.
    pub(super) fn frame(&self) -> Frame {
        self.cut.frame(&self.whole, self.first, self.next)
    }

    /// Marks the next fragment as sent; returns whether it was the last.
    pub(super) fn advance(&mut self) -> bool {
        self.next += 1;
        self.next == self.cut.count()
    }

    /// The length of the next fragment, in octets.
    pub(super) fn next_len(&self) -> usize {
        self.cut.fragment_len(self.next)
    }

    /// The octets of the fragments that are left.
    pub(super) fn remaining(&self) -> usize {
        (self.next..self.cut.count())
            .map(|index| self.cut.fragment_len(index))
            .sum()
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    #[test]
    fn a_datagram_occupies_a_power_of_two_and_its_description() {
        assert_eq!([0, 128, 129, 1440].map(occupied), [768, 768, 1280, 2304]);
    }

    #[test]
    fn datagrams_leave_up_to_the_burst_and_then_wait_for_a_quarter_of_it() {
        // A datagram of 1440 octets takes 1 ms, and the burst 2 ms.
        let pacing = Pacing {
            burst: 4608,
            rate: 2_304_000,
        };
        let (mut bucket, start) = (Bucket::default(), Instant::now());
        let ms = Duration::from_millis(1);
        let mut take = |after| pacing.take(&mut bucket, start + after, 1440);
        for _datagram in 0..3 {
            assert_eq!(take(Duration::ZERO), Ok(()));
        }
        assert_eq!(take(Duration::ZERO), Err(ms + ms / 2));
        assert_eq!(take(ms), Ok(()));
        assert_eq!(take(ms), Err(ms + ms / 2));
    }

    #[test]
    fn the_slower_of_two_pacings_counts() {
        let pacing = |burst, rate| Pacing { burst, rate };
        let both = pacing(1, 20).within(pacing(2, 10));
        assert_eq!((both.burst, both.rate), (1, 10));
    }
}
