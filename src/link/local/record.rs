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

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV6};

use bytes::{BufMut, Bytes};

use super::Body;
use crate::address::JausId;
use crate::endpoint::{LinkId, Path, Remote};
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
        reason: Silence,
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

/// Why a message was not acknowledged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Silence {
    /// Nothing was heard in time.
    TimedOut,
    /// The receiver refused it (NAK).
    Refused,
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

const HELLO: u8 = 1;
const SEND: u8 = 2;
const LEAVE: u8 = 3;
const WELCOME: u8 = 17;
const REFUSED: u8 = 18;
const DELIVER: u8 = 19;
const ACKNOWLEDGED: u8 = 20;
const NOT_ACKNOWLEDGED: u8 = 21;
const REJECTED: u8 = 22;

impl Request {
    /// Reads a record.
    ///
    /// # Errors
    /// [`RecordError`] says what cannot be read.
    pub fn decode(body: &Body<'_>) -> Result<Self, RecordError> {
        let mut fields = Fields::new(body)?;
        let request = match fields.kind {
            SEND => Self::Send(fields.send()?),
            HELLO => Self::Hello(fields.hello()?),
            LEAVE => Self::Leave,
            kind => return Err(RecordError::Kind(kind)),
        };
        fields.end()?;
        Ok(request)
    }

    /// Writes the record, all but the payload of a [`Send`](Self::Send), which follows as it is and
    /// which this returns.
    pub fn encode_head(&self, to: &mut Vec<u8>) -> Option<&Bytes> {
        match self {
            Self::Hello(hello) => write(to, HELLO, 0, |to| put_hello(to, hello)),
            Self::Send(send) => {
                let length = send.payload.len();
                write(to, SEND, length, |to| put_send(to, send));
                return Some(&send.payload);
            }
            Self::Leave => write(to, LEAVE, 0, |_| {}),
        }
        None
    }
}

impl Reply {
    /// Reads a record.
    ///
    /// # Errors
    /// [`RecordError`] says what cannot be read.
    pub fn decode(body: &Body<'_>) -> Result<Self, RecordError> {
        let mut fields = Fields::new(body)?;
        let reply = match fields.kind {
            DELIVER => Self::Deliver(fields.delivery()?),
            WELCOME => Self::Welcome(Welcome {
                id: fields.id()?,
                max_message: fields.u32()?,
            }),
            REFUSED => Self::Refused(Refusal {
                reason: Reason::from_code(fields.u8()?),
                words: fields.words(),
            }),
            ACKNOWLEDGED => Self::Acknowledged {
                handle: fields.u64()?,
                by: fields.id()?,
            },
            NOT_ACKNOWLEDGED => Self::NotAcknowledged {
                handle: fields.u64()?,
                destination: fields.id()?,
                reason: Silence::from_code(fields.u8()?),
                acknowledged: fields.u32()?,
                length: fields.u32()?,
            },
            REJECTED => Self::Rejected {
                handle: fields.u64()?,
                words: fields.words(),
            },
            kind => return Err(RecordError::Kind(kind)),
        };
        fields.end()?;
        Ok(reply)
    }

    /// Writes the record, all but the payload of a [`Deliver`](Self::Deliver), which follows as it
    /// is and which this returns.
    pub fn encode_head(&self, to: &mut Vec<u8>) -> Option<&Bytes> {
        match self {
            Self::Deliver(delivery) => {
                let length = delivery.payload.len();
                write(to, DELIVER, length, |to| put_delivery(to, delivery));
                return Some(&delivery.payload);
            }
            Self::Welcome(welcome) => write(to, WELCOME, 0, |to| {
                to.put_u32_le(welcome.id.to_u32());
                to.put_u32_le(welcome.max_message);
            }),
            Self::Refused(refusal) => write(to, REFUSED, 0, |to| {
                to.put_u8(refusal.reason.code());
                put_words(to, &refusal.words);
            }),
            Self::Acknowledged { handle, by } => write(to, ACKNOWLEDGED, 0, |to| {
                to.put_u64_le(*handle);
                to.put_u32_le(by.to_u32());
            }),
            Self::NotAcknowledged {
                handle,
                destination,
                reason,
                acknowledged,
                length,
            } => write(to, NOT_ACKNOWLEDGED, 0, |to| {
                to.put_u64_le(*handle);
                to.put_u32_le(destination.to_u32());
                to.put_u8(reason.code());
                to.put_u32_le(*acknowledged);
                to.put_u32_le(*length);
            }),
            Self::Rejected { handle, words } => write(to, REJECTED, 0, |to| {
                to.put_u64_le(*handle);
                put_words(to, words);
            }),
        }
        None
    }
}

impl Reason {
    const fn code(self) -> u8 {
        match self {
            Self::Version => 1,
            Self::Taken => 2,
            Self::WrongId => 3,
            Self::TooMany => 4,
            Self::Stopping => 5,
            Self::Other(code) => code,
        }
    }

    const fn from_code(code: u8) -> Self {
        match code {
            1 => Self::Version,
            2 => Self::Taken,
            3 => Self::WrongId,
            4 => Self::TooMany,
            5 => Self::Stopping,
            code => Self::Other(code),
        }
    }
}

impl Silence {
    const fn code(self) -> u8 {
        match self {
            Self::TimedOut => 1,
            Self::Refused => 2,
            Self::Other(code) => code,
        }
    }

    const fn from_code(code: u8) -> Self {
        match code {
            1 => Self::TimedOut,
            2 => Self::Refused,
            code => Self::Other(code),
        }
    }
}

/// Writes length, kind and what `body` writes; `payload` octets will follow.
fn write(to: &mut Vec<u8>, kind: u8, payload: usize, body: impl FnOnce(&mut Vec<u8>)) {
    let start = to.len();
    to.extend_from_slice(&[0; LENGTH]);
    to.push(kind);
    body(to);
    // Payloads are bounded where they are sent; what could not be is cut short nowhere else.
    let length = u32::try_from(to.len() - start - LENGTH + payload).unwrap_or(u32::MAX);
    if let Some(head) = to.get_mut(start..start + LENGTH) {
        head.copy_from_slice(&length.to_le_bytes());
    }
}

fn put_hello(to: &mut Vec<u8>, hello: &Hello) {
    to.extend_from_slice(&MAGIC);
    to.push(hello.version);
    match hello.want {
        Want::Component(number) => to.extend_from_slice(&[0, number]),
        Want::Id(id) => {
            to.push(1);
            to.put_u32_le(id.to_u32());
        }
    }
    put_words(to, &hello.name);
}

fn put_send(to: &mut Vec<u8>, send: &Send) {
    let acknowledge = u8::from(send.acknowledge) << 4;
    to.push(flags(send.priority, send.broadcast) | acknowledge);
    to.put_u64_le(send.handle);
    to.put_u32_le(send.destination.to_u32());
}

fn put_delivery(to: &mut Vec<u8>, delivery: &Delivery) {
    let place = match delivery.path.map(|path| path.peer) {
        None => NOWHERE,
        Some(Remote::Line) => LINE,
        Some(Remote::Socket(SocketAddr::V4(_))) => IPV4,
        Some(Remote::Socket(SocketAddr::V6(_))) => IPV6,
    };
    to.push(flags(delivery.priority, delivery.broadcast) | place << 4);
    to.put_u32_le(delivery.source.to_u32());
    to.put_u32_le(delivery.destination.to_u32());
    let Some(path) = delivery.path else { return };
    to.put_u16_le(path.link.0);
    let Remote::Socket(address) = path.peer else {
        return;
    };
    match address.ip() {
        IpAddr::V4(ip) => to.extend_from_slice(&ip.octets()),
        IpAddr::V6(ip) => to.extend_from_slice(&ip.octets()),
    }
    to.put_u16_le(address.port());
    if let SocketAddr::V6(address) = address {
        to.put_u32_le(address.scope_id());
    }
}

fn put_words(to: &mut Vec<u8>, words: &str) {
    to.extend_from_slice(cut(words).as_bytes());
}

/// Words for people, and no more than they like to read: 255 octets, up to a whole character.
fn cut(words: &str) -> &str {
    let mut end = words.len().min(255);
    while !words.is_char_boundary(end) {
        end -= 1;
    }
    &words[..end]
}

const fn flags(priority: Priority, broadcast: Broadcast) -> u8 {
    priority.bits() | (broadcast as u8) << 2
}

const NOWHERE: u8 = 0;
const LINE: u8 = 1;
const IPV4: u8 = 2;
const IPV6: u8 = 3;

/// The fields of a record that are not read yet.
struct Fields<'a> {
    kind: u8,
    body: &'a Body<'a>,
    at: usize,
}

impl<'a> Fields<'a> {
    fn new(body: &'a Body<'a>) -> Result<Self, RecordError> {
        let kind = body.octets().first();
        let &kind = kind.ok_or(RecordError::Length { kind: 0, length: 0 })?;
        Ok(Self { kind, body, at: 1 })
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], RecordError> {
        let rest = self.body.octets().get(self.at..);
        let field = rest.and_then(|rest| rest.first_chunk());
        self.at += N;
        field.copied().ok_or_else(|| self.wrong_length())
    }

    fn u8(&mut self) -> Result<u8, RecordError> {
        self.array::<1>().map(|[octet]| octet)
    }

    fn u16(&mut self) -> Result<u16, RecordError> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, RecordError> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, RecordError> {
        self.array().map(u64::from_le_bytes)
    }

    fn id(&mut self) -> Result<JausId, RecordError> {
        self.u32().map(JausId::from_u32)
    }

    /// All that is left.
    fn payload(&mut self) -> Bytes {
        let at = std::mem::replace(&mut self.at, self.body.octets().len());
        self.body.payload(at)
    }

    /// All that is left, up to 255 octets of it, as text that can be shown on any terminal.
    fn words(&mut self) -> String {
        let at = std::mem::replace(&mut self.at, self.body.octets().len());
        let rest = self.body.octets().get(at..).unwrap_or_default();
        let shown = |c: char| {
            if c.is_control() {
                char::REPLACEMENT_CHARACTER
            } else {
                c
            }
        };
        let words = String::from_utf8_lossy(&rest[..rest.len().min(255)]);
        cut(&words.chars().map(shown).collect::<String>()).to_owned()
    }

    fn flags(&mut self, rest: u8) -> Result<(Priority, Broadcast, u8), RecordError> {
        let flags = self.u8()?;
        let wrong = RecordError::Value {
            kind: self.kind,
            value: flags,
        };
        let priority = Priority::ALL[usize::from(flags & 3)];
        let broadcast = match flags >> 2 & 3 {
            0 => Broadcast::None,
            1 => Broadcast::Local,
            2 => Broadcast::Global,
            _ => return Err(wrong),
        };
        match flags >> 4 {
            other if other > rest => Err(wrong),
            other => Ok((priority, broadcast, other)),
        }
    }

    fn hello(&mut self) -> Result<Hello, RecordError> {
        if self.array()? != MAGIC {
            return Err(RecordError::Stranger);
        }
        let version = self.u8()?;
        let want = match self.u8()? {
            0 => Want::Component(self.u8()?),
            1 => Want::Id(self.id()?),
            value => {
                let kind = self.kind;
                return Err(RecordError::Value { kind, value });
            }
        };
        let name = self.words();
        Ok(Hello {
            version,
            want,
            name,
        })
    }

    fn send(&mut self) -> Result<Send, RecordError> {
        let (priority, broadcast, acknowledge) = self.flags(1)?;
        Ok(Send {
            priority,
            broadcast,
            acknowledge: acknowledge == 1,
            handle: self.u64()?,
            destination: self.id()?,
            payload: self.payload(),
        })
    }

    fn delivery(&mut self) -> Result<Delivery, RecordError> {
        let (priority, broadcast, place) = self.flags(IPV6)?;
        Ok(Delivery {
            priority,
            broadcast,
            source: self.id()?,
            destination: self.id()?,
            path: self.path(place)?,
            payload: self.payload(),
        })
    }

    fn path(&mut self, place: u8) -> Result<Option<Path>, RecordError> {
        if place == NOWHERE {
            return Ok(None);
        }
        let link = LinkId(self.u16()?);
        let peer = match place {
            LINE => Remote::Line,
            IPV4 => {
                let ip = Ipv4Addr::from(self.array::<4>()?);
                Remote::Socket((ip, self.u16()?).into())
            }
            _ => {
                let ip = Ipv6Addr::from(self.array::<16>()?);
                let (port, scope) = (self.u16()?, self.u32()?);
                Remote::Socket(SocketAddrV6::new(ip, port, 0, scope).into())
            }
        };
        Ok(Some(Path { link, peer }))
    }

    /// Nothing may be left.
    fn end(&self) -> Result<(), RecordError> {
        let whole = self.at == self.body.octets().len();
        whole.then_some(()).ok_or_else(|| self.wrong_length())
    }

    fn wrong_length(&self) -> RecordError {
        RecordError::Length {
            kind: self.kind,
            length: self.body.octets().len(),
        }
    }
}
