//! Reassembly of fragments, which may arrive in any order.
//!
//! Fragments with consecutive numbers form runs; a run with both ends is a complete message. The
//! pieces stay where they were received and are joined once, at the end. Sequence numbers wrap
//! around, so "before" and "after" are neighbours on a circle. A run that has not grown while the
//! sender advanced by a quarter of the circle is stale: its numbers are about to be reused.
//!
//! Fragments of one secure session never complete a message of another one, or of a plain link: only the
//! first fragment shows what a message is, and so only its session was asked for the right to it.
//!
//! Unfinished messages are bounded in octets (including an overhead per piece and run), per sender
//! and in total, and in time. The oldest runs are dropped first.

#[cfg(test)]
mod tests;

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;
use jaus_limits::Tally;

use super::style;
use crate::address::JausId;
use crate::endpoint::arrival::Arrival;
use crate::endpoint::rate::Origin;
use crate::endpoint::share::Ages;
use crate::endpoint::{Config, Counter, Counters, Path, Remote, SessionId};
use crate::peer::LargeStyle;
use crate::wire::{Acknowledgement, DataControl, Frame, Priority, Version};

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
    let payload = match frame.flags.data() {
        DataControl::First => frame.payload.clone(),
        _ => frame.payload.slice(frame.repeated_code_len()..),
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
    pub(in crate::endpoint) destination: JausId,
    pub(in crate::endpoint) priority: Priority,
    pub(in crate::endpoint) payload: Bytes,
    /// How it was cut; standard unless another style is known or detected.
    pub(in crate::endpoint) style: LargeStyle,
    /// The number and payload of its first fragment.
    pub(in crate::endpoint) first: (u16, Bytes),
}

/// A run of fragments with consecutive sequence numbers.
#[derive(Debug)]
struct Run {
    version: Version,
    priority: Priority,
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
    /// The run of one fragment with this piece of a message.
    fn of(arrival: Arrival<'_>, piece: Bytes, position: i64) -> Self {
        let (frame, data) = (arrival.frame, arrival.frame.flags.data());
        Self {
            version: frame.version,
            priority: frame.flags.priority(),
            last: frame.sequence,
            begins: data == DataControl::First,
            ends: data == DataControl::Last,
            octets: piece.len(),
            pieces: VecDeque::from([piece]),
            updated: arrival.now,
            position,
        }
    }

    fn covers(&self, first: u16, sequence: u16) -> bool {
        sequence.wrapping_sub(first) <= self.last.wrapping_sub(first)
    }

    /// Whether a run that follows belongs to the same message.
    fn is_continued_by(&self, next: &Self) -> bool {
        !self.ends && !next.begins && (self.version, self.priority) == (next.version, next.priority)
    }

    /// Whether the frame requests an acknowledgement and repeats the first fragment of this run.
    fn is_begun_by(&self, frame: &Frame) -> bool {
        frame.flags.acknowledgement() == Acknowledgement::Request
            && self.begins
            && self.pieces.front() == Some(&frame.payload)
    }

    /// Joins a run that has both ends; `known` is the sender's style, if known.
    fn join(&self, ((destination, _), first): Place, known: Option<LargeStyle>) -> Whole {
        let (payload, style) = style::join(self.version, &self.pieces, known);
        Whole {
            destination,
            priority: self.priority,
            payload,
            style,
            first: (first, self.pieces.front().cloned().unwrap_or_default()),
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

/// What all fragments of a message share besides their source: the destination and the session, if any.
type Channel = (JausId, Option<SessionId>);

/// The key of a run: its channel, and the number of its first fragment.
type Place = (Channel, u16);

const fn channel(frame: &Frame, path: Path) -> Channel {
    let session = match path.peer {
        Remote::Session(session) => Some(session),
        // The sender may move, or send by several plain links.
        Remote::Socket(_) | Remote::Line => None,
    };
    (frame.destination, session)
}

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

    /// The run that begins at this number, or else the nearest one before it.
    fn at_or_before(&self, channel: Channel, sequence: u16) -> Option<(Place, &Run)> {
        let up_to = |last| self.runs.range((channel, 0)..=(channel, last)).next_back();
        let run = up_to(sequence).or_else(|| up_to(u16::MAX));
        run.map(|(&place, run)| (place, run))
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

    /// Adds a fragment; returns the run and its key if it is a complete message.
    fn take_in(
        &mut self,
        arrival: Arrival<'_>,
        max_message: usize,
        counters: &mut Counters,
    ) -> Result<Option<(Place, Run)>, Counter> {
        let frame = arrival.frame;
        let (channel, sequence) = (channel(frame, arrival.path), frame.sequence);
        let data = frame.flags.data();
        let ahead = sequence.wrapping_sub(self.latest).cast_signed();
        self.latest = sequence;
        self.position += i64::from(ahead);
        if let Some((place, known)) = self.at_or_before(channel, sequence)
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
        let piece = part_of_message(frame, arrival.held);
        let run = Run::of(arrival, piece, self.position);
        let place = self.insert(channel, sequence, run);
        let Some(run) = self.runs.get(&place) else {
            return Ok(None);
        };
        if run.octets > max_message {
            self.take(place);
            return Err(Counter::MessageTooLong);
        }
        let is_whole = run.begins && run.ends;
        let run = is_whole.then(|| self.take(place)).flatten();
        Ok(run.map(|run| (place, run)))
    }

    /// The run that this fragment continues.
    fn before(&self, channel: Channel, first: u16, run: &Run) -> Option<(Place, &Run)> {
        let before = self.at_or_before(channel, first.wrapping_sub(1));
        before.filter(|(_, known)| {
            known.last.wrapping_add(1) == first
                && known.is_continued_by(run)
                && !self.is_stale(known)
        })
    }

    /// The run that continues this one.
    fn after(&self, channel: Channel, run: &Run) -> Option<(Place, &Run)> {
        let after = (channel, run.last.wrapping_add(1));
        let known = self.runs.get(&after).map(|known| (after, known));
        known.filter(|(_, known)| run.is_continued_by(known) && !self.is_stale(known))
    }

    /// Octets of the run that a fragment would make with its neighbours.
    fn length_with(&self, arrival: Arrival<'_>) -> usize {
        let frame = arrival.frame;
        let channel = channel(frame, arrival.path);
        let run = Run::of(arrival, frame.payload.clone(), self.position);
        let before = self.before(channel, frame.sequence, &run);
        let neighbours = [before, self.after(channel, &run)];
        let octets = neighbours.into_iter().flatten().map(|(_, it)| it.octets);
        run.octets + octets.sum::<usize>()
    }

    /// Inserts a new fragment next to its neighbours; returns the key of the run that holds it.
    fn insert(&mut self, channel: Channel, first: u16, mut run: Run) -> Place {
        let mut place = (channel, first);
        let before = self.before(channel, first, &run).map(|it| it.0);
        if let Some(before) = before
            && let Some(mut longer) = self.take(before)
        {
            longer.append(run);
            (place, run) = (before, longer);
        }
        let after = self.after(channel, &run).map(|it| it.0);
        if let Some(next) = after.and_then(|after| self.take(after)) {
            run.append(next);
        }
        run.position = self.position;
        self.put(place, run);
        place
    }
}

/// The reassembly buffer.
#[derive(Debug, Default)]
pub(in crate::endpoint) struct Reassembly {
    senders: HashMap<JausId, Sender>,
    /// The senders by the time since which they are idle, or an earlier one.
    listed: Ages<()>,
    cost: usize,
    /// The cost of each network address.
    shares: Tally<Origin>,
    /// When a message that wants an acknowledgement last arrived from an address with senders.
    heard: HashMap<Origin, Instant>,
    config: Arc<Config>,
}

impl Reassembly {
    pub(in crate::endpoint) fn new(config: Arc<Config>) -> Self {
        Self {
            config,
            ..Self::default()
        }
    }

    /// Checks that a fragment, which is about to be acknowledged, does not belong to a message above the
    /// limit of length. What arrived of it stays, so that its repetitions are refused as well: otherwise
    /// all fragments would be acknowledged in the end, and none delivered.
    pub(in crate::endpoint) fn check_length(&self, arrival: Arrival<'_>) -> Result<(), Counter> {
        let (frame, most) = (arrival.frame, self.config.max_message);
        let sender = self.senders.get(&frame.source);
        let is_too_long = |sender: &Sender| {
            frame.flags.data() != DataControl::Single
                && sender.cost + frame.payload.len() > most
                && sender.length_with(arrival) > most
        };
        match sender.is_some_and(is_too_long) {
            true => Err(Counter::MessageTooLong),
            false => Ok(()),
        }
    }

    /// Adds a fragment; returns the message if it is complete. `style` is the sender's style, if
    /// known. Runs dropped to stay within bounds are counted.
    pub(in crate::endpoint) fn insert(
        &mut self,
        arrival: Arrival<'_>,
        style: Option<LargeStyle>,
        counters: &mut Counters,
    ) -> Result<Option<Whole>, Counter> {
        let (frame, now, path) = (arrival.frame, arrival.now, arrival.path);
        let source = frame.source;
        if let Entry::Vacant(vacant) = self.senders.entry(source) {
            vacant.insert(Sender::new(now, frame.sequence, path.into()));
            self.listed.set(path.into(), (), (now, source), true);
        }
        let max_message = self.config.max_message;
        let inserted = self.change(source, |sender| -> Result<_, Counter> {
            let whole = sender.take_in(arrival, max_message, counters)?;
            sender.grown = now;
            sender.acknowledged |= frame.flags.acknowledgement() == Acknowledgement::Request;
            Ok(whole)
        });
        self.keep_within_bounds(source, counters);
        let whole = inserted.unwrap_or(Ok(None))?;
        Ok(whole.map(|(place, run)| run.join(place, style)))
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
        if self.listed.oldest(Some(origin), ()).is_some() {
            self.heard.insert(origin, now);
        }
    }

    /// The time since which a sender is idle. A sender never repeats acknowledged fragments, and it
    /// pauses a large message while its node, with any component, has something more urgent for us.
    /// So acknowledged fragments count as active while such messages arrive from that address.
    fn idle_since(&self, sender: &Sender) -> Instant {
        let heard = self.heard.get(&sender.origin);
        let heard = heard.filter(|_| sender.acknowledged);
        heard.map_or(sender.grown, |&heard| heard.max(sender.grown))
    }

    /// Whether this fragment is the next one of an unfinished message. In that case it is not a
    /// retransmission: its sender has restarted with the same numbers.
    pub(in crate::endpoint) fn awaits(&self, frame: &Frame, path: Path) -> bool {
        let continues = matches!(frame.flags.data(), DataControl::Middle | DataControl::Last);
        let number = frame.sequence.wrapping_sub(1);
        let is_begun = |sender: &Sender| {
            let run = sender.at_or_before(channel(frame, path), number);
            run.is_some_and(|(_, run)| {
                run.begins && !run.ends && run.last == number && !sender.is_stale(run)
            })
        };
        continues && self.senders.get(&frame.source).is_some_and(is_begun)
    }

    /// Finishes the large message whose end is shown by the sequence number of the next whole message from
    /// its sender, by the same session if any. JAUS++ does not mark the end of a message that fills its fragments, and
    /// reuses the number of the last fragment for the next message. See "no last fragment" in
    /// [`peer`](crate::peer#the-table).
    pub(in crate::endpoint) fn finish(&mut self, next: &Frame, path: Path) -> Option<Whole> {
        let (source, number, (_, session)) = (next.source, next.sequence, channel(next, path));
        let sender = self.senders.get(&source)?;
        let from = (number, ((JausId::from_u32(0), None), 0));
        let ending = sender.ends.range(from..).map_while(|&(last, place)| {
            let run = sender.runs.get(&place)?;
            (last == number).then_some((place, run))
        });
        let is_whole = |(place, run): &(Place, &Run)| {
            let is_of_session = place.0.1 == session;
            is_of_session
                && run.begins
                && !run.ends
                && style::may_lack_the_mark(run.version, &run.pieces)
        };
        let (place, _) = ending.take(MOST_ENDING).find(is_whole)?;
        let run = self.change(source, |sender| sender.take(place))??;
        Some(run.join(place, Some(LargeStyle::RepeatedCode)))
    }

    /// Changes a sender, and updates the accounts. A sender without runs is dropped.
    fn change<T>(&mut self, source: JausId, change: impl FnOnce(&mut Sender) -> T) -> Option<T> {
        let sender = self.senders.get_mut(&source)?;
        let before = sender.cost;
        let changed = change(sender);
        let (origin, after, is_empty) = (sender.origin, sender.cost, sender.runs.is_empty());
        self.cost = self.cost + after - before;
        self.shares
            .set(origin, self.shares.of(origin) + after - before);
        if is_empty {
            self.list(source);
        }
        Some(changed)
    }

    /// Drops the oldest runs, of this sender or of all, until all bounds are met.
    fn keep_within_bounds(&mut self, source: JausId, counters: &mut Counters) {
        while let Some(sender) = self.senders.get(&source)
            && (sender.runs.len() > MAX_RUNS || sender.cost > self.config.max_reassembly_per_sender)
        {
            self.forget_oldest_of(source, counters);
        }
        while self.cost > self.config.max_reassembly
            && let Some((_, origin)) = self.shares.largest()
            && let Some((listed, source)) = self.listed.oldest(Some(origin), ())
        {
            match self.senders.get(&source) {
                Some(sender) if self.idle_since(sender) > listed => self.list(source),
                _ => self.forget_oldest_of(source, counters),
            }
        }
    }

    fn forget_oldest_of(&mut self, source: JausId, counters: &mut Counters) {
        let forgotten = self.change(source, |sender| {
            let &(_, place) = sender.ages.first()?;
            sender.take(place)
        });
        if forgotten.flatten().is_some() {
            counters.add(Counter::FragmentsForgotten);
        }
        self.list(source);
    }

    /// Lists a sender by the time since which it is idle, or drops it if it has no run.
    fn list(&mut self, source: JausId) {
        let Some(mut sender) = self.senders.remove(&source) else {
            return;
        };
        let origin = sender.origin;
        self.listed.set(origin, (), (sender.listed, source), false);
        if !sender.runs.is_empty() {
            sender.listed = self.idle_since(&sender);
            self.listed.set(origin, (), (sender.listed, source), true);
            self.senders.insert(source, sender);
        } else if self.listed.oldest(Some(origin), ()).is_none() {
            self.heard.remove(&origin);
        }
    }

    /// Drops the runs of senders that are idle for too long. A single run may rest for longer,
    /// while its sender keeps retransmitting one fragment and the others are acknowledged.
    pub(in crate::endpoint) fn expire(&mut self, now: Instant, counters: &mut Counters) {
        let timeout = self.config.reassembly_timeout;
        while let Some((listed, source)) = self.listed.oldest(None, ())
            && listed + timeout <= now
        {
            while let Some(sender) = self.senders.get(&source)
                && self.idle_since(sender) + timeout <= now
            {
                self.forget_oldest_of(source, counters);
            }
            self.list(source);
        }
    }

    /// When the next run may expire.
    pub(in crate::endpoint) fn next_expiry(&self) -> Option<Instant> {
        let (listed, _) = self.listed.oldest(None, ())?;
        Some(listed + self.config.reassembly_timeout)
    }

    /// The octets buffered, overhead included.
    pub(in crate::endpoint) const fn cost(&self) -> usize {
        self.cost
    }
}
