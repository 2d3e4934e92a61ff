//! Large messages without acknowledgement: their fragments leave no faster than receivers can take
//! them, because nobody would send again what overflows a receive buffer.
//!
//! Each other end has a token bucket. What is counted is not octets but what a datagram occupies
//! in a Linux receive buffer, which is a good deal more: the kernel charges the whole allocation,
//! a power of two, and its own bookkeeping.

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::large::Cut;
use super::{Config, LinkId, To};
use crate::address::JausId;
use crate::peer::Intake;
use crate::wire::{Flags, Frame, Priority, Version};

/// Other ends whose buckets are remembered before the full ones are forgotten.
const MOST_LANES: usize = 64;
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
    pub(super) fn within(self, intake: Intake) -> Self {
        Self {
            burst: self.burst.min(intake.burst),
            rate: self.rate.min(intake.rate),
        }
    }

    /// How long it takes to make room for so much.
    fn time_for(&self, octets: u64) -> Duration {
        Duration::from_nanos(octets.saturating_mul(1_000_000_000) / self.rate.max(1))
    }
}

/// What a datagram occupies in the receive buffer.
const fn cost(datagram: usize) -> u64 {
    ((datagram + ENVELOPE).next_power_of_two() + DESCRIPTION) as u64
}

/// The other end of a link.
pub(super) type Lane = (LinkId, To);

/// A large message of which fragments are to be sent.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    pub(super) source: JausId,
    pub(super) destination: JausId,
    pub(super) version: Version,
    /// All but the data control.
    pub(super) flags: Flags,
    pub(super) payload: Bytes,
    pub(super) cut: Cut,
    /// The serial number of the first fragment.
    pub(super) first: u64,
    /// How fast its fragments may leave; `None` for as fast as the link takes them.
    pub(super) pacing: Option<Pacing>,
}

impl Stretch {
    fn frame(&self, index: usize) -> Frame {
        let (data, payload) = self.cut.fragment(&self.payload, index);
        Frame {
            version: self.version,
            flags: self.flags.with_data(data),
            sequence: (self.first + index as u64) as u16,
            ..Frame::new(self.source, self.destination, payload)
        }
    }
}

/// Whether there is something to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Nothing,
    /// Listed as ready, at a priority.
    Ready(usize),
    /// Full for some time.
    Blocked,
}

#[derive(Debug)]
struct Bucket {
    /// By priority: messages, each with the next fragment to send.
    waiting: [VecDeque<(Stretch, usize)>; Priority::ALL.len()],
    /// What had been put in by `counted` and not emptied; may be more than the burst by one
    /// datagram.
    filled: u64,
    counted: Instant,
    state: State,
}

impl Bucket {
    fn level(&self) -> Option<usize> {
        (0..self.waiting.len())
            .rev()
            .find(|&level| !self.waiting[level].is_empty())
    }

    fn empty_by(&mut self, now: Instant, pacing: &Pacing) {
        let passed = now.saturating_duration_since(self.counted);
        let emptied = passed.as_nanos() * u128::from(pacing.rate) / 1_000_000_000;
        self.filled = self
            .filled
            .saturating_sub(emptied.try_into().unwrap_or(u64::MAX));
        self.counted = self.counted.max(now);
    }
}

/// The buckets of all other ends.
#[derive(Debug)]
pub(super) struct Pacer {
    buckets: HashMap<Lane, Bucket>,
    /// Those that may have something to send, by its priority.
    ready: [VecDeque<Lane>; Priority::ALL.len()],
    /// Those that are full, by the time when they are not any more.
    blocked: BTreeSet<(Instant, Lane)>,
    octets: usize,
    limit: usize,
    pacing: Option<Pacing>,
}

impl Pacer {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            buckets: HashMap::new(),
            ready: Default::default(),
            blocked: BTreeSet::new(),
            octets: 0,
            limit: config.max_paced,
            pacing: config.pacing,
        }
    }

    /// How many other ends are remembered.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.buckets.len()
    }

    /// Whether a message of that length fits; a single one always does.
    pub(super) fn has_room(&self, length: usize) -> bool {
        self.octets == 0 || self.octets + length <= self.limit
    }

    /// Takes in a message for one other end.
    pub(super) fn push(&mut self, now: Instant, lane: Lane, stretch: Stretch) {
        if self.buckets.len() >= MOST_LANES {
            self.forget_empty(now);
        }
        let bucket = self.buckets.entry(lane).or_insert_with(|| Bucket {
            waiting: Default::default(),
            filled: 0,
            counted: now,
            state: State::Nothing,
        });
        self.octets += stretch.payload.len();
        let level = usize::from(stretch.flags.priority().bits());
        bucket.waiting[level].push_back((stretch, 0));
        match bucket.state {
            State::Nothing => self.list(lane),
            State::Ready(at) if at < level => {
                self.ready[at].retain(|ready| *ready != lane);
                self.list(lane);
            }
            State::Ready(_) | State::Blocked => {}
        }
    }

    fn forget_empty(&mut self, now: Instant) {
        for bucket in self.buckets.values_mut() {
            match &self.pacing {
                Some(pacing) => bucket.empty_by(now, pacing),
                None => bucket.filled = 0,
            }
        }
        self.buckets
            .retain(|_, bucket| bucket.state != State::Nothing || bucket.filled > 0);
    }

    /// The next fragment of that priority that may leave, and whereto.
    pub(super) fn take(&mut self, now: Instant, priority: Priority) -> Option<(Lane, Frame)> {
        let level = usize::from(priority.bits());
        loop {
            let lane = *self.ready[level].front()?;
            let Some(bucket) = self.buckets.get_mut(&lane) else {
                self.ready[level].pop_front();
                continue;
            };
            if bucket.level() != Some(level) {
                self.ready[level].pop_front();
                self.list(lane);
                continue;
            }
            let next = bucket.waiting[level].front();
            if let Some(pacing) = next.and_then(|(stretch, _)| stretch.pacing) {
                bucket.empty_by(now, &pacing);
                if let Some(excess) = bucket.filled.checked_sub(pacing.burst as u64) {
                    // Not for each datagram: timers are coarse.
                    let wait = pacing.time_for(excess + pacing.burst as u64 / 4);
                    bucket.state = State::Blocked;
                    self.ready[level].pop_front();
                    self.blocked.insert((now + wait, lane));
                    continue;
                }
            }
            return self.advance(lane, level);
        }
    }

    fn advance(&mut self, lane: Lane, level: usize) -> Option<(Lane, Frame)> {
        let bucket = self.buckets.get_mut(&lane)?;
        let (stretch, next) = bucket.waiting[level].front_mut()?;
        let frame = stretch.frame(*next);
        bucket.filled += cost(frame.payload.len());
        *next += 1;
        if *next == stretch.cut.count() {
            self.octets -= stretch.payload.len();
            bucket.waiting[level].pop_front();
        }
        Some((lane, frame))
    }

    /// Puts a bucket into the list that it belongs to.
    fn list(&mut self, lane: Lane) {
        if let Some(bucket) = self.buckets.get_mut(&lane) {
            bucket.state = match bucket.level() {
                Some(level) => {
                    self.ready[level].push_back(lane);
                    State::Ready(level)
                }
                None => State::Nothing,
            };
        }
    }

    /// Lets those go on for which there is room again.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        while let Some(&(at, lane)) = self.blocked.first()
            && at <= now
        {
            self.blocked.pop_first();
            self.list(lane);
        }
    }

    /// When some bucket has room again.
    pub(super) fn next_deadline(&self) -> Option<Instant> {
        self.blocked.first().map(|&(at, _)| at)
    }

    /// Forgets what waits for a link that has gone.
    pub(super) fn forget_link(&mut self, link: LinkId) {
        self.blocked.retain(|(_, lane)| lane.0 != link);
        for level in &mut self.ready {
            level.retain(|lane| lane.0 != link);
        }
        let octets = &mut self.octets;
        self.buckets.retain(|lane, bucket| {
            let stays = lane.0 != link;
            if !stays {
                let waiting = bucket.waiting.iter().flatten();
                *octets -= waiting.map(|(s, _)| s.payload.len()).sum::<usize>();
            }
            stays
        });
    }
}
