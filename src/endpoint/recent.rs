//! A bounded memory of messages seen lately, to tell duplicates and our own echoes.

use std::collections::hash_map::RandomState;
use std::collections::{HashMap, VecDeque};
use std::hash::BuildHasher;
use std::time::{Duration, Instant};

use crate::address::JausId;
use crate::wire::Frame;

/// What makes two frames the same: addresses, number and content.
///
/// The content is represented by a keyed hash, so that nobody can make two messages look alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Fingerprint {
    source: JausId,
    destination: JausId,
    sequence: u16,
    content: u64,
}

/// Fingerprints with the time at which they were put in.
#[derive(Debug)]
pub(super) struct Recent {
    times: HashMap<Fingerprint, Instant>,
    order: VecDeque<(Instant, Fingerprint)>,
    limit: usize,
    longest: Duration,
    hasher: RandomState,
}

impl Recent {
    /// A memory of at most `limit` frames for at most `longest`.
    pub(super) fn new(limit: usize, longest: Duration) -> Self {
        Self {
            times: HashMap::new(),
            order: VecDeque::new(),
            limit,
            longest,
            hasher: RandomState::new(),
        }
    }

    /// What tells `frame` from others.
    pub(super) fn fingerprint(&self, frame: &Frame) -> Fingerprint {
        Fingerprint {
            source: frame.source,
            destination: frame.destination,
            sequence: frame.sequence,
            content: self
                .hasher
                .hash_one((frame.flags.data() as u8, &frame.payload)),
        }
    }

    /// Whether it was put in less than `window` ago.
    pub(super) fn contains(&self, now: Instant, seen: &Fingerprint, window: Duration) -> bool {
        self.times
            .get(seen)
            .is_some_and(|&time| now.saturating_duration_since(time) < window)
    }

    /// Remembers it from now on.
    pub(super) fn insert(&mut self, now: Instant, seen: Fingerprint) {
        self.forget_old(now);
        while self.order.len() >= self.limit.max(1) {
            self.forget_oldest();
        }
        self.times.insert(seen, now);
        self.order.push_back((now, seen));
    }

    fn forget_old(&mut self, now: Instant) {
        while let Some(&(time, _)) = self.order.front()
            && now.saturating_duration_since(time) >= self.longest
        {
            self.forget_oldest();
        }
    }

    fn forget_oldest(&mut self) {
        // The same frame may have been put in again since: then the younger entry keeps it.
        if let Some((time, seen)) = self.order.pop_front()
            && self.times.get(&seen) == Some(&time)
        {
            self.times.remove(&seen);
        }
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    fn frame(sequence: u16, payload: &'static [u8]) -> Frame {
        let payload = Bytes::from_static(payload);
        Frame {
            sequence,
            ..Frame::new(JausId::new(1, 1, 1), JausId::new(2, 1, 1), payload)
        }
    }

    #[test]
    #[expect(
        clippy::disallowed_methods,
        reason = "an arbitrary beginning of virtual time"
    )]
    fn the_memory_is_bounded_in_number_and_time() {
        let start = Instant::now();
        let window = Duration::from_millis(500);
        let mut recent = Recent::new(2, window);
        let seen = [0, 1, 2].map(|sequence| recent.fingerprint(&frame(sequence, b"\x00\x2B\x02")));
        for seen in seen {
            recent.insert(start, seen);
        }
        assert_eq!(
            seen.map(|seen| recent.contains(start, &seen, window)),
            [false, true, true]
        );
        assert!(!recent.contains(start + window, &seen[2], window));
        recent.insert(start + window, seen[0]);
        assert_eq!((recent.times.len(), recent.order.len()), (1, 1));
    }

    #[test]
    #[expect(
        clippy::disallowed_methods,
        reason = "an arbitrary beginning of virtual time"
    )]
    fn what_is_put_in_again_is_remembered_from_then_on() {
        let start = Instant::now();
        let window = Duration::from_millis(500);
        let mut recent = Recent::new(8, window);
        let seen = recent.fingerprint(&frame(7, b"\x02\x22"));
        recent.insert(start, seen);
        recent.insert(start + window / 2, seen);
        recent.insert(start + window, recent.fingerprint(&frame(8, b"\x02\x22")));
        assert!(recent.contains(start + window, &seen, window));
    }

    #[test]
    fn the_content_counts_not_only_the_number() {
        let recent = Recent::new(8, Duration::from_secs(1));
        let fingerprint = |payload| recent.fingerprint(&frame(1, payload));
        assert_ne!(fingerprint(b"\x00\x2B\x02"), fingerprint(b"\x00\x2B\x03"));
        assert_eq!(fingerprint(b"\x00\x2B\x02"), fingerprint(b"\x00\x2B\x02"));
    }
}
