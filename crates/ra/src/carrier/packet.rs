//! One packet of the wire, a header and its data, in the framings that RA systems use.
//!
//! How strictly sizes are read follows what was recorded: every datagram of OpenJAUS and Junior
//! ends where its message ends. So a "JAUS01.0" datagram of which the stated size and the octets
//! that are there differ was damaged or invented, and is dropped either way. (OpenJAUS itself
//! takes such a message and reads old octets of its buffer with it.) With AS5669 several messages
//! may share a datagram; the length that stands in front of each is written by all and read by
//! nobody, so the header's size counts.

use bytes::{Buf, BufMut, Bytes, BytesMut};

use super::Dialect;
use crate::Counter;
use jaus::wire::ra::{HEADER_LEN, Header, PREFIX};
use jaus::wire::{as5669, judp};

/// A header and the data that it announced.
#[derive(Debug)]
pub(super) struct Packet {
    pub(super) header: Header,
    pub(super) data: Bytes,
}

/// Which framing a datagram is written in.
///
/// # Errors
/// What it is counted as, if it is none of ours.
pub(super) fn dialect(datagram: &[u8]) -> Result<Dialect, Counter> {
    match datagram.first() {
        Some(&judp::VERSION_AS5669) => Ok(Dialect::As5669),
        Some(&judp::VERSION_AS5669A) => Err(Counter::As5669a),
        _ if datagram.starts_with(PREFIX) => Ok(Dialect::Opc),
        _ => Err(Counter::NotJaus),
    }
}

/// The packets of a datagram that is written in that framing; behind the first that cannot be read there are no more.
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

/// The message that is all there is.
fn only(octets: &Bytes) -> Result<(Packet, usize), Counter> {
    let (packet, end) = first(octets)?;
    if end < octets.len() {
        return Err(Counter::WrongSize);
    }
    Ok((packet, end))
}

/// The message behind AS5669's four octets.
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

/// A header and its data at the beginning of some octets, and where they end.
fn first(octets: &Bytes) -> Result<(Packet, usize), Counter> {
    let header = Header::decode(octets).map_err(|_| Counter::TooShort)?;
    let end = HEADER_LEN + header.data_size();
    if end > octets.len() {
        return Err(Counter::WrongSize);
    }
    let data = octets.slice(HEADER_LEN..end);
    Ok((Packet { header, data }, end))
}

/// A datagram that holds one packet.
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
