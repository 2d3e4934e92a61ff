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
//! | 4 | Cancel | handle u64 | |
//! | 17 | Welcome | id u32, longest message u32 | |
//! | 18 | Refused | reason u8 | why |
//! | 19 | Deliver | flags u8, source u32, destination u32, sequence u16, path | the message |
//! | 20 | Outcome | handle u64, outcome u8; if 1: destination u32, reason u8, acknowledged u32, length u32 | why |
//! | 21 | Progress | source u32 | |
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
use deku::ctx::Endian;
use deku::no_std_io::{Read, Seek, Write};
use deku::prelude::*;

use crate::address::JausId;
use crate::codec::Text;
use crate::endpoint::{LinkId, Path, Remote, SessionId, Shortfall};
use crate::wire::Flags;

/// The version of the format.
pub const VERSION: u8 = 5;
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

/// One record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// Its kind and fields.
    pub head: Head,
    /// The rest of the record.
    pub payload: Bytes,
}

/// The kind of a record and its fields.
#[deku_derive(DekuRead, DekuWrite)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[deku(id_type = "u8", endian = "little")]
pub enum Head {
    /// A component's first record. The payload is its name.
    #[deku(id = 1)]
    Hello {
        /// The version of its format. If it is another version, the rest is not read.
        #[deku(magic = b"JAUS")]
        version: u8,
        /// The requested id. With subsystem and node 0, the component with that number on the node,
        /// whatever the node's id.
        #[deku(
            reader = "read_claim(*version, deku::reader)",
            writer = "write_claim(*version, *id, deku::writer)"
        )]
        id: JausId,
    },
    /// A message from the component. Its source id is that of the connection.
    #[deku(id = 2)]
    Send {
        /// Priority, scope, and whether to request an acknowledgement.
        #[deku(assert = "flags.broadcast().is_some()")]
        flags: Flags,
        /// The component's handle for it.
        handle: u64,
        /// Its destination; may have wildcards.
        destination: JausId,
    },
    /// The component leaves on purpose.
    #[deku(id = 3)]
    Leave,
    /// The component no longer waits for the outcome of a message: it must not be sent any more.
    #[deku(id = 4)]
    Cancel {
        /// The component's handle for it.
        handle: u64,
    },
    /// The node has attached the component.
    #[deku(id = 17)]
    Welcome {
        /// Its id.
        id: JausId,
        /// The longest message that the node sends or receives, in octets.
        max_message: u32,
    },
    /// The node has not attached the component. The payload is the reason.
    #[deku(id = 18)]
    Refused(Reason),
    /// A message for the component.
    #[deku(id = 19)]
    Deliver {
        /// Priority and scope.
        #[deku(assert = "flags.broadcast().is_some()")]
        flags: Flags,
        /// Its source.
        source: JausId,
        /// Its destination, as given by the sender.
        destination: JausId,
        /// The sender's sequence number; 0 from a component of the same node.
        sequence: u16,
        /// The path on which it arrived; `None` from a component of the same node.
        #[deku(
            reader = "read_path(deku::reader)",
            writer = "write_path(*path, deku::writer)"
        )]
        path: Option<Path>,
    },
    /// The outcome of a message from the component.
    #[deku(id = 20)]
    Outcome {
        /// The component's handle for it.
        handle: u64,
        /// The outcome.
        outcome: Outcome,
    },
    /// A part of a large message for the component has arrived, and the message was not complete. So
    /// the component repeats no query to its source. At most one in 50 ms for each source.
    #[deku(id = 21)]
    Progress {
        /// The sender of the message.
        source: JausId,
    },
}

/// The outcome of a message from a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, DekuRead, DekuWrite)]
#[deku(id_type = "u8", endian = "endian", ctx = "endian: Endian")]
pub enum Outcome {
    /// Its receiver has acknowledged it.
    #[deku(id = 0)]
    Acknowledged,
    /// It was not acknowledged, and will not be sent again.
    #[deku(id = 1)]
    NotAcknowledged(Shortfall),
    /// The node rejected it. The payload is the reason.
    #[deku(id = 2)]
    Rejected,
}

/// Why a node does not attach a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, DekuRead, DekuWrite)]
#[deku(id_type = "u8", endian = "endian", ctx = "endian: Endian")]
#[non_exhaustive]
pub enum Reason {
    /// The node uses another version of the format.
    #[deku(id = 1)]
    Version,
    /// Another component has the id.
    #[deku(id = 2)]
    Taken,
    /// The id belongs to another subsystem or node, or names no single component.
    #[deku(id = 3)]
    WrongId,
    /// The node's limit of components is reached.
    #[deku(id = 4)]
    TooMany,
    /// The node is about to stop.
    #[deku(id = 5)]
    Stopping,
    /// Programs of this user may not attach, or not with this id.
    #[deku(id = 6)]
    User,
    /// A reason of a later version.
    #[deku(id_pat = "_")]
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
    /// With a name or an explanation, of which at most 255 octets are kept.
    #[must_use]
    pub fn with_text(head: Head, text: &str) -> Self {
        let payload = Text::from(Text::prefix(text, LONGEST_TEXT)).into();
        Self { head, payload }
    }

    /// The payload as printable text, made of at most 255 octets of it.
    #[must_use]
    pub fn text(&self) -> String {
        let octets = &self.payload[..self.payload.len().min(LONGEST_TEXT)];
        jaus_text::visible(&String::from_utf8_lossy(octets)).into_owned()
    }

    /// Appends the record without its payload, which must follow unchanged.
    pub fn encode_head(&self, out: &mut Vec<u8>) {
        let mut head = [0; LONGEST_HEAD];
        // There is room for every head.
        let octets = self.head.to_slice(&mut head).unwrap_or(0);
        // Longer payloads are rejected before this.
        let length = u32::try_from(octets + self.payload.len()).unwrap_or(u32::MAX);
        out.put_u32_le(length);
        out.put_slice(&head[..octets]);
    }

    /// Decodes a record without its length field.
    ///
    /// # Errors
    /// [`RecordError::Malformed`] if its kind is unknown or its fields are invalid.
    pub fn decode(mut octets: Bytes) -> Result<Self, RecordError> {
        let malformed = |_| RecordError::Malformed {
            kind: octets.first().copied().unwrap_or(0),
            length: octets.len(),
        };
        let ((payload, _), head) = Head::from_bytes((&octets, 0)).map_err(malformed)?;
        octets.advance(octets.len() - payload.len());
        Ok(Self {
            head,
            payload: octets,
        })
    }
}

impl Head {
    /// A component's first record, in our version of the format.
    #[must_use]
    pub const fn hello(id: JausId) -> Self {
        let version = VERSION;
        Self::Hello { version, id }
    }
}

impl From<Head> for Record {
    /// A record without payload.
    fn from(head: Head) -> Self {
        let payload = Bytes::new();
        Self { head, payload }
    }
}

/// Reads the rest of Hello, which is empty in a version that we do not know.
fn read_claim<R: Read + Seek>(version: u8, reader: &mut Reader<R>) -> Result<JausId, DekuError> {
    if version != VERSION {
        return Ok(JausId::from_u32(0));
    }
    match u8::from_reader_with_ctx(reader, ())? {
        1 => JausId::from_reader_with_ctx(reader, Endian::Little),
        _ => Err(DekuError::IdVariantNotFound),
    }
}

fn write_claim<W: Write + Seek>(
    version: u8,
    id: JausId,
    writer: &mut Writer<W>,
) -> Result<(), DekuError> {
    match version {
        VERSION => (1_u8, id).to_writer(writer, Endian::Little),
        _ => Ok(()),
    }
}

fn read_path<R: Read + Seek>(reader: &mut Reader<R>) -> Result<Option<Path>, DekuError> {
    let place = u8::from_reader_with_ctx(reader, ())?;
    if place == 0 {
        return Ok(None);
    }
    let link = LinkId(u16::from_reader_with_ctx(reader, Endian::Little)?);
    let peer = match place {
        1 => Remote::Line,
        3 => Remote::Session(SessionId(u64::from_reader_with_ctx(
            reader,
            Endian::Little,
        )?)),
        2 => {
            let ip = Ipv6Addr::from_reader_with_ctx(reader, Endian::Big)?;
            let (port, scope) = DekuReader::from_reader_with_ctx(reader, Endian::Little)?;
            match ip.to_canonical() {
                IpAddr::V4(ip) => SocketAddr::from((ip, port)).into(),
                IpAddr::V6(ip) => SocketAddr::V6(SocketAddrV6::new(ip, port, 0, scope)).into(),
            }
        }
        _ => return Err(DekuError::IdVariantNotFound),
    };
    Ok(Some(Path { link, peer }))
}

fn write_path<W: Write + Seek>(
    path: Option<Path>,
    writer: &mut Writer<W>,
) -> Result<(), DekuError> {
    let endian = Endian::Little;
    let Some(Path { link, peer }) = path else {
        return 0_u8.to_writer(writer, ());
    };
    let address = match peer {
        Remote::Line => return (1_u8, link.0).to_writer(writer, endian),
        Remote::Session(SessionId(number)) => {
            (3_u8, link.0).to_writer(writer, endian)?;
            return number.to_writer(writer, endian);
        }
        Remote::Socket(address) => address,
    };
    let (ip, scope) = match address {
        SocketAddr::V4(address) => (address.ip().to_ipv6_mapped(), 0),
        SocketAddr::V6(address) => (*address.ip(), address.scope_id()),
    };
    (2_u8, link.0).to_writer(writer, endian)?;
    ip.to_writer(writer, Endian::Big)?;
    (address.port(), scope).to_writer(writer, endian)
}
