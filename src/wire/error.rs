//! Errors in received octets, and in frames to send.

/// Why octets are not a frame, and where the fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("octet {offset}: {problem}")]
pub struct Error {
    /// Offset of the faulty header, from the beginning of the datagram or stream.
    pub offset: usize,
    /// The fault.
    pub problem: Problem,
}

/// A fault in received octets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The datagram is empty.
    #[error("the datagram is empty")]
    Empty,
    /// The first octet belongs to no JAUS transport.
    #[error("no JAUS transport starts with {0:02X}h (AS5669A: 02h, AS5669: 01h, RA: \"JAUS01.0\")")]
    UnknownVersion(u8),
    /// There are fewer octets than a header needs.
    #[error("a header takes {needed} octets, but only {available} are left")]
    Truncated {
        /// The length of the header.
        needed: usize,
        /// The octets available.
        available: usize,
    },
    /// The size field does not cover the header.
    #[error("the data size {size} is less than the {least} octets of a message without payload")]
    SizeTooSmall {
        /// The size field.
        size: usize,
        /// The smallest valid size.
        least: usize,
    },
    /// The size field exceeds the available octets.
    #[error("the data size {size} is more than the {available} octets that are left")]
    SizeTooLarge {
        /// The size field.
        size: usize,
        /// The octets available.
        available: usize,
    },
    /// The size before an AS5669 header and the size in it differ.
    #[error("the size field says {stated} octets, but the header after it {by_header}")]
    SizesDiffer {
        /// Octets of header and data according to the size field.
        stated: usize,
        /// Octets of header and data according to the header.
        by_header: usize,
    },
    /// The data control of an older header has an undefined value.
    #[error("the data control {0} is not defined (0 single, 1 first, 2 or 4 middle, 8 last)")]
    UnknownDataControl(u8),
    /// An AS5669 message with a compressed header.
    #[error("the header is compressed, which is not supported")]
    Compressed,
}

/// Why a frame cannot be encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// The payload does not fit the size field.
    #[error("the payload has {length} octets, but at most {limit} fit a message with this header")]
    PayloadTooLong {
        /// Octets of the payload.
        length: usize,
        /// The longest payload that fits.
        limit: usize,
    },
    /// The payload lacks the message code, which the older headers carry.
    #[error(
        "the payload has {length} octets, but this header needs the two octets of a message code"
    )]
    NoMessageCode {
        /// Octets of the payload.
        length: usize,
    },
    /// The Reference Architecture's header is only used in UDP datagrams.
    #[error("a message with the Reference Architecture's header travels in UDP datagrams only")]
    DatagramsOnly,
    /// The message type is not 0, or the header is compressed.
    #[error("only uncompressed messages of type 0 are sent")]
    NotPlain,
}
