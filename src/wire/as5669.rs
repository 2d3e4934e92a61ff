//! AS5669 first edition over UDP: a four-octet message prefix in front of the Reference
//! Architecture's header.
//!
//! The prefix holds the header compression number, the header compression length with its flags
//! (bits 6-7), all zero in every peer seen, and the length of header and data, big-endian. Peers
//! write that length but ignore it; the header's own data size counts.

use bytes::{BufMut, Bytes, BytesMut};

use super::ra;
use super::{EncodeError, Error, Frame, Problem, Version};

/// Octets of the prefix, between the version octet or preceding message and the header.
pub const PREFIX_LEN: usize = 4;

/// Reads the message whose prefix is at `offset`; returns it with the offset of the next one.
///
/// # Errors
/// The header is incomplete or compressed, or its size does not fit the available octets.
pub fn parse(datagram: &Bytes, offset: usize) -> Result<(Frame, usize), Error> {
    let octets = datagram.get(offset..).unwrap_or_default();
    let (needed, available) = (PREFIX_LEN + ra::HEADER_LEN, octets.len());
    if available < needed {
        return Err(Error {
            offset,
            problem: Problem::Truncated { needed, available },
        });
    }
    if octets[..2] != [0, 0] {
        return Err(Error {
            offset,
            problem: Problem::Compressed,
        });
    }
    ra::parse_message(datagram, offset + PREFIX_LEN, Version::As5669)
}

/// Appends a message to `out`; on an error nothing is written.
///
/// # Errors
/// As for [`ra::emit`].
pub fn emit(frame: &Frame, out: &mut BytesMut) -> Result<(), EncodeError> {
    emit_behind(&[0; PREFIX_LEN], u16::to_be_bytes, frame, out)
}

/// Appends a message after a prefix that ends with the message's length; on an error nothing is
/// written.
pub(super) fn emit_behind(
    prefix: &[u8],
    length: fn(u16) -> [u8; 2],
    frame: &Frame,
    out: &mut BytesMut,
) -> Result<(), EncodeError> {
    let start = out.len();
    out.put_slice(prefix);
    ra::emit(frame, out).inspect_err(|_| out.truncate(start))?;
    let message = start + prefix.len();
    let length = length((out.len() - message) as u16);
    out[message - length.len()..message].copy_from_slice(&length);
    Ok(())
}
