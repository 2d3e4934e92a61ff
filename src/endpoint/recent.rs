//! A bounded memory of recent messages, to detect duplicates, loops and our own echoes.
//!
//! Each entry belongs to a [class](Class) with a bound of its own. Messages of strangers therefore
//! cannot push out those of peers that we talk to, and a stream of unrepeated messages cannot push
//! out those that will be retransmitted.

use std::collections::{HashMap, VecDeque};
use std::hash::{BuildHasher, BuildHasherDefault, Hasher, RandomState};
use std::time::{Duration, Instant};

use super::Path;
use crate::wire::Frame;

/// Identifies a frame: addresses, sequence number and content in one keyed hash, so that no sender
/// can make two messages collide. At 64 bits, two of the thousands in memory collide by chance once
/// in many years.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Fingerprint(u64);

impl Fingerprint {
    /// The fingerprint within the given round of the sender's sequence numbers: a fast sender
    /// reuses a number within seconds, possibly with the same content.
    pub(super) fn in_round(self, round: u16) -> Self {
        Self(self.0 ^ u64::from(round).wrapping_mul(0x9E37_79B9_7F4A_7C15))
    }
}

/// Whether a message is a stranger's, and whether its sender may retransmit it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Class {
    /// Whether the sender is a stranger; see [`Peers`](super::peers::Peers).
    pub(super) stranger: bool,
    /// Whether it requests an acknowledgement, and so may be retransmitted for some time.
    pub(super) repeats: bool,
}

impl Class {
    const COUNT: usize = 4;

    const fn index(self) -> usize {
        self.stranger as usize + 2 * self.repeats as usize
    }
}

/// When a frame was recorded, on which path it first arrived, and how its repetitions were
/// forwarded since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sighting {
    pub(super) time: Instant,
    /// A keyed hash of the path.
    pub(super) way: u64,
    /// When it was last forwarded, if this endpoint forwards.
    pub(super) forwarded: Instant,
    /// How many repetitions were forwarded.
    pub(super) repetitions: u8,
}

impl Sighting {
    /// The first sighting of a frame.
    pub(super) fn new(time: Instant, way: u64) -> Self {
        Self {
            time,
            way,
            forwarded: time,
            repetitions: 0,
        }
    }
}

/// A hasher for keys that are keyed hashes already: each received message is looked up.
#[derive(Clone, Copy, Debug, Default)]
struct AlreadyHashed(u64);

impl Hasher for AlreadyHashed {
    /// Not called: a fingerprint hashes as one `u64`.
    fn write(&mut self, _: &[u8]) {}

    fn write_u64(&mut self, hash: u64) {
        self.0 = hash;
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// The recent frames.
#[derive(Debug)]
pub(super) struct Recent {
    sightings: HashMap<Fingerprint, Sighting, BuildHasherDefault<AlreadyHashed>>,
    order: [VecDeque<(Instant, Fingerprint)>; Class::COUNT],
    limit: usize,
    longest: Duration,
    keys: RandomState,
}

impl Recent {
    /// Remembers frames for at most `longest`: at most `limit` of each class, a quarter of that for
    /// strangers. Memories with the same `keys` produce the same fingerprints.
    pub(super) fn new(limit: usize, longest: Duration, keys: RandomState) -> Self {
        Self {
            sightings: HashMap::default(),
            order: Default::default(),
            limit: limit.max(1),
            longest,
            keys,
        }
    }

    /// The fingerprint of `frame`.
    pub(super) fn fingerprint(&self, frame: &Frame) -> Fingerprint {
        let answer = frame.flags.acknowledgement().is_answer();
        let head = u128::from(frame.source.to_u32())
            | u128::from(frame.destination.to_u32()) << 32
            | u128::from(frame.sequence) << 64
            | u128::from(frame.flags.data() as u8) << 80
            | u128::from(answer) << 88;
        let mut hasher = self.keys.build_hasher();
        hasher.write_u128(head);
        hasher.write(&frame.payload);
        Fingerprint(hasher.finish())
    }

    /// The hash of a path; `None` if paths do not matter.
    pub(super) fn way(&self, path: Option<Path>) -> u64 {
        path.map_or(0, |path| self.keys.hash_one(path))
    }

    /// The last sighting of a frame, if remembered.
    pub(super) fn sighting(&self, seen: Fingerprint) -> Option<Sighting> {
        self.sightings.get(&seen).copied()
    }

    /// Whether the frame was recorded less than `window` ago.
    pub(super) fn contains(&self, now: Instant, seen: Fingerprint, window: Duration) -> bool {
        self.sighting(seen)
            .is_some_and(|sighting| now.saturating_duration_since(sighting.time) < window)
    }

    /// Records a frame of our own.
    pub(super) fn insert_own(&mut self, now: Instant, frame: &Frame) {
        let seen = self.fingerprint(frame);
        self.insert(seen, Sighting::new(now, 0), Class::default());
    }

    /// Records a frame.
    pub(super) fn insert(&mut self, seen: Fingerprint, sighting: Sighting, class: Class) {
        let now = sighting.time;
        let limit = if class.stranger {
            self.limit.div_ceil(4)
        } else {
            self.limit
        };
        let class = class.index();
        while let Some(&(time, _)) = self.order[class].front()
            && now.saturating_duration_since(time) >= self.longest
        {
            self.forget_oldest(class);
        }
        while self.order[class].len() >= limit {
            self.forget_oldest(class);
        }
        self.sightings.insert(seen, sighting);
        self.order[class].push_back((now, seen));
    }

    fn forget_oldest(&mut self, class: usize) {
        // If the frame was recorded again since, a younger entry keeps it.
        if let Some((time, seen)) = self.order[class].pop_front()
            && self.sighting(seen).is_some_and(|it| it.time == time)
        {
            self.sightings.remove(&seen);
        }
    }

    /// How many frames are remembered.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.sightings.len()
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::address::JausId;

    const STRANGER: Class = Class {
        stranger: true,
        repeats: false,
    };

    fn frame(sequence: u16, payload: &'static [u8]) -> Frame {
        let payload = Bytes::from_static(payload);
        Frame {
            sequence,
            ..Frame::new(JausId::new(1, 1, 1), JausId::new(2, 1, 1), payload)
        }
    }

    fn memory(limit: usize, longest: Duration) -> Recent {
        Recent::new(limit, longest, RandomState::new())
    }

    #[test]
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn the_memory_is_bounded_in_number_and_time() {
        let start = Instant::now();
        let window = Duration::from_millis(500);
        let mut recent = memory(2, window);
        let frames = [0, 1, 2].map(|sequence| frame(sequence, b"\x00\x2B\x02"));
        for frame in &frames {
            recent.insert_own(start, frame);
        }
        let seen = frames.each_ref().map(|frame| recent.fingerprint(frame));
        assert_eq!(
            seen.map(|seen| recent.contains(start, seen, window)),
            [false, true, true]
        );
        assert!(!recent.contains(start + window, seen[2], window));
        recent.insert_own(start + window, &frames[0]);
        assert_eq!((recent.len(), recent.order[0].len()), (1, 1));
    }

    #[test]
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn what_is_put_in_again_is_remembered_from_then_on() {
        let start = Instant::now();
        let window = Duration::from_millis(500);
        let mut recent = memory(8, window);
        let again = frame(7, b"\x02\x22");
        recent.insert_own(start, &again);
        recent.insert_own(start + window / 2, &again);
        recent.insert_own(start + window, &frame(8, b"\x02\x22"));
        assert!(recent.contains(start + window, recent.fingerprint(&again), window));
    }

    #[test]
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn strangers_push_out_only_what_strangers_sent() {
        let start = Instant::now();
        let window = Duration::from_millis(500);
        let mut recent = memory(4, window);
        let known = frame(7, b"\x02\x22");
        recent.insert_own(start, &known);
        for sequence in 100..200 {
            let seen = recent.fingerprint(&frame(sequence, b"\x02\x22"));
            recent.insert(seen, Sighting::new(start, 0), STRANGER);
        }
        assert!(recent.contains(start, recent.fingerprint(&known), window));
        assert_eq!(recent.len(), 2, "a quarter for strangers");
    }

    #[test]
    fn the_content_counts_not_only_the_number() {
        let recent = memory(8, Duration::from_secs(1));
        let fingerprint = |payload| recent.fingerprint(&frame(1, payload));
        assert_ne!(fingerprint(b"\x00\x2B\x02"), fingerprint(b"\x00\x2B\x03"));
        assert_eq!(fingerprint(b"\x00\x2B\x02"), fingerprint(b"\x00\x2B\x02"));
        let seen = fingerprint(b"\x00\x2B\x02");
        assert_ne!(seen.in_round(1), seen.in_round(2));
    }

    #[test]
    fn what_identifies_a_message_counts_and_nothing_else() {
        use crate::wire::{Acknowledgement, DataControl, Priority};
        let recent = memory(8, Duration::from_secs(1));
        let known = frame(1, b"\x00\x2B\x02");
        let is_another = |change: fn(&mut Frame)| {
            let mut other = known.clone();
            change(&mut other);
            recent.fingerprint(&other) != recent.fingerprint(&known)
        };
        let identifying: [fn(&mut Frame); 5] = [
            |it| it.source = JausId::new(1, 1, 2),
            |it| it.destination = JausId::new(2, 1, 2),
            |it| it.sequence = 2,
            |it| it.flags = it.flags.with_data(DataControl::Last),
            |it| it.flags = it.flags.with_acknowledgement(Acknowledgement::Positive),
        ];
        for (index, change) in identifying.into_iter().enumerate() {
            assert!(is_another(change), "change {index}");
        }
        assert!(!is_another(|it| {
            let flags = it.flags.with_priority(Priority::High);
            it.flags = flags.with_acknowledgement(Acknowledgement::Request);
        }));
    }

    #[test]
    fn each_class_has_a_bound_of_its_own() {
        let classes = [(false, false), (true, false), (false, true), (true, true)]
            .map(|(stranger, repeats)| Class { stranger, repeats });
        assert_eq!(classes.map(Class::index), [0, 1, 2, 3]);
    }

    #[test]
    fn paths_are_told_apart_where_they_matter() {
        let recent = memory(8, Duration::from_secs(1));
        let path = |link| Path {
            link: crate::endpoint::LinkId(link),
            peer: crate::endpoint::Remote::Line,
        };
        assert_ne!(recent.way(Some(path(1))), recent.way(Some(path(2))));
        assert_eq!(recent.way(Some(path(1))), recent.way(Some(path(1))));
        assert_eq!(recent.way(None), recent.way(None));
        assert_ne!(recent.way(Some(path(1))), recent.way(None));
    }
}
