//! What a component process and its host's node say to each other, as octets.
//!
//! Each record is a length (four octets, of what follows), a kind (one octet) and a body; numbers
//! are little-endian, as everywhere in JAUS. The component begins with [`Request::Hello`], and the
//! node answers with [`Reply::Welcome`] or [`Reply::Refused`]; then either side speaks when it has
//! something to say. The format is private to one release line: `Hello` carries its
//! [version](VERSION), and another version is refused.
//!
//! ```text
//! length u32 | kind u8 | body
//!   Hello            'JAUS' version u8, tag u8, id u32 or component u8, name
//!   Send             flags u8, handle u64, destination u32, message
//!   Leave
//!   Welcome          id u32, longest message u32
//!   Refused          reason u8, words
//!   Deliver          flags u8, source u32, destination u32, path, message
//!   Acknowledged     handle u64, by u32
//!   NotAcknowledged  handle u64, destination u32, reason u8, acknowledged u32, length u32
//!   Rejected         handle u64, words
//! ```

mod decode;
mod encode;

use bytes::Bytes;

use crate::address::JausId;
use crate::endpoint::{Path, Unacknowledged};
use crate::wire::{Broadcast, Priority};

/// The version of the format.
pub const VERSION: u8 = 1;
/// Octets of the length in front of each record.
pub const LENGTH: usize = 4;
/// The longest message that a record carries, in octets.
pub const LONGEST_MESSAGE: usize = 16 << 20;
/// The longest record without its length: a message, and what goes before it.
pub const LONGEST: usize = LONGEST_MESSAGE + 64;
/// The longest record that a node reads before it knows who speaks.
pub const LONGEST_HELLO: usize = 512;

const MAGIC: [u8; 4] = *b"JAUS";

/// What a component says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Its first word: who it wants to be.
    Hello(Hello),
    /// A message to send.
    Send(Send),
    /// It goes, on purpose.
    Leave,
}

/// What a node says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// The component is attached.
    Welcome(Welcome),
    /// The component is not attached.
    Refused(Refusal),
    /// A message for the component.
    Deliver(Delivery),
    /// A message was acknowledged.
    Acknowledged {
        /// The component's number for it.
        handle: u64,
        /// By whom.
        by: JausId,
    },
    /// A message was not acknowledged, and will not be sent again.
    NotAcknowledged {
        /// The component's number for it.
        handle: u64,
        /// For whom it was.
        destination: JausId,
        /// Why not.
        reason: Unacknowledged,
        /// Octets of it that were acknowledged.
        acknowledged: u32,
        /// Octets of it in all.
        length: u32,
    },
    /// The node would not send a message.
    Rejected {
        /// The component's number for it.
        handle: u64,
        /// Why not, in the node's words.
        words: String,
    },
}

/// Who wants to attach.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hello {
    /// The version of the format that it speaks.
    pub version: u8,
    /// The id that it wants.
    pub want: Want,
    /// What it calls itself, for people. At most 255 octets are kept.
    pub name: String,
}

/// The id that a component wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Want {
    /// This number in the host's node, whatever the node's id is.
    Component(u8),
    /// This id and no other.
    Id(JausId),
}

/// What an attached component must know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Welcome {
    /// Its id.
    pub id: JausId,
    /// The longest message that the node sends or receives, in octets.
    pub max_message: u32,
}

/// Why a component was not attached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// For programs.
    pub reason: Reason,
    /// For people.
    pub words: String,
}

/// The kinds of [`Refusal`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Reason {
    /// The node speaks another version of the format.
    Version,
    /// The id is somebody else's.
    Taken,
    /// The id belongs to another subsystem or node, or names no single component.
    WrongId,
    /// The node has as many components as it may have.
    TooMany,
    /// The node is about to stop.
    Stopping,
    /// Something that a later version knows.
    Other(u8),
}

/// A message from a component. Its source is the component that the connection belongs to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Send {
    /// The component's number for it, by which outcomes name it.
    pub handle: u64,
    /// For whom; may hold wildcards.
    pub destination: JausId,
    /// How urgent it is.
    pub priority: Priority,
    /// How far it goes.
    pub broadcast: Broadcast,
    /// Whether the receiver is to acknowledge it.
    pub acknowledge: bool,
    /// The message, beginning with its two code octets.
    pub payload: Bytes,
}

/// A message for the component that the connection belongs to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// Who sent it.
    pub source: JausId,
    /// For whom, as the sender wrote it.
    pub destination: JausId,
    /// How urgent it is.
    pub priority: Priority,
    /// How far it was meant to go.
    pub broadcast: Broadcast,
    /// How it came to the node; `None` from a component of the same node.
    pub path: Option<Path>,
    /// The message, beginning with its two code octets.
    pub payload: Bytes,
}

/// What is wrong with a record. The connection ends with it: after octets that were misunderstood
/// nothing can be understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// More than anything can have.
    #[error("a record of {length} octets, and at most {limit} can be")]
    TooLong {
        /// Octets that its head announces.
        length: usize,
        /// The most that can be.
        limit: usize,
    },
    /// It ends before its fields do, or goes on after them.
    #[error("a record of kind {kind} whose {length} octets are too few or too many")]
    Length {
        /// Its kind.
        kind: u8,
        /// Octets of its body.
        length: usize,
    },
    /// A kind that this side is never told.
    #[error("a record of kind {0}, which is not known here")]
    Kind(u8),
    /// A value that its field cannot have.
    #[error("a record of kind {kind} with the value {value} where it cannot be")]
    Value {
        /// The record's kind.
        kind: u8,
        /// The value.
        value: u8,
    },
    /// What speaks there is no component of ours.
    #[error("the other side does not speak this protocol: it does not begin with a greeting")]
    Stranger,
}

/// The kinds of records, as their octet says them.
mod kind {
    pub(super) const HELLO: u8 = 1;
    pub(super) const SEND: u8 = 2;
    pub(super) const LEAVE: u8 = 3;
    pub(super) const WELCOME: u8 = 17;
    pub(super) const REFUSED: u8 = 18;
    pub(super) const DELIVER: u8 = 19;
    pub(super) const ACKNOWLEDGED: u8 = 20;
    pub(super) const NOT_ACKNOWLEDGED: u8 = 21;
    pub(super) const REJECTED: u8 = 22;
}

/// Where a message came from, as a field of its flags.
mod place {
    pub(super) const NOWHERE: u8 = 0;
    pub(super) const LINE: u8 = 1;
    pub(super) const IPV4: u8 = 2;
    pub(super) const IPV6: u8 = 3;
}

/// Words for people, and no more than they like to read: 255 octets, up to a whole character.
fn cut(words: &str) -> &str {
    let mut end = words.len().min(255);
    while !words.is_char_boundary(end) {
        end -= 1;
    }
    &words[..end]
}
