//! JSerial: packets on a serial line, with markers to find them in noise, and a checksum each for
//! header and content.
//!
//! A packet, before stuffing:
//!
//! | octets | what |
//! |---|---|
//! | 2 | `DLE SOH` |
//! | 1 | version in bits 0-3: 2 is AS5669A, 1 is AS5669 |
//! | 2 | length of the messages, little-endian |
//! | 0 or 2 | an address, which no known peer sends and which is read past |
//! | 2 | `DLE STX` |
//! | 2 | checksum of version, length and address, little-endian |
//! | n | messages: [`as5669a`]; or AS5669's, each with a prefix of 4 octets |
//! | 2 | `DLE ETX` |
//! | 2 | checksum of everything but the markers, little-endian |
//!
//! The octet DLE (10h) is doubled wherever it is not a marker, including in lengths and checksums.
//! The checksum is CRC-16/MCRF4XX. The second checksum continues the first over the octets of the
//! first. As a checksum followed by itself leaves no remainder, the header is in effect protected
//! only by its own checksum.
//!
//! A packet may hold several messages. Junior reads only the first, so [`encode`] writes one.

mod decoder;
mod packet;
#[cfg(test)]
mod tests;

use bytes::{BufMut, Bytes, BytesMut};
use crc::{CRC_16_MCRF4XX, Crc};

pub use decoder::{Counters, Decoder};

use super::{EncodeError, Frame, Version, as5669, as5669a, ra};

/// The octet that turns the next one into a marker, and is doubled in data.
pub const DLE: u8 = 0x10;
/// After a DLE: begin of a packet.
pub const SOH: u8 = 0x01;
/// After a DLE: end of the header.
pub const STX: u8 = 0x02;
/// After a DLE: end of the messages.
pub const ETX: u8 = 0x03;

/// The most octets of messages in one packet, limited by the length field.
pub const MAX_CONTENT: usize = u16::MAX as usize;

/// Octets of version and length.
const HEADER_LEN: usize = 3;
/// Octets of a checksum.
const CHECK_LEN: usize = 2;

static CHECK: Crc<u16> = Crc::<u16>::new(&CRC_16_MCRF4XX);

/// Encodes a packet with one message, stuffed and ready to send.
///
/// # Errors
/// The header cannot carry the frame, or is that of the Reference Architecture, which is only used
/// in datagrams.
pub fn encode(frame: &Frame) -> Result<Bytes, EncodeError> {
    let longest_header = as5669::PREFIX_LEN + ra::HEADER_LEN;
    let mut message = BytesMut::with_capacity(longest_header + frame.payload.len());
    let version = match frame.version {
        Version::As5669a => {
            as5669a::emit(frame, &mut message)?;
            2
        }
        Version::As5669 => {
            // Little-endian here, unlike in datagrams and streams.
            let prefix = [0; as5669::PREFIX_LEN];
            as5669::emit_behind(&prefix, u16::to_le_bytes, frame, &mut message)?;
            1
        }
        Version::Ra => return Err(EncodeError::DatagramsOnly),
    };
    Ok(packet_of(version, &message))
}

/// Encodes a packet around at most [`MAX_CONTENT`] octets of messages.
fn packet_of(version: u8, messages: &[u8]) -> Bytes {
    let mut header = [version, 0, 0];
    header[1..].copy_from_slice(&(messages.len() as u16).to_le_bytes());
    let mut check = CHECK.digest();
    check.update(&header);
    let header_check = check.clone().finalize().to_le_bytes();
    check.update(&header_check);
    check.update(messages);
    let content_check = check.finalize().to_le_bytes();

    // Room for one stuffed octet in 16, more than random content needs.
    let mut out = BytesMut::with_capacity(messages.len() + messages.len() / 16 + 24);
    out.put_slice(&[DLE, SOH]);
    stuff(&header, &mut out);
    out.put_slice(&[DLE, STX]);
    stuff(&header_check, &mut out);
    stuff(messages, &mut out);
    out.put_slice(&[DLE, ETX]);
    stuff(&content_check, &mut out);
    out.freeze()
}

/// Writes octets with each DLE doubled.
fn stuff(octets: &[u8], out: &mut BytesMut) {
    for part in octets.split_inclusive(|&octet| octet == DLE) {
        out.put_slice(part);
        if part.ends_with(&[DLE]) {
            out.put_u8(DLE);
        }
    }
}
