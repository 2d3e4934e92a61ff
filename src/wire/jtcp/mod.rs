//! JTCP: consecutive messages in a TCP stream, delimited by their own size fields.
//!
//! The first octet of each direction is the version, as in JUDP: 02h is AS5669A, 01h AS5669.
//! Messages of that version follow:
//!
//! * AS5669A: the message of [`as5669a`]. Junior writes the version octet once, JAUS++ before each
//!   message and as a segment of its own; both are accepted.
//! * AS5669: the length of header and data (2 octets, big-endian), then the header of [`ra`]. Only
//!   Junior writes it, with the version octet once.
//!
//! # Version octet or message?
//!
//! Where an AS5669A message may begin, 02h is either a repeated version octet or the type octet of
//! a message of the reserved type 2. It is **the version if the next octet has message type 0**
//! (bits 0-5), as every message of a known implementation begins. Otherwise it is a message of type
//! 2, which is skipped by its size. This misreads one case: a message of type 2 whose size is a
//! multiple of 64. Type 2 is undefined so far, so the case does not arise yet.
//!
//! # After an error
//!
//! After an invalid size there is no way to find the next message: anything that looks like one
//! could be payload. A [`Decoder`] therefore keeps returning its first error, and the connection
//! must be closed.

mod decoder;
#[cfg(test)]
mod tests;

use bytes::{BufMut, Bytes, BytesMut};

pub use decoder::Decoder;

use super::judp::{VERSION_AS5669, VERSION_AS5669A};
use super::{EncodeError, Frame, Version, as5669, as5669a, ra};

/// Octets of the size field before an AS5669 header.
const SIZE_LEN: usize = 2;

/// Encodes one message, with the version octet in front. That octet is only sent at the beginning
/// of a stream.
///
/// # Errors
/// The header cannot carry the frame, or is that of the Reference Architecture, which is only used
/// in datagrams.
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
