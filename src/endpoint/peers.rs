//! Who is where: addresses learned from what peers send, and configured ones.

use std::collections::BTreeMap;
use std::time::Instant;

use super::{LinkId, Path, StaticPeer};
use crate::address::JausId;
use crate::wire::Version;

/// A peer whose address was learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Peer {
    /// Who.
    pub id: JausId,
    /// Where: the source of its latest valid message for us.
    pub path: Path,
    /// The header of that message. What we send to it has the same.
    pub version: Version,
    /// When that message came.
    pub last_heard: Instant,
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
}

/// The table of peers.
#[derive(Debug)]
pub(super) struct Peers {
    learned: BTreeMap<JausId, Peer>,
    configured: Vec<StaticPeer>,
    limit: usize,
}

impl Peers {
    pub(super) fn new(limit: usize, configured: Vec<StaticPeer>) -> Self {
        Self {
            learned: BTreeMap::new(),
            configured,
            limit: limit.max(1),
        }
    }

    pub(super) fn configure(&mut self, peers: Vec<StaticPeer>) {
        self.configured = peers;
    }

    /// Takes note of where a message came from. The latest word counts; a full table forgets whom
    /// it heard longest ago.
    pub(super) fn learn(&mut self, peer: Peer) -> Learned {
        if let Some(known) = self.learned.get_mut(&peer.id) {
            let from = known.path;
            *known = peer;
            return if from == peer.path {
                Learned::Known
            } else {
                Learned::Moved { from }
            };
        }
        let evicted = if self.learned.len() >= self.limit {
            self.evict()
        } else {
            None
        };
        self.learned.insert(peer.id, peer);
        Learned::New { evicted }
    }

    fn evict(&mut self) -> Option<JausId> {
        let oldest = self.learned.values().min_by_key(|peer| peer.last_heard)?.id;
        self.forget(oldest);
        Some(oldest)
    }

    /// Where and with which header to reach `id`, if known. A configured address goes before a
    /// learned one, and that before a configured pattern.
    pub(super) fn route(&self, id: JausId) -> Option<(Path, Version)> {
        let configured = |exact: bool| {
            let applies =
                move |peer: &&StaticPeer| peer.id.is_unicast() == exact && peer.id.matches(id);
            self.configured.iter().find(applies).map(|peer| peer.path)
        };
        let learned = self.learned.get(&id);
        let path = configured(true)
            .or(learned.map(|peer| peer.path))
            .or_else(|| configured(false))?;
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
        self.learned.retain(|_, peer| peer.path.link != link);
    }

    pub(super) fn forget_path(&mut self, path: Path) {
        self.learned.retain(|_, peer| peer.path != path);
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = Peer> + '_ {
        self.learned.values().copied()
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
