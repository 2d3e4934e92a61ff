//! Outgoing datagrams: one queue per link and remote, by priority.
//!
//! One [dequeue](Egress::dequeue) serves all queues. It takes the most urgent datagram, packs
//! further small messages to the same hop into it, and appends further datagrams of the same length
//! if the link sends batches. A message leaves its queue only with the datagram that carries it.
//! Octets are written to a buffer that is reused as soon as they are sent, so a small message
//! allocates nothing.

mod fragmented;
mod join;
mod queue;

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::hash::RandomState;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::{Bytes, BytesMut};

use super::recent::Recent;
use super::{Config, Counter, Counters, LinkId, LinkProfile, Path, To, Transmit};
use crate::wire::{Acknowledgement, EncodeError, Flags, Frame, Framing, Priority, as5669a, judp};
pub(super) use fragmented::FragmentedSend;
use join::may_pack;
use queue::HopQueue;
pub(super) use queue::Level;

/// The most octets that the kernel accepts in one call, whatever the number of datagrams; slightly
/// less than it states, to allow for IPv6's longer headers.
pub(crate) const MOST_OCTETS: usize = 65_000;
/// The capacity of the buffer. While a link holds one datagram of it, all of it stays allocated.
const BUFFER: usize = 16 << 10;
/// How many idle queues are kept for later use.
const IDLE_QUEUES: usize = 128;

/// A next hop: the remote end of a link, or its group.
pub(super) type Hop = (LinkId, To);

impl From<Path> for Hop {
    fn from(path: Path) -> Self {
        (path.link, To::Peer(path.peer))
    }
}

/// Whether small messages to the same address share a datagram.
///
/// Only messages with the AS5669A header do. Junior and JAUS++ read several messages per datagram,
/// but never send more than one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Packing {
    /// Each message gets its own datagram.
    #[default]
    Off,
    /// Messages wait up to this long for others to the same address; safety-critical ones do not
    /// wait. With zero, only messages that are queued anyway when the link takes the next datagram
    /// share one.
    Within(Duration),
}

/// The links and their queues.
#[derive(Debug)]
pub(super) struct Egress {
    pub(super) links: BTreeMap<LinkId, LinkProfile>,
    pub(super) queues: Queues,
    /// Queued datagrams, by priority, without fragments.
    waiting: [usize; Priority::ALL.len()],
    /// Octets of messages in queued fragments.
    fragmented: usize,
    buffer: BytesMut,
    /// Messages sent to a group, which may come back.
    pub(super) echoes: Recent,
    /// How long messages wait to be packed; `None` if they do not.
    patience: Option<Duration>,
    config: Arc<Config>,
}

impl Egress {
    pub(super) fn new(config: Arc<Config>, keys: RandomState) -> Self {
        let (patience, longest_packed) = match config.packing {
            Packing::Off => (None, 0),
            Packing::Within(patience) => (
                Some(patience).filter(|it| !it.is_zero()),
                1 + as5669a::message_len(config.payload_limit),
            ),
        };
        Self {
            links: BTreeMap::new(),
            queues: Queues {
                longest_packed,
                ..Queues::default()
            },
            waiting: Default::default(),
            fragmented: 0,
            buffer: BytesMut::with_capacity(BUFFER),
            echoes: Recent::new(config.max_recent, config.echo_window, keys),
            patience,
            config,
        }
    }

    /// Removes a link; returns how many datagrams were queued on it.
    pub(super) fn remove_link(&mut self, link: LinkId) -> u64 {
        self.links.remove(&link);
        self.queues.forget_turns(link);
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

    /// The framing of a link.
    pub(super) fn framing(&self, link: LinkId) -> Framing {
        let profile = self.links.get(&link);
        profile.map_or(Framing::default(), |profile| profile.framing)
    }

    /// Whether a path leads through datagrams rather than a connection or line.
    pub(super) fn is_datagram(&self, path: Path) -> bool {
        self.framing(path.link) == Framing::Judp && !path.peer.is_session()
    }

    /// Whether `count` more datagrams of a priority fit.
    pub(super) fn has_room(&self, priority: Priority, count: usize) -> bool {
        self.waiting[usize::from(priority.bits())] + count <= self.config.queue_limit
    }

    /// Whether fragmented messages of that length fit; the first always does.
    pub(super) fn has_room_for_fragments(&self, octets: usize) -> bool {
        self.fragmented == 0 || self.fragmented + octets <= self.config.max_paced
    }

    /// Encodes a frame for a link, with the frame's own header.
    pub(super) fn encode(&mut self, link: LinkId, frame: &Frame) -> Result<Bytes, EncodeError> {
        encode(self.framing(link), &mut self.buffer, frame)
    }

    /// Queues a datagram that carries a message with these flags, or returns why it cannot be
    /// queued.
    pub(super) fn push(
        &mut self,
        now: Instant,
        hop: Hop,
        flags: Flags,
        octets: Bytes,
    ) -> Result<(), Counter> {
        let link = self.links.get(&hop.0).ok_or(Counter::LinkGone)?;
        let priority = flags.priority();
        if !self.has_room(priority, 1) {
            return Err(Counter::TransmitQueueFull);
        }
        // A sender waits for the answer, so do not delay the message.
        let is_awaited = flags.acknowledgement() == Acknowledgement::Request;
        let may_wait = !is_awaited && link.packs() && may_pack(&octets, self.queues.longest_packed);
        let patience = self.patience.filter(|_| may_wait);
        let held_until = patience.map(|patience| now + patience);
        self.queues
            .change(now, hop, |queue| queue.push(priority, octets, held_until));
        self.waiting[usize::from(priority.bits())] += 1;
        Ok(())
    }

    /// Queues a message for several hops, encoded once per framing. Failures are counted.
    pub(super) fn push_to_many(
        &mut self,
        now: Instant,
        hops: &[Hop],
        frame: &Frame,
        counters: &mut Counters,
    ) -> Result<(), EncodeError> {
        // Few framings, so a list; and all are encoded first, so that a message that cannot be
        // encoded is sent nowhere.
        let mut encoded: Vec<(Framing, Bytes)> = Vec::new();
        for &(link, _) in hops {
            let framing = self.framing(link);
            if !encoded.iter().any(|(known, _)| *known == framing) {
                encoded.push((framing, self.encode(link, frame)?));
            }
        }
        for &hop in hops {
            let framing = self.framing(hop.0);
            if let Some((_, octets)) = encoded.iter().find(|(known, _)| *known == framing)
                && let Err(reason) = self.push(now, hop, frame.flags, octets.clone())
            {
                counters.add(reason);
            }
        }
        Ok(())
    }

    /// Queues a fragmented message, if the link exists.
    pub(super) fn push_fragmented(
        &mut self,
        now: Instant,
        hop: Hop,
        message: FragmentedSend,
    ) -> Result<(), Counter> {
        if !self.links.contains_key(&hop.0) {
            return Err(Counter::LinkGone);
        }
        self.fragmented += message.remaining();
        self.queues
            .change(now, hop, |queue| queue.push_fragmented(message));
        Ok(())
    }

    /// The next datagram of a level, with everything packed or batched with it.
    pub(super) fn dequeue(
        &mut self,
        now: Instant,
        level: Level,
        counters: &mut Counters,
    ) -> Option<Transmit> {
        let longest_packed = self.queues.longest_packed;
        while let Some(hop) = self.queues.ready[level.index()].pop_front() {
            let Some(link) = self.links.get(&hop.0) else {
                continue;
            };
            let joined = self.queues.change(now, hop, |queue| {
                queue.listed[level.index()] = false;
                if !queue.is_ready(level, longest_packed) {
                    return None;
                }
                if level.is_fragments() {
                    let leave = |fragment: &Frame| {
                        self.fragmented -= fragment.payload.len();
                        if hop.1 == To::Group {
                            self.echoes.insert_own(now, fragment);
                        }
                    };
                    let buffer = &mut self.buffer;
                    return queue.join_fragments(now, level, link, buffer, counters, leave);
                }
                let before = queue.waiting();
                let longest = if link.packs() { longest_packed } else { 0 };
                let joined = queue.join_messages(level, link.segments(), longest, &mut self.buffer);
                for (at, after) in queue.waiting().into_iter().enumerate() {
                    self.waiting[at] -= before[at] - after;
                }
                joined
            });
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

    /// Releases queues whose hold or pacing time has passed.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        while let Some(&(due, hop)) = self.queues.timers.first()
            && due <= now
        {
            self.queues.timers.pop_first();
            self.queues
                .change(now, hop, |queue| queue.handle_timeout(now));
        }
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    pub(super) fn next_deadline(&self) -> Option<Instant> {
        self.queues.timers.first().map(|&(at, _)| at)
    }
}

/// The queues, with their schedule. Idle ones are kept for later use.
#[derive(Debug, Default)]
pub(super) struct Queues {
    pub(super) known: HashMap<Hop, HopQueue>,
    /// How many queues there were after the last sweep of idle ones.
    swept: usize,
    /// Queues with something to send, by level; each is in a list at most once.
    ready: [VecDeque<Hop>; Level::COUNT],
    /// When held or paced queues may continue.
    timers: BTreeSet<(Instant, Hop)>,
    /// The longest datagram to pack messages into; 0 if packing is off.
    longest_packed: usize,
}

impl Queues {
    /// Changes a queue, and schedules it: its turns if it has something to send, its timer if that
    /// must wait.
    fn change<T>(&mut self, now: Instant, hop: Hop, change: impl FnOnce(&mut HopQueue) -> T) -> T {
        if self.known.len() >= IDLE_QUEUES.max(2 * self.swept) && !self.known.contains_key(&hop) {
            self.known.retain(|_, queue| !queue.is_idle(now));
            self.swept = self.known.len();
        }
        let queue = self.known.entry(hop).or_default();
        let changed = change(queue);
        for level in queue.list(self.longest_packed) {
            self.ready[level.index()].push_back(hop);
        }
        self.timers.extend(queue.deadlines().map(|at| (at, hop)));
        changed
    }

    fn forget_turns(&mut self, link: LinkId) {
        self.timers.retain(|(_, hop)| hop.0 != link);
        for list in &mut self.ready {
            list.retain(|hop| hop.0 != link);
        }
    }
}

fn encode(framing: Framing, buffer: &mut BytesMut, frame: &Frame) -> Result<Bytes, EncodeError> {
    match framing {
        Framing::Judp => {
            judp::emit(frame, buffer)?;
            Ok(buffer.split().freeze())
        }
        // A slow stream keeps unsent octets, and must not keep the whole buffer alive.
        stream => stream.encode(frame),
    }
}
