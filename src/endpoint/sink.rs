//! How messages leave an endpoint for the components of its owner.

use super::{Path, Received};
use crate::address::JausId;
use crate::wire::Priority;

/// Takes the messages for local components.
///
/// An endpoint asks for room before it acknowledges a message, and hands it over in the same call.
/// So nothing is acknowledged that its receiver does not get, if the sink keeps its word.
pub trait Sink {
    /// Whether a message of that priority, once handed over, stays until its component reads it.
    /// Messages that want no acknowledgement are handed over without asking, so a sink needs room
    /// in reserve for them. Without room, a message that wants an acknowledgement is not even
    /// acknowledged, so that its sender tries again.
    fn has_room(&self, to: JausId, priority: Priority) -> bool;

    /// Takes a message for the component [`Received::to`].
    fn deliver(&mut self, message: Received);
}

/// Takes all that comes.
impl Sink for Vec<Received> {
    fn has_room(&self, _: JausId, _: Priority) -> bool {
        true
    }

    fn deliver(&mut self, message: Received) {
        self.push(message);
    }
}

/// By which way a datagram came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ingress {
    /// The link, and who sent it there.
    pub path: Path,
    /// Whether it went to everybody: to the link's group, or to what it has instead.
    pub to_all: bool,
}

impl From<Path> for Ingress {
    /// A datagram to this node alone.
    fn from(path: Path) -> Self {
        Self {
            path,
            to_all: false,
        }
    }
}
