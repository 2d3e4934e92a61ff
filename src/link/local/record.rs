//! The wire format between a component process and its host's node.
//!
//! A record consists of a length (four octets; counts what follows), a kind (one octet), the fields
//! of that kind, and a payload up to the record's end: a message, a name, or an explanation for
//! people. Numbers are little-endian, as everywhere in JAUS. The flags octet is that of AS5669A.
//!
//! | kind | | fields | payload |
//! |---|---|---|---|
//! | 1 | Hello | `JAUS`, version u8, 01h, id u32 | the component's name |
//! | 2 | Send | flags u8, handle u64, destination u32 | the message |
//! | 3 | Leave | | |
//! | 17 | Welcome | id u32, longest message u32 | |
//! | 18 | Refused | reason u8 | why |
//! | 19 | Deliver | flags u8, source u32, destination u32, path | the message |
//! | 20 | Outcome | handle u64, outcome u8; 1 to 3: destination, acknowledged, length u32 | why |
//!
//! A path is 00h for a message from the same node; 01h and the link u16 for a serial line or
//! Junior's node manager; 02h, link u16, IPv6 address (IPv4 mapped), port u16 and scope u32 for a
//! socket. The payload of an Outcome is the reason for a rejection.
//!
//! The component begins with Hello, and the node answers with Welcome or Refused. After that either
//! side writes at any time. **Hello up to its version, and Refused, are the same in all versions**:
//! components and nodes of different releases reject each other with a readable reason.

use std::net::{IpAddr, Ipv6Addr, SocketAddr, SocketAddrV6};

use bytes::{Buf, BufMut, Bytes};

use crate::address::JausId;
use crate::endpoint::{LinkId, Path, Remote, Shortfall, Unacknowledged};
use crate::wire::Flags;

/// The version of the format.
pub const VERSION: u8 = 2;
/// Octets of the length field before each record.
pub const LENGTH: usize = 4;
/// The longest message that a record carries, in octets.
pub const LONGEST_MESSAGE: usize = 16 << 20;
/// The longest kind and fields, in octets.
pub const LONGEST_HEAD: usize = 64;
/// The longest record that a node reads before a component is attached, without the length field.
pub const LONGEST_HELLO: usize = 512;
/// Limit of octets of a name or an explanation; longer ones are truncated.
const LONGEST_TEXT: usize = 255;

const MAGIC: [u8; 4] = *b"JAUS";

/// One record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// Its kind and fields.
    pub head: Head,
    /// The rest of the record.
    pub payload: Bytes,
}

/// The kind of a record and its fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Head {
    /// A component's first record. The payload is its name.
    Hello {
        /// The version of its format. If it is another version, the rest is not read.
        version: u8,
        /// The requested id. With subsystem and node 0, the component with that number on the node,
        /// whatever the node's id.
        id: JausId,
    },
    /// A message from the component. Its source id is that of the connection.
    Send {
        /// Priority, scope, and whether to request an acknowledgement.
        flags: Flags,
        /// The component's handle for it.
        handle: u64,
        /// Its destination; may have wildcards.
        destination: JausId,
    },
    /// The component leaves on purpose.
    Leave,
    /// The node has attached the component.
    Welcome {
        /// Its id.
        id: JausId,
        /// The longest message that the node sends or receives, in octets.
        max_message: u32,
    },
    /// The node has not attached the component. The payload is the reason.
    Refused(Reason),
    /// A message for the component.
    Deliver {
        /// Priority and scope.
        flags: Flags,
        /// Its source.
        source: JausId,
        /// Its destination, as given by the sender.
        destination: JausId,
        /// The path on which it arrived; `None` from a component of the same node.
        path: Option<Path>,
    },
    /// The outcome of a message from the component.
    Outcome {
        /// The component's handle for it.
        handle: u64,
        /// The outcome.
        outcome: Outcome,
    },
}

/// The outcome of a message from a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Its receiver has acknowledged it.
    Acknowledged,
    /// It was not acknowledged, and will not be sent again.
    NotAcknowledged(Shortfall),
    /// The node rejected it. The payload is the reason.
    Rejected,
}

/// Why a node does not attach a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Reason {
    /// The node uses another version of the format.
    Version,
    /// Another component has the id.
    Taken,
    /// The id belongs to another subsystem or node, or names no single component.
    WrongId,
    /// The node's limit of components is reached.
    TooMany,
    /// The node is about to stop.
    Stopping,
    /// A reason of a later version.
    Other(u8),
}

/// Why a stream cannot be decoded any further. The connection ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// A record is longer than the limit.
    #[error("a record of {length} octets; the limit is {limit}")]
    TooLong {
        /// Its length in octets.
        length: usize,
        /// The limit.
        limit: usize,
    },
    /// The kind or the fields are invalid.
    #[error("an undecodable record of kind {kind} and {length} octets")]
    Malformed {
        /// Its kind, 0 if it has none.
        kind: u8,
        /// Its length in octets.
        length: usize,
    },
    /// A record that is not valid at this point.
    #[error("an unexpected record")]
    Unexpected,
}

impl Record {
    /// A component's first record.
    #[must_use]
    pub fn hello(id: JausId, name: &str) -> Self {
        let version = VERSION;
        Self::with_text(Head::Hello { version, id }, name)
    }

    /// The refusal of a component.
    #[must_use]
    pub fn refused(reason: Reason, why: &str) -> Self {
        Self::with_text(Head::Refused(reason), why)
    }

    /// The rejection of a message.
    #[must_use]
    pub fn rejected(handle: u64, why: &str) -> Self {
        let outcome = Outcome::Rejected;
        Self::with_text(Head::Outcome { handle, outcome }, why)
    }

    /// With a name or an explanation, truncated at a character boundary.
    fn with_text(head: Head, text: &str) -> Self {
        let mut end = text.len().min(LONGEST_TEXT);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let payload = Bytes::copy_from_slice(&text.as_bytes()[..end]);
        Self { head, payload }
    }

    /// The payload as text that is safe for a terminal, at most 255 octets of it.
    #[must_use]
    pub fn text(&self) -> String {
        let octets = &self.payload[..self.payload.len().min(LONGEST_TEXT)];
        let shown = |c: char| match c {
            c if c.is_control() => char::REPLACEMENT_CHARACTER,
            c => c,
        };
        String::from_utf8_lossy(octets).chars().map(shown).collect()
    }

    /// Appends the record without its payload, which must follow unchanged.
    pub fn encode_head(&self, out: &mut Vec<u8>) {
        let start = out.len();
        out.put_u32_le(0);
        self.head.encode(out);
        let length = out.len() - start - LENGTH + self.payload.len();
        // Longer payloads are rejected before this.
        let length = u32::try_from(length).unwrap_or(u32::MAX);
        out[start..start + LENGTH].copy_from_slice(&length.to_le_bytes());
    }

    /// Decodes a record without its length field.
    ///
    /// # Errors
    /// [`RecordError::Malformed`] if its kind is unknown or its fields are invalid.
    pub fn decode(mut octets: Bytes) -> Result<Self, RecordError> {
        let mut rest = &octets[..];
        let head = Head::decode(&mut rest).ok_or_else(|| RecordError::Malformed {
            kind: octets.first().copied().unwrap_or(0),
            length: octets.len(),
        })?;
        let head_length = octets.len() - rest.len();
        octets.advance(head_length);
        Ok(Self {
            head,
            payload: octets,
        })
    }
}

impl From<Head> for Record {
    /// A record without payload.
    fn from(head: Head) -> Self {
        let payload = Bytes::new();
        Self { head, payload }
    }
}

impl Head {
    fn encode(&self, out: &mut Vec<u8>) {
        match *self {
            Self::Hello { version, id } => {
                out.put_u8(1);
                out.put_slice(&MAGIC);
                out.put_u8(version);
                if version == VERSION {
                    out.put_u8(1);
                    out.put_u32_le(id.to_u32());
                }
            }
            Self::Send {
                flags,
                handle,
                destination,
            } => {
                out.put_slice(&[2, flags.0]);
                out.put_u64_le(handle);
                out.put_u32_le(destination.to_u32());
            }
            Self::Leave => out.put_u8(3),
            Self::Welcome { id, max_message } => {
                out.put_u8(17);
                out.put_u32_le(id.to_u32());
                out.put_u32_le(max_message);
            }
            Self::Refused(reason) => out.put_slice(&[18, reason.code()]),
            Self::Deliver {
                flags,
                source,
                destination,
                path,
            } => {
                out.put_slice(&[19, flags.0]);
                out.put_u32_le(source.to_u32());
                out.put_u32_le(destination.to_u32());
                encode_path(path, out);
            }
            Self::Outcome { handle, outcome } => {
                out.put_u8(20);
                out.put_u64_le(handle);
                outcome.encode(out);
            }
        }
    }

    fn decode(octets: &mut &[u8]) -> Option<Self> {
        Some(match octets.try_get_u8().ok()? {
            1 => {
                let magic = octets.try_get_u32().ok()?;
                let version = octets.try_get_u8().ok()?;
                let is_ours = version == VERSION;
                if magic != u32::from_be_bytes(MAGIC) || is_ours && octets.try_get_u8() != Ok(1) {
                    return None;
                }
                let id = if is_ours {
                    id(octets)?
                } else {
                    JausId::from_u32(0)
                };
                Self::Hello { version, id }
            }
            2 => Self::Send {
                flags: flags(octets)?,
                handle: octets.try_get_u64_le().ok()?,
                destination: id(octets)?,
            },
            3 => Self::Leave,
            17 => Self::Welcome {
                id: id(octets)?,
                max_message: octets.try_get_u32_le().ok()?,
            },
            18 => Self::Refused(Reason::from_code(octets.try_get_u8().ok()?)),
            19 => Self::Deliver {
                flags: flags(octets)?,
                source: id(octets)?,
                destination: id(octets)?,
                path: decode_path(octets)?,
            },
            20 => Self::Outcome {
                handle: octets.try_get_u64_le().ok()?,
                outcome: Outcome::decode(octets)?,
            },
            _ => return None,
        })
    }
}

impl Outcome {
    /// The reasons in the order of their codes, from 1.
    const REASONS: [Unacknowledged; 3] = [
        Unacknowledged::TimedOut,
        Unacknowledged::Refused,
        Unacknowledged::NotSent,
    ];

    fn encode(self, out: &mut Vec<u8>) {
        match self {
            Self::Acknowledged => out.put_u8(0),
            Self::NotAcknowledged(shortfall) => {
                let reasons = Self::REASONS.iter();
                let before = reasons.take_while(|&&reason| reason != shortfall.reason);
                out.put_u8(1 + before.count() as u8);
                out.put_u32_le(shortfall.destination.to_u32());
                for octets in [shortfall.acknowledged, shortfall.length] {
                    out.put_u32_le(u32::try_from(octets).unwrap_or(u32::MAX));
                }
            }
            Self::Rejected => out.put_u8(4),
        }
    }

    fn decode(octets: &mut &[u8]) -> Option<Self> {
        Some(match octets.try_get_u8().ok()? {
            0 => Self::Acknowledged,
            4 => Self::Rejected,
            code => Self::NotAcknowledged(Shortfall {
                reason: *Self::REASONS.get(usize::from(code) - 1)?,
                destination: id(octets)?,
                acknowledged: octets.try_get_u32_le().ok()? as usize,
                length: octets.try_get_u32_le().ok()? as usize,
            }),
        })
    }
}

impl Reason {
    const KNOWN: [Self; 5] = [
        Self::Version,
        Self::Taken,
        Self::WrongId,
        Self::TooMany,
        Self::Stopping,
    ];

    fn code(self) -> u8 {
        match self {
            Self::Other(code) => code,
            known => 1 + Self::KNOWN.iter().take_while(|&&r| r != known).count() as u8,
        }
    }

    fn from_code(code: u8) -> Self {
        let known = usize::from(code).checked_sub(1);
        let known = known.and_then(|at| Self::KNOWN.get(at));
        known.copied().unwrap_or(Self::Other(code))
    }
}

fn encode_path(path: Option<Path>, out: &mut Vec<u8>) {
    let Some(Path { link, peer }) = path else {
        return out.put_u8(0);
    };
    out.put_u8(1 + u8::from(peer != Remote::Line));
    out.put_u16_le(link.0);
    if let Remote::Socket(address) = peer {
        let (ip, scope) = match address {
            SocketAddr::V4(address) => (address.ip().to_ipv6_mapped(), 0),
            SocketAddr::V6(address) => (*address.ip(), address.scope_id()),
        };
        out.put_slice(&ip.octets());
        out.put_u16_le(address.port());
        out.put_u32_le(scope);
    }
}

fn decode_path(octets: &mut &[u8]) -> Option<Option<Path>> {
    let place = octets.try_get_u8().ok()?;
    if place == 0 {
        return Some(None);
    }
    let link = LinkId(octets.try_get_u16_le().ok()?);
    let peer = match place {
        1 => Remote::Line,
        2 => {
            let ip = Ipv6Addr::from(octets.try_get_u128().ok()?);
            let (port, scope) = (octets.try_get_u16_le().ok()?, octets.try_get_u32_le().ok()?);
            match IpAddr::V6(ip).to_canonical() {
                IpAddr::V4(ip) => SocketAddr::from((ip, port)).into(),
                IpAddr::V6(ip) => SocketAddr::V6(SocketAddrV6::new(ip, port, 0, scope)).into(),
            }
        }
        _ => return None,
    };
    Some(Some(Path { link, peer }))
}

fn id(octets: &mut &[u8]) -> Option<JausId> {
    octets.try_get_u32_le().ok().map(JausId::from_u32)
}

/// Flags of a whole message, with a valid scope.
fn flags(octets: &mut &[u8]) -> Option<Flags> {
    let flags = Flags(octets.try_get_u8().ok()?);
    flags.broadcast().map(|_| flags)
}
