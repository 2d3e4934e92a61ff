//! The encoding of messages: CDR as ROS 2 uses it (OMG's XCDR version 1, plain). A header of four octets
//! says the byte order; numbers are aligned to their size, counted from after the header.

mod read;
mod write;

pub use read::{CdrError, decode};
pub use write::encode;

use crate::interface::Primitive;

/// The octets before the message.
const HEADER: usize = 4;
/// The second octet of the header: plain CDR, big endian.
const BIG_ENDIAN: u8 = 0;
/// The second octet of the header: plain CDR, little endian.
const LITTLE_ENDIAN: u8 = 1;
/// The longest message that is read. 1 MiB
pub const LONGEST: usize = 1 << 20;

/// The octets of a number.
const fn width(primitive: Primitive) -> usize {
    match primitive {
        Primitive::Bool | Primitive::Byte | Primitive::Int8 | Primitive::Uint8 => 1,
        Primitive::Int16 | Primitive::Uint16 => 2,
        Primitive::Int32 | Primitive::Uint32 | Primitive::Float32 => 4,
        Primitive::Int64 | Primitive::Uint64 | Primitive::Float64 => 8,
    }
}
