//! Outgoing datagrams: one queue per link and remote, by priority.
//!
//! One [dequeue](Egress::dequeue) serves them all. It takes the most urgent datagram, packs further
//! small messages to the same place into it, and puts further datagrams of the same length behind
//! it where the link sends several with one call. Nothing leaves a queue that does not leave with
//! the datagram. Octets are written to a buffer that is used again as soon as they are sent, so a
//! small message allocates nothing.

mod fragmented;
mod join;
mod queue;

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::hash::RandomState;
use std::time::{Duration, Instant};

use bytes::{Bytes, BytesMut};

use super::recent::{Fingerprint, Recent};
use super::{Config, Counter, Counters, LinkId, LinkProfile, Path, To, Transmit};
use crate::wire::{Acknowledgement, EncodeError, Flags, Frame, Framing, Priority, as5669a, judp};
pub(super) use fragmented::FragmentedSend;
pub use fragmented::Pacing;
use join::{Fragments, may_pack};
use queue::HopQueue;
pub(super) use queue::Level;

/// What the kernel takes at once, whatever the number of datagrams; a little less than it says,
/// for IPv6's longer headers.
pub(crate) const MOST_OCTETS: usize = 65_000;
/// The octets that the buffer is made for. While one datagram of it waits in a link, so do they.
const BUFFER: usize = 16 << 10;
/// Queues that are kept, empty, for what is sent next.
const IDLE_QUEUES: usize = 128;

/// The other end of a link, or all of them.
pub(super) type Hop = (LinkId, To);

impl From<Path> for Hop {
    fn from(path: Path) -> Self {
        (path.link, To::Peer(path.peer))
    }
}

/// Whether small messages to the same address share a datagram.
///
/// Only messages with today's header do. Junior and JAUS++ read several in a datagram, and neither
/// ever sends more than one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Packing {
    /// Each message has a datagram of its own.
    #[default]
    Off,
    /// Messages wait up to so long for others to the same address, a safety-critical one not at
    /// all. With zero, those share a datagram that wait anyway when the link takes the next.
    Within(Duration),
}

/// The links, and what waits to be sent on them.
#[derive(Debug)]
pub(super) struct Egress {
    links: BTreeMap<LinkId, LinkProfile>,
    queues: Queues,
    turns: Turns,
    /// Datagrams that wait, by priority, without fragments.
    waiting: [usize; Priority::ALL.len()],
    /// Octets of messages of which fragments wait.
    fragmented: usize,
    buffer: BytesMut,
    /// What went to a group, and may come back.
    echoes: Recent,
    echo_window: Duration,
    /// How long messages wait for others, unless they do not.
    patience: Option<Duration>,
    /// The longest datagram that messages are packed into; 0 if they are not.
    longest_packed: usize,
    queue_limit: usize,
    max_fragmented: usize,
}

impl Egress {
    pub(super) fn new(config: &Config, keys: RandomState) -> Self {
        let (patience, longest_packed) = match config.packing {
            Packing::Off => (None, 0),
            Packing::Within(patience) => (
                Some(patience).filter(|it| !it.is_zero()),
                1 + as5669a::message_len(config.payload_limit),
            ),
        };
        Self {
            links: BTreeMap::new(),
            queues: Queues::default(),
            turns: Turns::default(),
            waiting: Default::default(),
            fragmented: 0,
            buffer: BytesMut::with_capacity(BUFFER),
            echoes: Recent::new(config.max_recent, config.echo_window, keys),
            echo_window: config.echo_window,
            patience,
            longest_packed,
            queue_limit: config.queue_limit,
            max_fragmented: config.max_paced,
        }
    }

    pub(super) fn add_link(&mut self, link: LinkId, profile: LinkProfile) {
        self.links.insert(link, profile);
    }

    /// Removes a link; how many datagrams waited to be sent on it.
    pub(super) fn remove_link(&mut self, link: LinkId) -> u64 {
        self.links.remove(&link);
        self.turns.forget(|hop| hop.0 == link);
        let mut lost = 0;
        for (_, queue) in self.queues.known.extract_if(|hop, _| hop.0 == link) {
            for (priority, count) in Priority::ALL.into_iter().zip(queue.waiting()) {
                self.waiting[usize::from(priority.bits())] -= count;
                lost += count;
            }
            let (count, octets) = queue.fragments();
            lost += count;
            self.fragmented -= octets;
        }
        lost as u64
    }

    pub(super) fn links(&self) -> impl Iterator<Item = (LinkId, &LinkProfile)> {
        self.links.iter().map(|(&link, profile)| (link, profile))
    }

    pub(super) fn has_link(&self, link: LinkId) -> bool {
        self.links.contains_key(&link)
    }

    /// How a link frames messages.
    pub(super) fn framing(&self, link: LinkId) -> Framing {
        let profile = self.links.get(&link);
        profile.map_or(Framing::default(), |profile| profile.framing)
    }

    /// How many queues there are.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.queues.known.len()
    }

    /// Whether so many more datagrams of a priority fit.
    pub(super) fn has_room(&self, priority: Priority, count: usize) -> bool {
        self.waiting[usize::from(priority.bits())] + count <= self.queue_limit
    }

    /// Whether messages of that length fit that leave in fragments; the first always does.
    pub(super) fn has_room_for_fragments(&self, octets: usize) -> bool {
        self.fragmented == 0 || self.fragmented + octets <= self.max_fragmented
    }

    /// The octets that carry a frame on a link, with the frame's own header.
    pub(super) fn encode(&mut self, link: LinkId, frame: &Frame) -> Result<Bytes, EncodeError> {
        encode(self.framing(link), &mut self.buffer, frame)
    }

    /// Queues a datagram with a message of these flags, or tells why it cannot be.
    pub(super) fn push(
        &mut self,
        now: Instant,
        hop: Hop,
        flags: Flags,
        octets: Bytes,
    ) -> Result<(), Counter> {
        if !self.has_link(hop.0) {
            return Err(Counter::LinkGone);
        }
        let priority = flags.priority();
        if !self.has_room(priority, 1) {
            return Err(Counter::TransmitQueueFull);
        }
        // Its sender waits for the answer.
        let is_awaited = flags.acknowledgement() == Acknowledgement::Request;
        let may_wait = !is_awaited && may_pack(&octets, self.longest_packed);
        let patience = self.patience.filter(|_| may_wait);
        let packs = self.links.get(&hop.0).is_some_and(LinkProfile::packs);
        let is_packed = patience.filter(|_| packs);
        let held_until = is_packed.map(|patience| now + patience);
        let queue = self.queues.get(now, hop);
        queue.push(priority, octets, held_until);
        self.turns.list(hop, queue, self.longest_packed);
        self.waiting[usize::from(priority.bits())] += 1;
        Ok(())
    }

    /// Queues a message to several places, encoded once for each framing. What is not queued is
    /// counted.
    pub(super) fn push_to_many(
        &mut self,
        now: Instant,
        hops: &[Hop],
        frame: &Frame,
        counters: &mut Counters,
    ) -> Result<(), EncodeError> {
        let mut encoded: Vec<(Framing, Bytes)> = Vec::new();
        for &(link, _) in hops {
            let framing = self.framing(link);
            if !encoded.iter().any(|(known, _)| *known == framing) {
                encoded.push((framing, self.encode(link, frame)?));
            }
        }
        for &hop in hops {
            let framing = self.framing(hop.0);
            for (_, octets) in encoded.iter().filter(|(known, _)| *known == framing) {
                if let Err(reason) = self.push(now, hop, frame.flags, octets.clone()) {
                    counters.add(reason);
                }
            }
        }
        Ok(())
    }

    /// Queues a message that leaves in fragments, if there is a link.
    pub(super) fn push_fragmented(
        &mut self,
        now: Instant,
        hop: Hop,
        message: FragmentedSend,
    ) -> Result<(), Counter> {
        if !self.has_link(hop.0) {
            return Err(Counter::LinkGone);
        }
        self.fragmented += message.remaining();
        let queue = self.queues.get(now, hop);
        queue.push_fragmented(message);
        self.turns.list(hop, queue, self.longest_packed);
        Ok(())
    }

    /// Remembers a message of ours that goes to a group.
    pub(super) fn remember_echo(&mut self, now: Instant, frame: &Frame) {
        self.echoes.insert(now, self.echoes.fingerprint(frame));
    }

    /// Whether that went to a group lately.
    pub(super) fn is_echo(&self, now: Instant, seen: &Fingerprint) -> bool {
        self.echoes.contains(now, seen, self.echo_window)
    }

    /// The next datagram of a level, with what leaves together with it.
    pub(super) fn dequeue(
        &mut self,
        now: Instant,
        level: Level,
        counters: &mut Counters,
    ) -> Option<Transmit> {
        while let Some(hop) = self.turns.next(level) {
            let queue = self.queues.get(now, hop);
            queue.take_turn(level);
            let Some(link) = self.links.get(&hop.0) else {
                continue;
            };
            if !queue.is_ready(level, self.longest_packed) {
                continue;
            }
            let joined = if level.is_fragments() {
                let mut leaving = Fragments {
                    now,
                    framing: link.framing,
                    echoes: (hop.1 == To::Group).then_some(&mut self.echoes),
                    octets: &mut self.fragmented,
                    counters,
                };
                queue.join_fragments(level, segments(link), &mut leaving, &mut self.buffer)
            } else {
                let before = queue.waiting();
                let longest = if link.packs() { self.longest_packed } else { 0 };
                let joined = queue.join_messages(level, segments(link), longest, &mut self.buffer);
                let taken = before.into_iter().zip(queue.waiting());
                for (waiting, (before, after)) in self.waiting.iter_mut().zip(taken) {
                    *waiting -= before - after;
                }
                joined
            };
            self.turns.list(hop, queue, self.longest_packed);
            if let Some((payload, segment)) = joined {
                let datagrams = segment.map_or(1, |segment| payload.len().div_ceil(segment));
                counters.add_many(Counter::DatagramsSent, datagrams as u64);
                return Some(Transmit {
                    link: hop.0,
                    to: hop.1,
                    priority: level.priority(),
                    payload,
                    segment,
                });
            }
        }
        None
    }

    /// Lets those go on that have waited long enough.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        while let Some(hop) = self.turns.next_due(now) {
            let queue = self.queues.get(now, hop);
            queue.handle_timeout(now);
            self.turns.list(hop, queue, self.longest_packed);
        }
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    pub(super) fn next_deadline(&self) -> Option<Instant> {
        self.turns.timers.first().map(|&(at, _)| at)
    }
}

/// The queues, of which idle ones are kept for what is sent next.
#[derive(Debug, Default)]
struct Queues {
    known: HashMap<Hop, HopQueue>,
    /// How many there were when the idle ones were forgotten.
    swept: usize,
}

impl Queues {
    fn get(&mut self, now: Instant, hop: Hop) -> &mut HopQueue {
        if self.known.len() >= IDLE_QUEUES.max(2 * self.swept) && !self.known.contains_key(&hop) {
            self.known.retain(|_, queue| !queue.is_idle(now));
            self.swept = self.known.len();
        }
        self.known.entry(hop).or_default()
    }
}

/// Whose turn it is, and when.
#[derive(Debug, Default)]
struct Turns {
    /// Queues that have something to send, by level; each stands in a list at most once.
    ready: [VecDeque<Hop>; Level::COUNT],
    /// When what is held, or paced, may go on.
    timers: BTreeSet<(Instant, Hop)>,
}

impl Turns {
    /// Sees to it that a queue has its turn if it has something to send, and its timer if that must
    /// wait.
    fn list(&mut self, hop: Hop, queue: &mut HopQueue, longest_packed: usize) {
        for level in queue.list(longest_packed) {
            self.ready[level.index()].push_back(hop);
        }
        self.timers.extend(queue.deadlines().map(|at| (at, hop)));
    }

    fn next(&mut self, level: Level) -> Option<Hop> {
        self.ready[level.index()].pop_front()
    }

    fn next_due(&mut self, now: Instant) -> Option<Hop> {
        let due = self.timers.first().is_some_and(|&(at, _)| at <= now);
        due.then(|| self.timers.pop_first())
            .flatten()
            .map(|(_, hop)| hop)
    }

    fn forget(&mut self, is_gone: impl Fn(&Hop) -> bool) {
        self.timers.retain(|(_, hop)| !is_gone(hop));
        for list in &mut self.ready {
            list.retain(|hop| !is_gone(hop));
        }
    }
}

/// How many datagrams a link sends with one call.
fn segments(profile: &LinkProfile) -> usize {
    match profile.framing {
        Framing::Judp => profile.max_segments.max(1),
        Framing::Jtcp | Framing::Jserial => 1,
    }
}

fn encode(framing: Framing, buffer: &mut BytesMut, frame: &Frame) -> Result<Bytes, EncodeError> {
    match framing {
        Framing::Judp => {
            judp::emit(frame, buffer)?;
            Ok(buffer.split().freeze())
        }
        // A slow stream keeps what it has not sent, and shall not keep the whole buffer.
        stream => stream.encode(frame),
    }
}
