//! Reassembly of fragments, which may arrive in any order.
//!
//! Fragments with consecutive numbers form runs; a run with both ends is a complete message. The
//! pieces stay where they were received and are joined once, at the end. Sequence numbers wrap
//! around, so "before" and "after" are neighbours on a circle. A run that has not grown while the
//! sender advanced by a quarter of the circle is stale: its numbers are about to be reused.
//!
//! Unfinished messages are bounded in octets (including an overhead per piece), per sender and in
//! total, and in time. The oldest runs are dropped first.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::style;
use crate::address::JausId;
use crate::endpoint::rate::Origin;
use crate::endpoint::receive::Arrival;
use crate::endpoint::{Config, Counter, Counters};
use crate::peer::LargeStyle;
use crate::wire::{Acknowledgement, DataControl, Frame, Priority, Version, ra};

/// The overhead of a piece, in octets.
const PIECE_COST: usize = 64;
/// The overhead of a run, in octets.
const RUN_COST: usize = 256;
/// The most runs of one sender; a sender that loses every second fragment has this many in 2048.
const MAX_RUNS: usize = 1024;
/// The most runs of one sender that are checked because the given number is their last.
const MOST_ENDING: usize = 8;
/// A run is stale if the sender has used this many numbers since it grew.
const STALE: u64 = 1 << 14;

/// A piece is copied if it keeps alive more than this many times its length, so that it does not
/// retain a large datagram that consists mostly of other data.
const MOST_HELD: usize = 4;

/// What a fragment contributes to its message: the older headers repeat the code in each fragment.
/// The payload keeps `held` octets alive.
fn part_of_message(frame: &Frame, held: usize) -> Bytes {
    let payload = match (frame.version, frame.flags.data()) {
        (Version::As5669a, _) | (_, DataControl::First) => frame.payload.clone(),
        (Version::As5669 | Version::Ra, _) => {
            frame.payload.slice(ra::CODE_LEN.min(frame.payload.len())..)
        }
    };
    if held > payload.len().saturating_mul(MOST_HELD) {
        Bytes::copy_from_slice(&payload)
    } else {
        payload
    }
}

/// A message whose fragments have all arrived.
#[derive(Debug)]
pub(in crate::endpoint) struct Whole {
    pub(in crate::endpoint) payload: Bytes,
    /// How it was cut, if that can be detected.
    pub(in crate::endpoint) style: LargeStyle,
    /// The number and payload of its first fragment.
    pub(in crate::endpoint) first: (u16, Bytes),
}

/// The properties that all fragments of a message share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Kind {
    version: Version,
    priority: Priority,
}

/// A run of fragments with consecutive sequence numbers.
#[derive(Debug)]
struct Run {
    kind: Kind,
    last: u16,
    /// Whether it includes the message's first fragment.
    begins: bool,
    /// Whether it includes the message's last fragment.
    ends: bool,
    pieces: VecDeque<Bytes>,
    octets: usize,
    /// When its latest fragment arrived.
    updated: Instant,
    /// The sender's position at that time.
    position: i64,
}

impl Run {
    fn covers(&self, first: u16, sequence: u16) -> bool {
        sequence.wrapping_sub(first) <= self.last.wrapping_sub(first)
    }

    /// Whether the frame requests an acknowledgement and repeats the first fragment of this run.
    fn is_begun_by(&self, frame: &Frame) -> bool {
        frame.flags.acknowledgement() == Acknowledgement::Request
            && self.begins
            && self.pieces.front() == Some(&frame.payload)
    }

    /// Joins a run that has both ends; `known` is the sender's style, if known.
    fn join(&self, known: Option<LargeStyle>) -> Whole {
        let (payload, style) = style::join(self.kind.version, &self.pieces, known);
        let after_first = (self.pieces.len() as u16).wrapping_sub(1);
        let piece = self.pieces.front().cloned().unwrap_or_default();
        Whole {
            payload,
            style,
            first: (self.last.wrapping_sub(after_first), piece),
        }
    }

    fn cost(&self) -> usize {
        RUN_COST + self.pieces.len() * PIECE_COST + self.octets
    }

    /// Appends the run that follows.
    fn append(&mut self, mut next: Self) {
        if self.pieces.len() >= next.pieces.len() {
            self.pieces.append(&mut next.pieces);
        } else {
            while let Some(piece) = self.pieces.pop_back() {
                next.pieces.push_front(piece);
            }
            self.pieces = next.pieces;
        }
        self.last = next.last;
        self.ends = next.ends;
        self.octets += next.octets;
        self.updated = self.updated.max(next.updated);
    }
}

/// The key of a run: the destination, and the number of its first fragment.
type Place = (JausId, u16);

/// The unfinished messages of one sender.
#[derive(Debug)]
struct Sender {
    runs: BTreeMap<Place, Run>,
    /// The runs by age.
    ages: BTreeSet<(Instant, Place)>,
    /// The runs by their last numbers.
    ends: BTreeSet<(u16, Place)>,
    /// Its network address.
    origin: Origin,
    cost: usize,
    /// When one of its runs last grew, or a fragment was repeated.
    grown: Instant,
    /// Whether one of its fragments was acknowledged.
    acknowledged: bool,
    /// The idle time under which the sender is listed; it may lag behind.
    listed: Instant,
    /// The latest number, and its distance from the first one.
    latest: u16,
    position: i64,
}

impl Sender {
    fn new(now: Instant, sequence: u16, origin: Origin) -> Self {
        Self {
            runs: BTreeMap::new(),
            ages: BTreeSet::new(),
            ends: BTreeSet::new(),
            origin,
            cost: 0,
            grown: now,
            acknowledged: false,
            listed: now,
            latest: sequence,
            position: 0,
        }
    }

    fn advance(&mut self, sequence: u16) {
        let ahead = sequence.wrapping_sub(self.latest).cast_signed();
        self.latest = sequence;
        self.position += i64::from(ahead);
    }

    /// The run that begins at this number, or else the nearest one before it.
    fn at_or_before(&self, destination: JausId, sequence: u16) -> Option<Place> {
        let from = (destination, 0);
        let before = self.runs.range(from..=(destination, sequence)).next_back();
        before
            .or_else(|| self.runs.range(from..=(destination, u16::MAX)).next_back())
            .map(|(&place, _)| place)
    }

    fn is_stale(&self, run: &Run) -> bool {
        self.position.abs_diff(run.position) >= STALE
    }

    fn take(&mut self, place: Place) -> Option<Run> {
        let run = self.runs.remove(&place)?;
        self.ages.remove(&(run.updated, place));
        self.ends.remove(&(run.last, place));
        self.cost -= run.cost();
        Some(run)
    }

    fn put(&mut self, place: Place, run: Run) {
        self.cost += run.cost();
        self.ages.insert((run.updated, place));
        self.ends.insert((run.last, place));
        self.runs.insert(place, run);
    }

    fn oldest(&self) -> Option<(Instant, Place)> {
        self.ages.first().copied()
    }

    /// Inserts a new fragment next to its neighbours; returns the key of the run that holds it.
    fn insert(&mut self, destination: JausId, first: u16, mut run: Run) -> Place {
        let (mut place, kind) = ((destination, first), run.kind);
        let before = self.at_or_before(destination, first.wrapping_sub(1));
        if let Some(before) = before
            && !run.begins
            && let Some(known) = self.runs.get(&before)
            && known.last.wrapping_add(1) == first
            && !known.ends
            && known.kind == kind
            && !self.is_stale(known)
            && let Some(mut longer) = self.take(before)
        {
            longer.append(run);
            (place, run) = (before, longer);
        }
        let after = (destination, run.last.wrapping_add(1));
        if let Some(known) = self.runs.get(&after)
            && !run.ends
            && !known.begins
            && known.kind == kind
            && !self.is_stale(known)
            && let Some(next) = self.take(after)
        {
            run.append(next);
        }
        run.position = self.position;
        self.put(place, run);
        place
    }
}

/// The share of the senders at one network address.
#[derive(Debug, Default)]
struct Share {
    cost: usize,
    /// When a message that wants an acknowledgement last arrived from there.
    heard: Option<Instant>,
    /// As in [`Reassembly::listed`].
    listed: BTreeSet<(Instant, JausId)>,
}

/// The reassembly buffer.
#[derive(Debug)]
pub(in crate::endpoint) struct Reassembly {
    senders: HashMap<JausId, Sender>,
    /// The senders by the time since which they are idle, or an earlier one.
    listed: BTreeSet<(Instant, JausId)>,
    cost: usize,
    /// The share of each network address, and the addresses ranked by their share.
    shares: HashMap<Origin, Share>,
    ranking: BTreeSet<(usize, Origin)>,
    max_message: usize,
    max_sender: usize,
    max_octets: usize,
    timeout: Duration,
}

impl Reassembly {
    pub(in crate::endpoint) fn new(config: &Config) -> Self {
        Self {
            senders: HashMap::new(),
            listed: BTreeSet::new(),
            cost: 0,
            shares: HashMap::new(),
            ranking: BTreeSet::new(),
            max_message: config.max_message,
            max_sender: config.max_reassembly_per_sender,
            max_octets: config.max_reassembly,
            timeout: config.reassembly_timeout,
        }
    }

    /// Adds a fragment; returns the message if it is complete. `style` is the sender's style, if
    /// known. The payload keeps `held` octets of memory alive. Runs dropped to stay within bounds
    /// are counted.
    pub(in crate::endpoint) fn insert(
        &mut self,
        Arrival {
            now, path, held, ..
        }: Arrival,
        frame: &Frame,
        style: Option<LargeStyle>,
        counters: &mut Counters,
    ) -> Result<Option<Whole>, Counter> {
        let source = frame.source;
        if !self.senders.contains_key(&source) {
            self.enlist(path.into(), now, source);
        }
        let new = || Sender::new(now, frame.sequence, path.into());
        let sender = self.senders.entry(source).or_insert_with(new);
        let before = sender.cost;
        let inserted = sender.take_in(now, frame, held, self.max_message, counters);
        if inserted.is_ok() {
            sender.grown = now;
            sender.acknowledged |= frame.flags.acknowledgement() == Acknowledgement::Request;
        }
        let (after, runs, origin) = (sender.cost, sender.runs.len(), sender.origin);
        self.account(origin, before, after);
        match inserted {
            Ok(Some(run)) => {
                self.drop_if_empty(source);
                Ok(Some(run.join(style)))
            }
            Ok(None) => {
                self.keep_within_bounds(source, runs, counters);
                Ok(None)
            }
            Err(reason) => {
                self.drop_if_empty(source);
                Err(reason)
            }
        }
    }

    /// Records a repeated fragment: its sender is still active.
    pub(in crate::endpoint) fn keep(&mut self, now: Instant, frame: &Frame) {
        if frame.flags.data() != DataControl::Single
            && let Some(sender) = self.senders.get_mut(&frame.source)
        {
            sender.grown = now;
        }
    }

    /// Records that a message that wants an acknowledgement arrived from that network address.
    pub(in crate::endpoint) fn hear(&mut self, now: Instant, origin: Origin) {
        if let Some(share) = self.shares.get_mut(&origin) {
            share.heard = Some(now);
        }
    }

    /// The time since which a sender is idle. A sender never repeats acknowledged fragments, and it
    /// pauses a large message while its node, with any component, has something more urgent for us.
    /// So acknowledged fragments count as active while such messages arrive from that address.
    fn idle_since(&self, sender: &Sender) -> Instant {
        let share = self.shares.get(&sender.origin);
        let heard = share.and_then(|share| share.heard);
        let heard = heard.filter(|_| sender.acknowledged);
        heard.map_or(sender.grown, |heard| heard.max(sender.grown))
    }

    /// Whether this fragment is the next one of an unfinished message. In that case it is not a
    /// retransmission: its sender has restarted with the same numbers.
    pub(in crate::endpoint) fn awaits(&self, frame: &Frame) -> bool {
        let continues = matches!(frame.flags.data(), DataControl::Middle | DataControl::Last);
        let number = frame.sequence.wrapping_sub(1);
        let run = self.senders.get(&frame.source).and_then(|sender| {
            let place = sender.at_or_before(frame.destination, number)?;
            sender.runs.get(&place).filter(|run| !sender.is_stale(run))
        });
        continues && run.is_some_and(|run| run.begins && !run.ends && run.last == number)
    }

    /// Finishes the large message whose end is shown by `number`, the sequence number of the next
    /// whole message; returns it with its receiver and priority. JAUS++ does not mark the end of a
    /// message that fills its fragments, and reuses the number of the last fragment for the next
    /// message. See "no last fragment" in [`peer`](crate::peer#the-table).
    pub(in crate::endpoint) fn finish(
        &mut self,
        source: JausId,
        number: u16,
    ) -> Option<(JausId, Priority, Whole)> {
        let sender = self.senders.get_mut(&source)?;
        let from = (number, (JausId::from_u32(0), 0));
        let ending = sender.ends.range(from..).map_while(|&(last, place)| {
            let run = sender.runs.get(&place)?;
            (last == number).then_some((place, run))
        });
        let is_whole = |(_, run): &(Place, &Run)| {
            run.begins && !run.ends && style::may_lack_the_mark(run.kind.version, &run.pieces)
        };
        let (place, _) = ending.take(MOST_ENDING).find(is_whole)?;
        let (before, origin) = (sender.cost, sender.origin);
        let run = sender.take(place)?;
        let after = sender.cost;
        self.account(origin, before, after);
        self.drop_if_empty(source);
        let whole = run.join(Some(LargeStyle::RepeatedCode));
        Some((place.0, run.kind.priority, whole))
    }

    fn drop_if_empty(&mut self, source: JausId) {
        if let Some(sender) = self.senders.get(&source)
            && sender.runs.is_empty()
        {
            self.strike(sender.origin, sender.listed, source);
            self.senders.remove(&source);
        }
    }

    /// Drops the oldest runs, of this sender or of all, until all bounds are met.
    fn keep_within_bounds(&mut self, source: JausId, runs: usize, counters: &mut Counters) {
        if runs > MAX_RUNS {
            self.forget_oldest_of(source, counters);
        }
        while let Some(sender) = self.senders.get(&source)
            && sender.cost > self.max_sender
        {
            self.forget_oldest_of(source, counters);
        }
        while self.cost > self.max_octets
            && let Some((listed, source)) = self.oldest_of_most()
        {
            match self.senders.get(&source) {
                Some(sender) if self.idle_since(sender) > listed => self.list(source),
                _ => self.forget_oldest_of(source, counters),
            }
        }
    }

    /// The sender idle for longest, of the network address with the largest share.
    fn oldest_of_most(&self) -> Option<(Instant, JausId)> {
        let (_, origin) = self.ranking.last()?;
        self.shares.get(origin)?.listed.first().copied()
    }

    /// Updates the accounts when the cost of a sender has changed.
    fn account(&mut self, origin: Origin, before: usize, after: usize) {
        self.cost = self.cost + after - before;
        let share = self.shares.entry(origin).or_default();
        self.ranking.remove(&(share.cost, origin));
        share.cost = share.cost + after - before;
        self.ranking.insert((share.cost, origin));
    }

    fn enlist(&mut self, origin: Origin, listed: Instant, source: JausId) {
        self.listed.insert((listed, source));
        let share = self.shares.entry(origin).or_default();
        share.listed.insert((listed, source));
    }

    /// Removes a sender from the lists, and the share of its address if that is empty.
    fn strike(&mut self, origin: Origin, listed: Instant, source: JausId) {
        self.listed.remove(&(listed, source));
        if let Some(share) = self.shares.get_mut(&origin) {
            share.listed.remove(&(listed, source));
            if share.listed.is_empty() && share.cost == 0 {
                self.shares.remove(&origin);
                self.ranking.remove(&(0, origin));
            }
        }
    }

    fn forget_oldest_of(&mut self, source: JausId, counters: &mut Counters) {
        if let Some(sender) = self.senders.get_mut(&source) {
            let (oldest, before, origin) = (sender.oldest(), sender.cost, sender.origin);
            if oldest.and_then(|(_, place)| sender.take(place)).is_some() {
                let after = sender.cost;
                self.account(origin, before, after);
                counters.add(Counter::FragmentsForgotten);
            }
        }
        self.list(source);
    }

    /// Lists a sender by the time since which it is idle, or drops it if it has no run.
    fn list(&mut self, source: JausId) {
        let Some(sender) = self.senders.get(&source) else {
            return;
        };
        let (origin, before, idle) = (sender.origin, sender.listed, self.idle_since(sender));
        let is_empty = sender.runs.is_empty();
        if is_empty {
            self.senders.remove(&source);
        } else if let Some(sender) = self.senders.get_mut(&source) {
            sender.listed = idle;
            self.enlist(origin, idle, source);
        }
        if is_empty || idle != before {
            self.strike(origin, before, source);
        }
    }

    /// Drops the runs of senders that are idle for too long. A single run may rest for longer,
    /// while its sender keeps retransmitting one fragment and the others are acknowledged.
    pub(in crate::endpoint) fn expire(&mut self, now: Instant, counters: &mut Counters) {
        while let Some(&(listed, source)) = self.listed.first()
            && listed + self.timeout <= now
        {
            while let Some(sender) = self.senders.get(&source)
                && self.idle_since(sender) + self.timeout <= now
            {
                self.forget_oldest_of(source, counters);
            }
            self.list(source);
        }
    }

    /// When the next run may expire.
    pub(in crate::endpoint) fn next_expiry(&self) -> Option<Instant> {
        let &(listed, _) = self.listed.first()?;
        Some(listed + self.timeout)
    }

    /// The octets buffered, overhead included.
    pub(in crate::endpoint) const fn cost(&self) -> usize {
        self.cost
    }
}

impl Sender {
    /// Adds a fragment; returns the run if it is a complete message.
    fn take_in(
        &mut self,
        now: Instant,
        frame: &Frame,
        held: usize,
        max_message: usize,
        counters: &mut Counters,
    ) -> Result<Option<Run>, Counter> {
        let (destination, sequence) = (frame.destination, frame.sequence);
        let data = frame.flags.data();
        self.advance(sequence);
        if let Some(place) = self.at_or_before(destination, sequence)
            && let Some(known) = self.runs.get(&place)
            && known.covers(place.1, sequence)
        {
            // Most retransmissions were filtered before, so this is a restarted sender; but a
            // sender that waits for our acknowledgement may have been silent for long.
            let begins_anew = data == DataControl::First && !known.is_begun_by(frame);
            if !begins_anew && !self.is_stale(known) {
                return Err(Counter::Duplicate);
            }
            self.take(place);
            counters.add(Counter::FragmentsForgotten);
        }
        let piece = part_of_message(frame, held);
        let run = Run {
            kind: Kind {
                version: frame.version,
                priority: frame.flags.priority(),
            },
            last: sequence,
            begins: data == DataControl::First,
            ends: data == DataControl::Last,
            octets: piece.len(),
            pieces: VecDeque::from([piece]),
            updated: now,
            position: self.position,
        };
        let place = self.insert(destination, sequence, run);
        let Some(run) = self.runs.get(&place) else {
            return Ok(None);
        };
        if run.octets > max_message {
            self.take(place);
            return Err(Counter::MessageTooLong);
        }
        Ok(if run.begins && run.ends {
            self.take(place)
        } else {
            None
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_piece_does_not_keep_a_large_datagram_alive() {
        let datagram = Bytes::from(vec![7; 60_000]);
        let frame = |length| {
            let (source, destination) = (JausId::new(1, 1, 1), JausId::new(2, 1, 1));
            Frame::new(source, destination, datagram.slice(..length))
        };
        let is_shared = |length: usize, held| {
            let piece = part_of_message(&frame(length), held);
            assert_eq!(piece.len(), length);
            datagram.as_ptr_range().contains(&piece.as_ptr())
        };
        assert!(!is_shared(100, datagram.len()));
        assert!(is_shared(15_000, datagram.len()));
        assert!(is_shared(1425, 1440));
        assert!(!is_shared(1425, usize::MAX), "of a stream nothing is known");
    }
}
