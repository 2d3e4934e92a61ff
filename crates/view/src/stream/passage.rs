//! What passes a running node, as entries.

use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

use super::seen::Seen;
use super::{Entry, MessageStream};
use crate::Timestamp;
use jaus::address::JausId;
use jaus::endpoint::{LinkId, To};
use jaus::node::{Node, Passage, Way};
use jaus::wire::{Broadcast, Frame};

/// The links of a node by their names. It asks the node only about those that it does not know.
#[derive(Debug)]
pub struct Links {
    node: Node,
    names: BTreeMap<LinkId, String>,
}

impl Links {
    /// Those of a node.
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

    /// What a link is called.
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

    /// Whether something is for a component of the node.
    fn reaches_us(&self, id: JausId) -> bool {
        let config = self.node.config();
        let subsystem = [config.subsystem, JausId::ANY_SUBSYSTEM].contains(&id.subsystem());
        subsystem && [config.node, JausId::ANY_NODE].contains(&id.node())
    }

    /// `received`, `sent`, `local`, or `passing` for what is neither from nor for this node.
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
    /// The messages in what passed a node, beside `source` and the like with `direction`
    /// (`received`, `sent`, `local`, or `passing` for what is for others), `link` and `peer`.
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
                self.read_whole(Some(time), frame, way)
            })
            .collect()
    }

    /// Whether it was not shown before. Within the node nothing is repeated, so that a message to one
    /// is never a copy there.
    fn is_new(&mut self, way: Way, frame: &Frame, time: Timestamp) -> bool {
        let second_way = self.seen.is_second_way(way, frame, time);
        !second_way && (matches!(way, Way::Local(_)) || !self.seen.is_copy(time, frame))
    }
}

impl Seen {
    /// Whether a message to many goes by yet another way within the node: it has no number there.
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

/// With microseconds, as captures have it.
pub(crate) fn timestamp(time: SystemTime) -> Timestamp {
    // A clock before 1970 is nobody's.
    let time = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    Timestamp::new(time.as_secs() as i64, time.subsec_nanos(), 6)
}
