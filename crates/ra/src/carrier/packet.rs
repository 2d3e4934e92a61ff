//! Encodes and decodes one packet, header and data, in the framings of RA systems.
//!
//! Size checks follow recorded traffic: every datagram of OpenJAUS and Junior ends where its
//! message ends. A "JAUS01.0" datagram whose stated size differs from its length was damaged or
//! forged, and is dropped. (OpenJAUS accepts such a message and reads stale octets of its buffer.)
//! With AS5669, several messages may share a datagram; every sender writes the length in front of
//! each message, but no receiver reads it, so the size in the header counts.

use bytes::{Buf, BufMut, Bytes, BytesMut};

use super::Dialect;
use crate::counters::Counter;
use jaus::wire::ra::{HEADER_LEN, Header, PREFIX};
use jaus::wire::{as5669, judp};

/// A header with its data.
#[derive(Debug)]
pub(super) struct Packet {
    pub(super) header: Header,
    pub(super) data: Bytes,
}

/// The framing of a datagram.
///
/// # Errors
/// The counter of the drop, if the framing is unknown.
pub(super) fn dialect(datagram: &[u8]) -> Result<Dialect, Counter> {
    match datagram.first() {
        Some(&judp::VERSION_AS5669) => Ok(Dialect::As5669),
        Some(&judp::VERSION_AS5669A) => Err(Counter::As5669a),
        _ if datagram.starts_with(PREFIX) => Ok(Dialect::Opc),
        _ => Err(Counter::NotJaus),
    }
}

/// The packets of a datagram in this framing; ends at the first malformed one.
pub(super) fn packets(
    dialect: Dialect,
    datagram: Bytes,
) -> impl Iterator<Item = Result<Packet, Counter>> {
    let mut rest = datagram;
    rest.advance(match dialect {
        Dialect::Opc => PREFIX.len(),
        Dialect::As5669 => 1,
    });
    let mut begun = false;
    std::iter::from_fn(move || {
        if begun && rest.is_empty() {
            return None;
        }
        begun = true;
        let read = match dialect {
            Dialect::Opc => only(&rest),
            Dialect::As5669 => next(&rest),
        };
        rest = match &read {
            Ok((_, end)) => rest.slice(*end..),
            Err(_) => Bytes::new(),
        };
        Some(read.map(|(packet, _)| packet))
    })
}

/// The single message of the datagram.
fn only(octets: &Bytes) -> Result<(Packet, usize), Counter> {
    let (packet, end) = first(octets)?;
    if end < octets.len() {
        return Err(Counter::WrongSize);
    }
    Ok((packet, end))
}

/// The message after AS5669's four octets.
fn next(octets: &Bytes) -> Result<(Packet, usize), Counter> {
    let Some(prefix) = octets.get(..as5669::PREFIX_LEN) else {
        return Err(Counter::TooShort);
    };
    if prefix[..2] != [0, 0] {
        return Err(Counter::CompressedHeader);
    }
    let (packet, end) = first(&octets.slice(as5669::PREFIX_LEN..))?;
    Ok((packet, as5669::PREFIX_LEN + end))
}

/// Decodes a header and its data at the start; returns their total length.
fn first(octets: &Bytes) -> Result<(Packet, usize), Counter> {
    let header = Header::decode(octets).map_err(|_| Counter::TooShort)?;
    let end = HEADER_LEN + header.data_size();
    if end > octets.len() {
        return Err(Counter::WrongSize);
    }
    let data = octets.slice(HEADER_LEN..end);
    Ok((Packet { header, data }, end))
}

/// Encodes one packet as a datagram.
pub(super) fn datagram(dialect: Dialect, header: &Header, data: &[u8]) -> Bytes {
    let length = HEADER_LEN + data.len();
    let mut out = BytesMut::with_capacity(PREFIX.len() + length);
    match dialect {
        Dialect::Opc => out.put_slice(PREFIX),
        Dialect::As5669 => {
            out.put_slice(&[judp::VERSION_AS5669, 0, 0]);
            out.put_u16(length as u16);
        }
    }
    out.put_slice(&header.octets());
    out.put_slice(data);
    out.freeze()
}
