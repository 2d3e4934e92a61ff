//! What can be wrong with received octets, and with a frame that is to be sent.

/// Why octets are not a frame, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("octet {offset}: {problem}")]
pub struct Error {
    /// Offset of the header at fault, from the beginning of the datagram or stream.
    pub offset: usize,
    /// What is wrong there.
    pub problem: Problem,
}

/// What is wrong with received octets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// A datagram without an octet.
    #[error("the datagram is empty")]
    Empty,
    /// The first octets belong to no JAUS transport.
    #[error("no JAUS transport begins with {0:02X}h (AS5669A: 02h, AS5669: 01h, RA: \"JAUS01.0\")")]
    UnknownVersion(u8),
    /// Fewer octets than a header has.
    #[error("a header takes {needed} octets, only {available} are left")]
    Truncated {
        /// What the header takes.
        needed: usize,
        /// What is there.
        available: usize,
    },
    /// The size field does not even cover the header.
    #[error("the data size {size} is less than the {least} octets of a message without payload")]
    SizeTooSmall {
        /// The size field.
        size: usize,
        /// The least that it can be.
        least: usize,
    },
    /// The size field goes beyond the end.
    #[error("the data size {size} is more than the {available} octets that are left")]
    SizeTooLarge {
        /// The size field.
        size: usize,
        /// What is there.
        available: usize,
    },
    /// The size in front of an AS5669 header and the one in it do not agree.
    #[error("the size field says {stated} octets, the header behind it {by_header}")]
    SizesDiffer {
        /// Octets of header and data by the size field.
        stated: usize,
        /// The same by the header's data size.
        by_header: usize,
    },
    /// An older header's data control has a value that is not defined.
    #[error("the data control {0} is not defined (0 single, 1 first, 2 or 4 middle, 8 last)")]
    UnknownDataControl(u8),
    /// An AS5669 message with a compressed header.
    #[error("the header is compressed, which cannot be read")]
    Compressed,
}

/// Why a frame cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// The payload does not fit the size field.
    #[error("the payload has {length} octets, at most {limit} fit one message with this header")]
    PayloadTooLong {
        /// Octets of the payload.
        length: usize,
        /// The most that fits.
        limit: usize,
    },
    /// The older headers carry the message code, so there must be one.
    #[error(
        "the payload has {length} octets, but this header needs the two octets of a message code"
    )]
    NoMessageCode {
        /// Octets of the payload.
        length: usize,
    },
    /// The Reference Architecture's header travels in UDP datagrams only.
    #[error("a message with the Reference Architecture's header travels in UDP datagrams only")]
    DatagramsOnly,
    /// A message type other than 0 or a compressed header.
    #[error("only uncompressed messages of type 0 are sent")]
    NotPlain,
}
