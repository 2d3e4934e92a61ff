//! Putting fragments together. They may come in any order.
//!
//! What is kept of unfinished messages is bounded in octets, per sender and in all, in number and
//! in time.

use std::time::{Duration, Instant};

use bytes::{Bytes, BytesMut};

use crate::address::JausId;
use crate::endpoint::{Config, Counter, Counters};
use crate::wire::{DataControl, Frame, Version, ra};

/// The most runs of fragments that are kept, from all senders.
const MAX_RUNS: usize = 256;

/// What a fragment adds to its message. The older headers name the code with each fragment.
fn part_of_message(frame: &Frame) -> &[u8] {
    match (frame.version, frame.flags.data()) {
        (Version::As5669a, _) | (_, DataControl::First) => &frame.payload,
        (Version::As5669 | Version::Ra, _) => frame.payload.get(ra::CODE_LEN..).unwrap_or_default(),
    }
}

/// Fragments with consecutive sequence numbers, put together.
#[derive(Debug)]
struct Run {
    source: JausId,
    destination: JausId,
    first: u16,
    last: u16,
    /// Whether it begins with the message's first fragment.
    begins: bool,
    /// Whether it ends with the message's last fragment.
    ends: bool,
    octets: BytesMut,
    updated: Instant,
}

impl Run {
    fn new(now: Instant, frame: &Frame) -> Self {
        let data = frame.flags.data();
        Self {
            source: frame.source,
            destination: frame.destination,
            first: frame.sequence,
            last: frame.sequence,
            begins: data == DataControl::First,
            ends: data == DataControl::Last,
            octets: BytesMut::from(part_of_message(frame)),
            updated: now,
        }
    }

    fn is_between(&self, source: JausId, destination: JausId) -> bool {
        self.source == source && self.destination == destination
    }

    /// Whether the sequence number is one of the run's.
    fn covers(&self, sequence: u16) -> bool {
        sequence.wrapping_sub(self.first) <= self.last.wrapping_sub(self.first)
    }

    /// Whether `next` continues this run.
    fn is_continued_by(&self, next: &Self) -> bool {
        next.is_between(self.source, self.destination)
            && !self.ends
            && !next.begins
            && next.first == self.last.wrapping_add(1)
    }

    fn append(&mut self, next: &Self) {
        self.octets.extend_from_slice(&next.octets);
        self.last = next.last;
        self.ends = next.ends;
        self.updated = self.updated.max(next.updated);
    }
}

/// The unfinished large messages.
#[derive(Debug)]
pub(in crate::endpoint) struct Reassembly {
    runs: Vec<Run>,
    max_message: usize,
    max_octets: usize,
    timeout: Duration,
}

impl Reassembly {
    pub(in crate::endpoint) fn new(config: &Config) -> Self {
        Self {
            runs: Vec::new(),
            max_message: config.max_message,
            max_octets: config.max_reassembly,
            timeout: config.reassembly_timeout,
        }
    }

    /// Takes a fragment, and gives the message if it is whole now. What a bound makes it forget is
    /// counted.
    pub(in crate::endpoint) fn insert(
        &mut self,
        now: Instant,
        frame: &Frame,
        counters: &mut Counters,
    ) -> Result<Option<Bytes>, Counter> {
        let covers = |run: &Run| {
            run.is_between(frame.source, frame.destination) && run.covers(frame.sequence)
        };
        let mut run = Run::new(now, frame);
        if run.begins {
            // The true repetitions were filtered before: here a restarted sender begins anew.
            self.forget(covers, counters);
        } else if self.runs.iter().any(covers) {
            return Err(Counter::Duplicate);
        }
        if let Some(before) = self
            .runs
            .iter()
            .position(|before| before.is_continued_by(&run))
        {
            let mut before = self.runs.swap_remove(before);
            before.append(&run);
            run = before;
        }
        if let Some(after) = self
            .runs
            .iter()
            .position(|after| run.is_continued_by(after))
        {
            run.append(&self.runs.swap_remove(after));
        }
        if run.octets.len() > self.max_message {
            return Err(Counter::MessageTooLong);
        }
        if run.begins && run.ends {
            return Ok(Some(run.octets.freeze()));
        }
        self.make_room(&run, counters);
        self.runs.push(run);
        Ok(None)
    }

    /// Forgets the oldest runs, of the same sender or of all, until there is room for one more.
    fn make_room(&mut self, new: &Run, counters: &mut Counters) {
        let length = new.octets.len();
        while self.octets_of(|run| run.source == new.source) + length > self.max_message
            && self.forget_oldest(|run| run.source == new.source)
        {
            counters.add(Counter::FragmentsForgotten);
        }
        while (self.octets_of(|_| true) + length > self.max_octets || self.runs.len() >= MAX_RUNS)
            && self.forget_oldest(|_| true)
        {
            counters.add(Counter::FragmentsForgotten);
        }
    }

    fn octets_of(&self, which: impl Fn(&Run) -> bool) -> usize {
        self.runs
            .iter()
            .filter(|run| which(run))
            .map(|run| run.octets.len())
            .sum()
    }

    fn forget_oldest(&mut self, which: impl Fn(&Run) -> bool) -> bool {
        let candidates = self.runs.iter().enumerate().filter(|(_, run)| which(run));
        match candidates.min_by_key(|(_, run)| run.updated) {
            Some((oldest, _)) => {
                self.runs.swap_remove(oldest);
                true
            }
            None => false,
        }
    }

    /// Forgets what has not grown for too long.
    pub(in crate::endpoint) fn expire(&mut self, now: Instant, counters: &mut Counters) {
        let timeout = self.timeout;
        self.forget(|run| run.updated + timeout <= now, counters);
    }

    fn forget(&mut self, which: impl Fn(&Run) -> bool, counters: &mut Counters) {
        let before = self.runs.len();
        self.runs.retain(|run| !which(run));
        counters.add_many(
            Counter::FragmentsForgotten,
            (before - self.runs.len()) as u64,
        );
    }

    /// When the next run expires.
    pub(in crate::endpoint) fn next_expiry(&self) -> Option<Instant> {
        self.runs.iter().map(|run| run.updated + self.timeout).min()
    }
}
