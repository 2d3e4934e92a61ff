//! Who is where: addresses learned from what peers send, and configured ones.
//!
//! The table is bounded. When it is full, who was only heard goes first, then whom we have spoken
//! to, then who has acknowledged something of ours; among equals the one heard longest ago. Those
//! in conversation with us stay as long as they are heard now and then: if nobody else can go, a
//! newcomer is not taken in. So invented ids replace each other.

use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

use super::{Config, LinkId, Path, StaticPeer};
use crate::address::JausId;
use crate::peer::{self, Assignment, LargeStyle, Recogniser};
use crate::wire::{Frame, Version};

/// A peer whose address was learned, and what was counted about it since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Peer {
    /// Who.
    pub id: JausId,
    /// Where: the source of its latest valid message. Peers behind a router have its address.
    pub path: Path,
    /// The header of that message. What we send to it has the same.
    pub version: Version,
    /// When the first message came.
    pub first_heard: Instant,
    /// When the latest message came.
    pub last_heard: Instant,
    /// What it is: what was configured, or what it was recognised as for sure.
    pub profile: peer::Peer,
    /// Messages from it, fragments and acknowledgements among them, without duplicates.
    pub received: Traffic,
    /// Messages that components of ours sent to it alone.
    pub sent: Traffic,
    /// Messages of it that came more than once.
    pub duplicates: u64,
    /// How often something was sent to it again for want of an acknowledgement.
    pub retransmissions: u64,
    /// Messages to it that were given up for want of an acknowledgement.
    pub lost: u64,
    /// The smoothed time between sending something to it and its acknowledgement; `None` before the
    /// first measurement.
    pub round_trip: Option<Duration>,
}

/// Messages and their octets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// How many messages.
    pub messages: u64,
    /// Octets of their payloads.
    pub octets: u64,
}

impl Traffic {
    fn add(&mut self, octets: usize) {
        self.messages += 1;
        self.octets += octets as u64;
    }
}

/// What [`Peers::learn`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Learned {
    /// Nothing new.
    Known,
    /// A peer not known before; another may have been forgotten for it.
    New { evicted: Option<JausId> },
    /// A peer that was elsewhere before.
    Moved { from: Path },
    /// A peer not known before, for which there is no room.
    NoRoom,
}

/// What we have had to do with a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Standing {
    Heard,
    SpokenTo,
    Answered,
}

impl Standing {
    const ALL: [Self; 3] = [Self::Heard, Self::SpokenTo, Self::Answered];

    /// How long a peer must have been silent to be forgotten for a newcomer.
    const fn silence(self) -> Duration {
        match self {
            Self::Heard => Duration::ZERO,
            Self::SpokenTo => Duration::from_secs(5),
            Self::Answered => Duration::from_secs(60),
        }
    }
}

#[derive(Debug)]
struct Known {
    peer: Peer,
    standing: Standing,
    /// Its place in the queue of its standing; older places are stale.
    place: u64,
    /// Its latest sequence number, counted on over all rounds.
    latest: u32,
    /// Who it is.
    recogniser: Recogniser,
}

/// Somebody's place in a queue for being forgotten.
#[derive(Clone, Copy, Debug)]
struct Place {
    id: JausId,
    number: u64,
    /// When it was heard last before it was put here.
    heard: Instant,
}

/// The table of peers.
#[derive(Debug)]
pub(super) struct Peers {
    learned: HashMap<JausId, Known>,
    /// For each standing, about in the order in which they were heard last.
    queues: [VecDeque<Place>; Standing::ALL.len()],
    places: u64,
    configured: Vec<StaticPeer>,
    /// Those of the configured that are one component.
    fixed: HashMap<JausId, Path>,
    assigned: Vec<Assignment>,
    limit: usize,
}

impl Peers {
    pub(super) fn new(config: &Config) -> Self {
        let mut peers = Self {
            learned: HashMap::new(),
            queues: Default::default(),
            places: 0,
            configured: Vec::new(),
            fixed: HashMap::new(),
            assigned: config.profiles.clone(),
            limit: config.max_peers.max(1),
        };
        peers.configure(config.static_peers.clone());
        peers
    }

    pub(super) fn configure(&mut self, peers: Vec<StaticPeer>) {
        let fixed = peers.iter().rev().filter(|peer| peer.id.is_unicast());
        self.fixed = fixed.map(|peer| (peer.id, peer.path)).collect();
        self.configured = peers;
    }

    pub(super) fn len(&self) -> usize {
        self.learned.len()
    }

    pub(super) fn knows(&self, id: JausId) -> bool {
        self.learned.contains_key(&id)
    }

    /// Whether we have neither spoken to a peer nor been answered by it.
    pub(super) fn is_stranger(&self, id: JausId) -> bool {
        let known = self.learned.get(&id);
        known.is_none_or(|known| known.standing == Standing::Heard)
    }

    /// Where and when it was heard last.
    pub(super) fn last_heard(&self, id: JausId) -> Option<(Path, Instant)> {
        let peer = &self.learned.get(&id)?.peer;
        Some((peer.path, peer.last_heard))
    }

    /// Where on a link somebody was heard, each once or more.
    pub(super) fn paths_on(&self, link: LinkId) -> impl Iterator<Item = Path> + '_ {
        let paths = self.learned.values().map(|known| known.peer.path);
        paths.filter(move |path| path.link == link)
    }

    /// Takes note of where a message came from. The latest word counts, but for a configured
    /// address.
    pub(super) fn learn(&mut self, now: Instant, from: Path, frame: &Frame) -> Learned {
        let path = self.fixed.get(&frame.source).copied().unwrap_or(from);
        let (version, octets) = (frame.version, frame.payload.len());
        let number = self.counted_on(frame);
        if let Some(known) = self.learned.get_mut(&frame.source) {
            if number.wrapping_sub(known.latest) as i32 > 0 {
                known.latest = number;
            }
            known.recogniser.handle_frame(frame, 0);
            let peer = &mut known.peer;
            peer.received.add(octets);
            (peer.version, peer.last_heard) = (version, now);
            let from = std::mem::replace(&mut peer.path, path);
            return if from == path {
                Learned::Known
            } else {
                Learned::Moved { from }
            };
        }
        let evicted = if self.learned.len() >= self.limit {
            let Some(evicted) = self.evict(now) else {
                return Learned::NoRoom;
            };
            Some(evicted)
        } else {
            None
        };
        let mut received = Traffic::default();
        received.add(octets);
        let peer = Peer {
            id: frame.source,
            path,
            version,
            first_heard: now,
            last_heard: now,
            profile: peer::Peer::Standard,
            received,
            sent: Traffic::default(),
            duplicates: 0,
            retransmissions: 0,
            lost: 0,
            round_trip: None,
        };
        let mut recogniser = Recogniser::new();
        recogniser.handle_frame(frame, 0);
        let known = Known {
            peer,
            standing: Standing::Heard,
            place: 0,
            latest: number,
            recogniser,
        };
        self.learned.insert(peer.id, known);
        self.queue_up(peer.id);
        Learned::New { evicted }
    }

    /// What a peer is: what was configured, or what it was recognised as for sure.
    pub(super) fn profile(&self, id: JausId) -> peer::Peer {
        let recognised = || {
            self.learned
                .get(&id)
                .map(|known| known.recogniser.certain())
        };
        let assigned = Assignment::find(&self.assigned, id);
        assigned.or_else(recognised).unwrap_or_default()
    }

    /// The same, or what it may be taken for where it does little harm if it is something else.
    pub(super) fn presumed(&self, id: JausId) -> peer::Peer {
        let recognised = || {
            self.learned
                .get(&id)
                .map(|known| known.recogniser.presumed())
        };
        let assigned = Assignment::find(&self.assigned, id);
        assigned.or_else(recognised).unwrap_or_default()
    }

    /// Whether a peer is better not answered on the TCP connections that it opened: for sure, or by
    /// the habit that makes it so.
    pub(super) fn is_deaf_on_its_connections(&self, id: JausId) -> bool {
        let is_by_habit = || {
            let known = self.learned.get(&id);
            known.is_some_and(|known| known.recogniser.repeats_version())
        };
        let assigned = Assignment::find(&self.assigned, id);
        self.profile(id).is_deaf_on_its_connections() || assigned.is_none() && is_by_habit()
    }

    /// How a peer cuts large messages, if that is known. Who is configured to be no particular peer
    /// keeps to the standard.
    pub(super) fn large_style(&self, id: JausId) -> Option<LargeStyle> {
        let style = self.profile(id).large_style();
        let assigned = || Assignment::find(&self.assigned, id);
        style.or_else(|| assigned().map(|_| LargeStyle::Standard))
    }

    /// Something else about a peer than a frame that was taken may tell who it is.
    pub(super) fn recognise(&mut self, id: JausId, by: impl FnOnce(&mut Recogniser)) {
        if let Some(known) = self.learned.get_mut(&id) {
            by(&mut known.recogniser);
        }
    }

    /// The round of its sequence numbers in which a sender is with this frame.
    pub(super) fn round(&self, frame: &Frame) -> u16 {
        (self.counted_on(frame) >> 16) as u16
    }

    /// The frame's sequence number, counted on over all rounds: of the numbers that it can stand
    /// for the one nearest to the sender's latest.
    fn counted_on(&self, frame: &Frame) -> u32 {
        const FIRST_ROUND: u32 = 1 << 16;
        let known = self.learned.get(&frame.source);
        let latest = known.map_or(FIRST_ROUND | u32::from(frame.sequence), |known| {
            known.latest
        });
        let ahead = frame.sequence.wrapping_sub(latest as u16) as i16;
        latest.wrapping_add_signed(ahead.into())
    }

    /// Puts a peer at the end of the queue of its standing.
    fn queue_up(&mut self, id: JausId) {
        let Some(known) = self.learned.get_mut(&id) else {
            return;
        };
        self.places += 1;
        known.place = self.places;
        let place = Place {
            id,
            number: self.places,
            heard: known.peer.last_heard,
        };
        let queue = &mut self.queues[known.standing as usize];
        queue.push_back(place);
        if queue.len() > 2 * self.limit {
            let is_valid = |place: &Place| {
                let known = self.learned.get(&place.id);
                known.is_some_and(|known| known.place == place.number)
            };
            queue.retain(is_valid);
        }
    }

    /// Forgets somebody for a newcomer, if somebody can go.
    fn evict(&mut self, now: Instant) -> Option<JausId> {
        let id = Standing::ALL
            .into_iter()
            .find_map(|standing| self.oldest(now, standing))?;
        self.forget(id);
        Some(id)
    }

    /// Whether somebody is known or could be: there is room, or somebody can go.
    pub(super) fn has_room_for(&mut self, now: Instant, id: JausId) -> bool {
        self.knows(id)
            || self.learned.len() < self.limit
            || Standing::ALL
                .into_iter()
                .any(|standing| self.oldest(now, standing).is_some())
    }

    /// Who of a queue was heard longest ago, if that is long enough. Who was heard since
    /// it queued up goes to the end again; so a look costs no more than was heard.
    fn oldest(&mut self, now: Instant, standing: Standing) -> Option<JausId> {
        loop {
            let place = self.queues[standing as usize].pop_front()?;
            let Some(known) = self.learned.get(&place.id) else {
                continue;
            };
            if known.place != place.number {
                continue;
            }
            let heard = known.peer.last_heard;
            if heard > place.heard {
                self.queue_up(place.id);
                continue;
            }
            let id = place.id;
            self.queues[standing as usize].push_front(place);
            let silent = now.saturating_duration_since(heard) >= standing.silence();
            return silent.then_some(id);
        }
    }

    fn raise(&mut self, id: JausId, standing: Standing) {
        if let Some(known) = self.learned.get_mut(&id)
            && known.standing < standing
        {
            known.standing = standing;
            self.queue_up(id);
        }
    }

    /// A component of ours sent `octets` to it alone.
    pub(super) fn note_sent(&mut self, id: JausId, octets: usize) {
        if let Some(known) = self.learned.get_mut(&id) {
            known.peer.sent.add(octets);
            self.raise(id, Standing::SpokenTo);
        }
    }

    /// It has acknowledged something of ours.
    pub(super) fn note_answer(&mut self, id: JausId) {
        self.raise(id, Standing::Answered);
    }

    pub(super) fn note_duplicate(&mut self, id: JausId) {
        self.note(id, |peer| peer.duplicates += 1);
    }

    /// Something is sent to it again.
    pub(super) fn note_retransmission(&mut self, id: JausId) {
        self.note(id, |peer| peer.retransmissions += 1);
    }

    /// A message to it was given up.
    pub(super) fn note_lost(&mut self, id: JausId) {
        self.note(id, |peer| peer.lost += 1);
    }

    fn note(&mut self, id: JausId, change: impl FnOnce(&mut Peer)) {
        if let Some(known) = self.learned.get_mut(&id) {
            change(&mut known.peer);
        }
    }

    /// Where and with which header to reach `id`, if known. A configured address goes before a
    /// learned one, and that before a configured pattern.
    pub(super) fn route(&self, id: JausId) -> Option<(Path, Version)> {
        let learned = self.learned.get(&id).map(|known| &known.peer);
        let by_pattern = || {
            let applies = |peer: &&StaticPeer| !peer.id.is_unicast() && peer.id.matches(id);
            self.configured.iter().find(applies).map(|peer| peer.path)
        };
        let fixed = self.fixed.get(&id).copied();
        let path = fixed
            .or(learned.map(|peer| peer.path))
            .or_else(by_pattern)?;
        Some((path, learned.map_or(Version::As5669a, |peer| peer.version)))
    }

    /// The addresses that get a copy of a broadcast to `destination`.
    pub(super) fn broadcast_copies(&self, destination: JausId) -> Vec<Path> {
        let reached = |peer: &&StaticPeer| peer.gets_broadcasts && overlap(peer.id, destination);
        self.configured
            .iter()
            .filter(reached)
            .map(|peer| peer.path)
            .collect()
    }

    pub(super) fn forget(&mut self, id: JausId) {
        self.learned.remove(&id);
    }

    pub(super) fn forget_link(&mut self, link: LinkId) {
        self.learned.retain(|_, known| known.peer.path.link != link);
    }

    pub(super) fn forget_path(&mut self, path: Path) {
        self.learned.retain(|_, known| known.peer.path != path);
    }

    /// All of them, in order of their ids.
    pub(super) fn iter(&self) -> impl Iterator<Item = Peer> + '_ {
        let peers = self.learned.values().map(|known| Peer {
            profile: self.profile(known.peer.id),
            ..known.peer
        });
        let mut peers: Vec<_> = peers.collect();
        peers.sort_unstable_by_key(|peer| peer.id);
        peers.into_iter()
    }
}

/// Whether two ids, each of which may hold wildcards, have a component in common.
fn overlap(one: JausId, other: JausId) -> bool {
    let subsystem = one.subsystem() == other.subsystem()
        || [one.subsystem(), other.subsystem()].contains(&JausId::ANY_SUBSYSTEM);
    let node = one.node() == other.node() || [one.node(), other.node()].contains(&JausId::ANY_NODE);
    let component = one.component() == other.component()
        || [one.component(), other.component()].contains(&JausId::ANY_COMPONENT);
    subsystem && node && component
}
