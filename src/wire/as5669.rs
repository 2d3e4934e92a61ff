//! AS5669 first edition over UDP: a four-octet message prefix in front of the Reference
//! Architecture's header.
//!
//! The prefix holds the header compression number, the header compression length (bits 6-7) with
//! its flags, all zero in every peer seen, and the length of header and data, big-endian. Peers
//! write that length and do not read it; the header's own data size counts.

use bytes::{BufMut, Bytes, BytesMut};

use super::ra;
use super::{EncodeError, Error, Frame, Problem, Version};

/// Octets between the version octet, or the message before, and a header.
pub const PREFIX_LEN: usize = 4;

/// Reads the message whose prefix begins at `offset`, and tells where the next one would begin.
///
/// # Errors
/// A header or size that does not fit what is there, or header compression.
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

/// Writes a message behind what `out` holds; on an error nothing is written.
///
/// # Errors
/// As [`ra::emit`].
pub fn emit(frame: &Frame, out: &mut BytesMut) -> Result<(), EncodeError> {
    emit_behind(&[0; PREFIX_LEN], u16::to_be_bytes, frame, out)
}

/// Writes a message behind a prefix that ends with the length of the message; on an error nothing is
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
