//! JTCP: messages one after the other in a TCP stream, delimited by their own size fields.
//!
//! The first octet of each direction is the version, as in JUDP: 02h is AS5669A, 01h AS5669. Behind
//! it come messages of that version:
//!
//! * AS5669A: the message of [`as5669a`]. Junior writes the version octet once,
//!   JAUS++ before each message and as a segment of its own; both are read.
//! * AS5669: the length of header and data (2 octets, big-endian), then the header of
//!   [`ra`]. Only Junior writes it, and the version octet once.
//!
//! # Version octet or message?
//!
//! Where an AS5669A message may begin, 02h is either the version octet again or the type octet of
//! a message of the reserved type 2. It is **the version if the octet behind it has message type 0**
//! (bits 0-5), as the first octet of every message that anybody sends. Otherwise it is a
//! message of type 2, which is read past by its size. That leaves one case to misread: a message
//! of type 2 whose size is a multiple of 64. A type that nobody has defined can wait for its
//! definition.
//!
//! # After an error
//!
//! A size that cannot be leaves no way to tell where the next message begins, and whatever looks
//! like one could be payload. So a [`Decoder`] that met an error gives nothing but that error, and
//! its connection is to be closed.

mod decoder;
#[cfg(test)]
mod tests;

use bytes::{Buf, BufMut, Bytes, BytesMut};

pub use decoder::Decoder;

use super::judp::{VERSION_AS5669, VERSION_AS5669A};
use super::{EncodeError, Frame, Version, as5669, as5669a, ra};

/// Octets of the size in front of an AS5669 header.
const SIZE_LEN: usize = 2;

/// The octets of one message, with the version octet in front. Only where a stream begins is that
/// octet to be written: see [`split_version`].
///
/// # Errors
/// A frame that its header cannot carry, or with the header of the Reference Architecture, which
/// travels in datagrams only.
pub fn encode(frame: &Frame) -> Result<Bytes, EncodeError> {
    let mut out = BytesMut::with_capacity(1 + SIZE_LEN + ra::HEADER_LEN + frame.payload.len());
    match frame.version {
        Version::As5669a => {
            out.put_u8(VERSION_AS5669A);
            as5669a::emit(frame, &mut out)?;
        }
        Version::As5669 => {
            let prefix = [VERSION_AS5669, 0, 0];
            as5669::emit_behind(&prefix, u16::to_be_bytes, frame, &mut out)?;
        }
        Version::Ra => return Err(EncodeError::DatagramsOnly),
    }
    Ok(out.freeze())
}

/// Takes what [`encode`] wrote apart: the version, and the message alone.
#[must_use]
pub fn split_version(mut encoded: Bytes) -> (Version, Bytes) {
    let version = match encoded.first() {
        Some(&VERSION_AS5669) => Version::As5669,
        _ => Version::As5669a,
    };
    encoded.advance(encoded.len().min(1));
    (version, encoded)
}
