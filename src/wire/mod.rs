//! Wire formats: encoding and decoding of JAUS transport messages. Pure functions, without I/O or
//! clock.
//!
//! A [`Frame`] is one transport message, whatever its header: [`as5669a`] is the current one,
//! [`as5669`] its first edition, and [`ra`] the header of the Reference Architecture, which the
//! first edition adopted. [`judp`] reads and writes datagrams, whose first octet tells the three
//! apart; [`jtcp`] reads and writes the streams of TCP connections, [`jserial`] the packets of
//! serial lines.
//!
//! Parsing checks every length against the available octets, and returns an [`Error`] with the
//! offset of the fault. Payloads are shared slices of the datagram. The endpoint, not this module,
//! checks whether a frame makes sense.

pub mod as5669;
pub mod as5669a;
mod error;
mod flags;
mod framing;
pub mod jserial;
pub mod jtcp;
pub mod judp;
pub mod large;
pub mod ra;
#[cfg(test)]
mod tests;

use std::fmt;

use bytes::Bytes;

pub use error::{EncodeError, Error, Problem};
pub use flags::{Acknowledgement, Broadcast, DataControl, Flags, Kind, Priority};
pub use framing::Framing;

use crate::address::JausId;

/// The header of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Version {
    /// SAE AS5669A, the current transport: first octet 02h.
    As5669a,
    /// SAE AS5669, its first edition: first octet 01h.
    As5669,
    /// The Reference Architecture 3.x over UDP: begins with "JAUS01.0".
    Ra,
}

impl Version {
    /// A short lower-case name: `judp2`, `judp1` or `ra`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::As5669a => "judp2",
            Self::As5669 => "judp1",
            Self::Ra => "ra",
        }
    }

    /// The octets of message code at the beginning of each later fragment and each acknowledgement.
    /// In AS5669A, only the beginning of a message has the code.
    #[must_use]
    pub const fn repeated_code_len(self) -> usize {
        match self {
            Self::As5669a => 0,
            Self::As5669 | Self::Ra => ra::CODE_LEN,
        }
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// One transport message: addresses, flags, and the octets of its JAUS message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Its header.
    pub version: Version,
    /// Message type and header compression; zero except in rare AS5669A frames.
    pub kind: Kind,
    /// Priority, broadcast, acknowledgement and data control, translated from the older headers
    /// where necessary.
    pub flags: Flags,
    /// The destination; may hold wildcards.
    pub destination: JausId,
    /// The source.
    pub source: JausId,
    /// The sequence number, which identifies acknowledgements, duplicates and fragments.
    pub sequence: u16,
    /// The JAUS message, beginning with its two code octets (the older headers hold these in a
    /// header field, from which they are moved here). It is empty in an AS5669A acknowledgement,
    /// and lacks the code in all but the first fragment of a large message.
    pub payload: Bytes,
}

impl Frame {
    /// A single unacknowledged message for one receiver, with the AS5669A header and sequence
    /// number 0.
    #[must_use]
    pub fn new(source: JausId, destination: JausId, payload: Bytes) -> Self {
        Self {
            version: Version::As5669a,
            kind: Kind::default(),
            flags: Flags::default(),
            destination,
            source,
            sequence: 0,
            payload,
        }
    }

    /// The message code at the beginning of the payload; `None` if that is too short.
    #[must_use]
    pub fn code(&self) -> Option<u16> {
        self.payload
            .first_chunk()
            .map(|&code| u16::from_le_bytes(code))
    }

    /// The payload length without the code, of which acknowledgements with the older headers carry
    /// a copy.
    fn body_len(&self) -> usize {
        self.payload.len() - self.repeated_code_len()
    }

    /// The octets of the payload that repeat the message code, if this is an acknowledgement or a
    /// later fragment.
    pub(crate) fn repeated_code_len(&self) -> usize {
        self.version.repeated_code_len().min(self.payload.len())
    }

    /// Whether this is a well-formed acknowledgement, positive or negative: one without a message.
    #[must_use]
    pub fn is_acknowledgement(&self) -> bool {
        self.flags.acknowledgement().is_answer() && self.body_len() == 0
    }

    /// Whether a sender could have meant this frame: an uncompressed message of type 0 with a valid
    /// source and destination.
    ///
    /// One peer leaves stale octets after its messages; these seldom pass this test.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        self.kind == Kind::default()
            && self.source.is_unicast()
            && !self.destination.has_zero()
            && self.flags.broadcast().is_some()
            && (self.body_len() == 0 || !self.flags.acknowledgement().is_answer())
    }
}
