//! The AS5669A message: header, payload, sequence number. It is the same in datagrams, TCP streams
//! and serial packets.
//!
//! Layout, little-endian (offsets without / with the header compression fields):
//!
//! | offset | octets | field |
//! |---|---|---|
//! | 0 | 1 | message type (bits 0-5), header compression flags (bits 6-7) |
//! | 1 | 2 | data size: everything from offset 0 to the end of the sequence number |
//! | - / 3 | 2 | header compression number and length, if any flag is set |
//! | 3 / 5 | 1 | priority, broadcast, acknowledgement, data control |
//! | 4 / 6 | 4 | destination |
//! | 8 / 10 | 4 | source |
//! | 12 / 14 | n | payload |
//! | size - 2 | 2 | sequence number |

use bytes::{BufMut, Bytes, BytesMut};
use deku::prelude::*;

use super::{EncodeError, Error, Flags, Frame, Kind, Problem, Version};
use crate::address::JausId;

/// Octets of a header without compression fields.
pub const HEADER_LEN: usize = 12;
/// Octets of the sequence number after the payload.
pub const TRAILER_LEN: usize = 2;
/// Octets of the smallest message, an acknowledgement.
pub const MIN_LEN: usize = HEADER_LEN + TRAILER_LEN;
/// The longest payload that the size field can state.
pub const MAX_PAYLOAD: usize = u16::MAX as usize - MIN_LEN;

/// The header as it is on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, DekuRead, DekuWrite)]
pub struct Header {
    /// Message type and header compression flags.
    pub kind: Kind,
    /// Octets from the start of the header to the end of the sequence number.
    #[deku(endian = "little")]
    pub size: u16,
    /// Present if and only if the compression flags are not zero.
    #[deku(cond = "kind.has_compression_fields()")]
    pub compression: Option<Compression>,
    /// Priority, broadcast, acknowledgement, data control.
    pub flags: Flags,
    #[deku(endian = "little")]
    destination: JausId,
    #[deku(endian = "little")]
    source: JausId,
}

/// The two octets added by a peer that offers header compression. They are skipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, DekuRead, DekuWrite)]
pub struct Compression {
    /// The compressed header that this refers to.
    pub number: u8,
    /// How many octets of the header are, or could be, omitted.
    pub length: u8,
}

impl Header {
    /// Creates an uncompressed header for a message of type 0.
    #[must_use]
    pub const fn new(flags: Flags, destination: JausId, source: JausId, size: u16) -> Self {
        Self {
            kind: Kind(0),
            size,
            compression: None,
            flags,
            destination,
            source,
        }
    }

    /// The destination.
    #[must_use]
    pub const fn destination(&self) -> JausId {
        self.destination
    }

    /// The source.
    #[must_use]
    pub const fn source(&self) -> JausId {
        self.source
    }

    /// The length of this header on the wire, in octets.
    #[must_use]
    pub const fn wire_len(&self) -> usize {
        HEADER_LEN + if self.compression.is_some() { 2 } else { 0 }
    }

    /// Reads a header from the beginning of `octets`.
    ///
    /// # Errors
    /// [`Problem::Truncated`] if there are too few octets for a header. The size is not checked.
    #[inline]
    pub fn decode(octets: &[u8]) -> Result<Self, Problem> {
        let truncated = || Problem::Truncated {
            needed: HEADER_LEN,
            available: octets.len(),
        };
        let (_, header) = Self::from_bytes((octets, 0)).map_err(|_| truncated())?;
        Ok(header)
    }

    /// Appends the header to `out`.
    ///
    /// # Errors
    /// [`EncodeError::NotPlain`] if it has a type or compression: those are never sent.
    #[inline]
    pub fn encode(&self, out: &mut BytesMut) -> Result<(), EncodeError> {
        if self.kind != Kind::default() || self.compression.is_some() {
            return Err(EncodeError::NotPlain);
        }
        let mut octets = [0; HEADER_LEN];
        self.to_slice(&mut octets)
            .map_err(|_| EncodeError::NotPlain)?;
        out.put_slice(&octets);
        Ok(())
    }
}

/// The length of a message with a payload of `payload` octets.
#[must_use]
pub const fn message_len(payload: usize) -> usize {
    HEADER_LEN + payload + TRAILER_LEN
}

/// Reads the message at `offset`; returns it with the offset of the next one.
///
/// # Errors
/// The header is incomplete, or its size does not fit the available octets.
pub fn parse(datagram: &Bytes, offset: usize) -> Result<(Frame, usize), Error> {
    let at = |problem| Error { offset, problem };
    let octets = datagram.get(offset..).unwrap_or_default();
    let available = octets.len();
    if available < MIN_LEN {
        return Err(at(Problem::Truncated {
            needed: MIN_LEN,
            available,
        }));
    }
    let header = Header::decode(octets).map_err(at)?;
    let (size, least) = (usize::from(header.size), header.wire_len() + TRAILER_LEN);
    if size < least {
        return Err(at(Problem::SizeTooSmall { size, least }));
    }
    let Some((body, sequence)) = octets.get(..size).and_then(<[u8]>::split_last_chunk) else {
        return Err(at(Problem::SizeTooLarge { size, available }));
    };
    let frame = Frame {
        version: Version::As5669a,
        kind: header.kind,
        flags: header.flags,
        destination: header.destination(),
        source: header.source(),
        sequence: u16::from_le_bytes(*sequence),
        payload: datagram.slice(offset + header.wire_len()..offset + body.len()),
    };
    Ok((frame, offset + size))
}

/// Appends a message to `out`; on an error nothing is written.
///
/// # Errors
/// The payload exceeds [`MAX_PAYLOAD`], or the frame has a type or compression, which are never
/// sent.
pub fn emit(frame: &Frame, out: &mut BytesMut) -> Result<(), EncodeError> {
    let length = frame.payload.len();
    if frame.kind != Kind::default() {
        return Err(EncodeError::NotPlain);
    }
    let size = u16::try_from(message_len(length)).map_err(|_| EncodeError::PayloadTooLong {
        length,
        limit: MAX_PAYLOAD,
    })?;
    out.reserve(size.into());
    Header::new(frame.flags, frame.destination, frame.source, size).encode(out)?;
    out.put_slice(&frame.payload);
    out.put_u16_le(frame.sequence);
    Ok(())
}
