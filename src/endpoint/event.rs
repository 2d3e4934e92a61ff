//! Input and output of an endpoint besides datagrams: components, outgoing messages, received
//! messages and events.

use bytes::Bytes;
use deku::ctx::Endian;
use deku::prelude::*;

use super::Path;
use crate::address::JausId;
use crate::wire::{Broadcast, Priority, Version};

/// Why a component cannot be attached.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AttachError {
    /// The id contains a zero or a wildcard.
    #[error(
        "{0} is not a single component: the subsystem must be 1 to 65534, node and component 1 to \
         254 each"
    )]
    NotOneComponent(JausId),
    /// The id is attached already.
    #[error("{0} is attached already: give each component its own id")]
    AlreadyAttached(JausId),
    /// The table is full.
    #[error("the limit of {limit} attached components is reached")]
    TooMany {
        /// [`Config::max_components`](super::Config::max_components).
        limit: usize,
    },
    /// A link cannot serve the id; the text says why.
    #[error("{0}")]
    Link(String),
}

/// Identifies a sent message in the events about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MessageHandle(pub(crate) u64);

/// A message that a local component wants to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outgoing {
    /// The sender, an attached component.
    pub source: JausId,
    /// The destination; may hold wildcards.
    pub destination: JausId,
    /// The priority.
    pub priority: Priority,
    /// The broadcast scope. `None` becomes global for a destination with wildcards.
    pub broadcast: Broadcast,
    /// Whether to request an acknowledgement; an event then reports the result.
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
    /// The sender.
    pub source: JausId,
    /// The destination as the sender wrote it.
    pub destination: JausId,
    /// The priority.
    pub priority: Priority,
    /// The broadcast scope.
    pub broadcast: Broadcast,
    /// The sequence number that the sender gave it; of a large message, that of its first fragment.
    /// `None` from a component of this node, whose messages arrive in order.
    pub sequence: Option<u16>,
    /// The message, beginning with its two code octets.
    pub payload: Bytes,
    /// The path it arrived on; `None` from a component of this node.
    pub path: Option<Path>,
    /// The local component that receives it.
    pub to: JausId,
    /// Whether its sender asked for an acknowledgement and got it, so that it does not send it again.
    pub acknowledged: bool,
}

/// An event that an endpoint reports to its owner.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event {
    /// A peer was heard for the first time, or again after it had been forgotten.
    PeerLearned {
        /// The peer.
        id: JausId,
        /// Its address.
        path: Path,
        /// The header that it uses.
        version: Version,
    },
    /// A peer has a new address; messages to it now go there.
    PeerMoved {
        /// The peer.
        id: JausId,
        /// Its old address.
        from: Path,
        /// Its new address.
        to: Path,
    },
    /// Two addresses send with one id, and a challenge did not confirm that the peer moved.
    PeerConflict {
        /// The shared id.
        id: JausId,
        /// Where messages to it go.
        path: Path,
        /// The other address.
        other: Path,
    },
    /// A peer was forgotten because the table is full:
    /// [`Limits::max_peers`](super::Limits::max_peers).
    PeerForgotten {
        /// The peer.
        id: JausId,
    },
    /// Another sender uses the id of a local component: one of the two must change.
    IdConflict {
        /// The shared id.
        id: JausId,
        /// The address of the other sender.
        path: Path,
    },
    /// A message was acknowledged as requested.
    Acknowledged {
        /// The message.
        message: MessageHandle,
        /// The receiver that acknowledged it.
        by: JausId,
    },
    /// A requested acknowledgement did not arrive, and the message will not be sent again.
    NotAcknowledged {
        /// The message.
        message: MessageHandle,
        /// What is missing, and why.
        shortfall: Shortfall,
    },
}

/// How much of a message was not acknowledged, and why.
///
/// A component process gets it from its node in this form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error, DekuRead, DekuWrite)]
#[deku(endian = "endian", ctx = "endian: Endian")]
#[error("{destination} acknowledged {acknowledged} of {length} octets: {reason}")]
pub struct Shortfall {
    /// The destination of the message.
    pub destination: JausId,
    /// Why the rest was not acknowledged.
    pub reason: Unacknowledged,
    /// How many of its octets were acknowledged: of a large message, the fragments that got
    /// through.
    pub acknowledged: u32,
    /// Its length in octets.
    pub length: u32,
}

/// Why a message was not acknowledged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, thiserror::Error, DekuRead, DekuWrite)]
#[deku(id_type = "u8", endian = "endian", ctx = "endian: Endian")]
#[non_exhaustive]
pub enum Unacknowledged {
    /// The receiver refused it (NAK).
    #[deku(id = 0)]
    #[error("refused by the receiver")]
    Refused,
    /// It was retransmitted, but not acknowledged, or not in full, in time. The receiver may have
    /// it all the same.
    #[deku(id = 1)]
    #[error("not acknowledged in time")]
    TimedOut,
    /// It was never sent, because its destination did not acknowledge the messages before it.
    #[deku(id = 2)]
    #[error("not sent: the receiver acknowledges nothing")]
    NotSent,
}
