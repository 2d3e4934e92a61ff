//! What goes in and out of an endpoint beside datagrams: messages to send, messages received, and
//! news.

use std::fmt;

use bytes::Bytes;

use super::Path;
use crate::address::JausId;
use crate::wire::{Broadcast, Priority, Version};

/// Names a sent message in the events about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MessageHandle(pub(crate) u64);

/// A message that a local component wants to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outgoing {
    /// The sender, an attached component.
    pub source: JausId,
    /// For whom; may hold wildcards.
    pub destination: JausId,
    /// How urgent it is.
    pub priority: Priority,
    /// How far it goes. With `None`, a destination with wildcards makes it global.
    pub broadcast: Broadcast,
    /// Whether the receiver is to acknowledge it; then an event tells the result.
    pub acknowledge: bool,
    /// The message, beginning with its two code octets.
    pub payload: Bytes,
}

impl Outgoing {
    /// A message of standard priority, without acknowledgement.
    #[must_use]
    pub fn new(source: JausId, destination: JausId, payload: Bytes) -> Self {
        Self {
            source,
            destination,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            acknowledge: false,
            payload,
        }
    }
}

/// A message for a local component.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Received {
    /// Who sent it.
    pub source: JausId,
    /// For whom, as the sender wrote it.
    pub destination: JausId,
    /// How urgent it is.
    pub priority: Priority,
    /// How far it was meant to go.
    pub broadcast: Broadcast,
    /// The message, beginning with its two code octets.
    pub payload: Bytes,
    /// How it came; `None` from a component of this node.
    pub path: Option<Path>,
    /// The local component that it is for.
    pub to: JausId,
}

/// Something that the owner of an endpoint is told.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event {
    /// A peer was heard for the first time (or again, after it had been forgotten).
    PeerLearned {
        /// Who.
        id: JausId,
        /// Where.
        path: Path,
        /// The header that it writes.
        version: Version,
    },
    /// A peer is at another address than before; messages to it go there from now on.
    PeerMoved {
        /// Who.
        id: JausId,
        /// Where it was.
        from: Path,
        /// Where it is.
        to: Path,
    },
    /// An id was heard at two addresses, and a challenge has shown which of them stays its peer's.
    PeerConflict {
        /// The id that both have.
        id: JausId,
        /// Where messages to it go.
        path: Path,
        /// Where the other is.
        other: Path,
    },
    /// A peer was forgotten because more were heard than
    /// [`Config::max_peers`](super::Config::max_peers).
    PeerForgotten {
        /// Who.
        id: JausId,
    },
    /// Somebody else sends with the id of a local component: one of the two must change.
    IdConflict {
        /// The id that both have.
        id: JausId,
        /// Where the other is.
        path: Path,
    },
    /// A message that wanted it was acknowledged.
    Acknowledged {
        /// The message.
        message: MessageHandle,
        /// By whom.
        by: JausId,
    },
    /// A message that wanted it was not acknowledged, and will not be sent again.
    NotAcknowledged {
        /// The message.
        message: MessageHandle,
        /// For whom it was.
        destination: JausId,
        /// Why.
        reason: Unacknowledged,
        /// How many octets of it were acknowledged, of a large message some of its fragments.
        acknowledged: usize,
        /// How many octets it has.
        length: usize,
    },
}

/// Why a message was not acknowledged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Unacknowledged {
    /// The receiver refused it (NAK).
    Refused,
    /// It was sent, more than once, and not or not wholly acknowledged in time. The receiver may
    /// have it all the same.
    TimedOut,
    /// It never was sent, because its destination did not acknowledge what was to go before it.
    NotSent,
}

impl fmt::Display for Unacknowledged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Refused => "refused by the receiver",
            Self::TimedOut => "not acknowledged in time",
            Self::NotSent => "not sent, as the receiver acknowledges nothing",
        })
    }
}
