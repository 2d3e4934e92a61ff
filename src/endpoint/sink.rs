//! The sink: how an endpoint delivers messages to local components.

use std::time::Instant;

use super::{Path, Received};
use crate::address::JausId;
use crate::wire::Priority;

/// Receives the messages for local components.
///
/// An endpoint asks for room before it acknowledges a message, and delivers it in the same call. So
/// every acknowledged message reaches its receiver, provided that the sink keeps its promise.
pub trait Sink {
    /// Whether a message of that priority, once delivered, is kept until its component reads it.
    /// Messages without acknowledgement request are delivered without asking, so a sink needs spare
    /// room for them. Without room, a message that requests an acknowledgement is not acknowledged,
    /// so that its sender retries.
    fn has_room(&self, to: JausId, priority: Priority) -> bool;

    /// Delivers a message to the component [`Received::to`]. One that was
    /// [acknowledged](Received::acknowledged) must stay until it is read, whatever comes later.
    fn deliver(&mut self, message: Received);

    /// Notes that a part of a large message from `source` has arrived, which is not complete yet.
    fn progress(&mut self, now: Instant, source: JausId, to: JausId) {
        let _ = (now, source, to);
    }
}

/// Accepts every message.
impl Sink for Vec<Received> {
    fn has_room(&self, _: JausId, _: Priority) -> bool {
        true
    }

    fn deliver(&mut self, message: Received) {
        self.push(message);
    }
}

/// How a datagram arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ingress {
    /// The link, and the sender's address on it.
    pub path: Path,
    /// Whether it was sent to all: to the link's group or its equivalent.
    pub to_all: bool,
}

impl From<Path> for Ingress {
    /// A datagram sent to this node alone.
    fn from(path: Path) -> Self {
        Self {
            path,
            to_all: false,
        }
    }
}
