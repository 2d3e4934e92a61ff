//! Conversion of a running node's traffic to entries.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::{SystemTime, UNIX_EPOCH};

use super::seen::Seen;
use super::{Entry, MessageStream};
use crate::log::Arrival;
use crate::time::Timestamp;
use jaus::address::JausId;
use jaus::endpoint::{LinkId, Remote, To};
use jaus::node::{Node, Passage, Way};
use jaus::wire::{Broadcast, Frame};

/// Cache of a node's link names. It queries the node only for unknown links.
#[derive(Debug)]
pub struct Links {
    node: Node,
    names: BTreeMap<LinkId, String>,
}

impl Links {
    /// Creates an empty cache for a node.
    #[must_use]
    pub const fn of(node: Node) -> Self {
        Self {
            node,
            names: BTreeMap::new(),
        }
    }

    /// The node.
    #[must_use]
    pub const fn node(&self) -> &Node {
        &self.node
    }

    /// The name of a link.
    pub fn name(&mut self, link: LinkId) -> &str {
        let node = &self.node;
        self.names
            .entry(link)
            .or_insert_with(|| node.link_name(link).unwrap_or_else(|| "a link".to_owned()))
    }

    fn is_own(&self, id: JausId) -> bool {
        let config = self.node.config();
        (id.subsystem(), id.node()) == (config.subsystem, config.node)
    }

    /// Whether a message is addressed to a component of the node.
    fn reaches_us(&self, id: JausId) -> bool {
        let config = self.node.config();
        let subsystem = [config.subsystem, JausId::ANY_SUBSYSTEM].contains(&id.subsystem());
        subsystem && [config.node, JausId::ANY_NODE].contains(&id.node())
    }

    /// `received`, `sent`, `local`, or `passing` for messages neither from nor for this node.
    fn direction(&self, way: Way, frame: &Frame) -> &'static str {
        match way {
            Way::Local(_) => "local",
            _ if self.is_own(frame.source) => "sent",
            Way::In(_) if self.reaches_us(frame.destination) => "received",
            _ => "passing",
        }
    }
}

impl MessageStream<'_> {
    /// The messages of a passage. In addition to `source` and similar keys, they have `direction`
    /// (`received`, `sent`, `local`, or `passing` for routed messages), `link` and `peer`.
    pub fn read_passage(&mut self, passage: &Passage, links: &mut Links) -> Vec<Entry> {
        let time = timestamp(passage.time);
        let frames = passage.frames();
        frames
            .iter()
            .filter_map(|frame| {
                if !self.is_new(passage.way, frame, time) {
                    return None;
                }
                let way = way_in_words(passage.way, frame, links);
                let arrival = Arrival {
                    time: Some(time),
                    from: sender(passage.way),
                };
                self.read_whole(arrival, frame, way)
            })
            .collect()
    }

    /// Whether the frame has not been shown before. Nothing is repeated within the node, so a local
    /// message to a single destination is never a duplicate.
    fn is_new(&mut self, way: Way, frame: &Frame, time: Timestamp) -> bool {
        let second_way = self.seen.is_second_way(way, frame, time);
        !second_way && (matches!(way, Way::Local(_)) || !self.seen.is_copy(time, frame))
    }
}

impl Seen {
    /// Whether a multicast or broadcast takes a further path within the node, where it has no
    /// sequence number.
    pub(crate) fn is_second_way(&mut self, way: Way, frame: &Frame, time: Timestamp) -> bool {
        let for_many =
            frame.destination.has_wildcard() || frame.flags.broadcast() != Some(Broadcast::None);
        if !for_many {
            return false;
        }
        let known = self.is_copy_for_many(time, frame);
        matches!(way, Way::Local(_)) && known
    }
}

/// The network address that a passage comes from.
fn sender(way: Way) -> Option<IpAddr> {
    match way {
        Way::In(path) => match path.peer {
            Remote::Socket(address) => Some(address.ip()),
            _ => None,
        },
        _ => None,
    }
}

fn way_in_words(way: Way, frame: &Frame, links: &mut Links) -> Vec<(&'static str, String)> {
    let mut words = vec![("direction", links.direction(way, frame).to_owned())];
    let (link, peer) = match way {
        Way::In(path) => (path.link, path.peer.to_string()),
        Way::Out(link, To::Peer(peer)) => (link, peer.to_string()),
        Way::Out(link, To::Group) => (link, "group".to_owned()),
        Way::Local(_) => return words,
    };
    words.push(("link", links.name(link).to_owned()));
    words.push(("peer", peer));
    words
}

/// Converts a time to microsecond resolution, as in captures.
pub(crate) fn timestamp(time: SystemTime) -> Timestamp {
    // Clocks before 1970 do not occur in practice.
    let time = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    Timestamp::since_1970(time, 6)
}
