//! Octets ↔ frames: what JAUS transports put around a message. Pure functions, no I/O, no clock.
//!
//! A [`Frame`] is one transport message, whichever header it came with: [`as5669a`] is today's,
//! [`as5669`] its first edition and [`ra`] the header of the Reference Architecture that the latter
//! took over. [`judp`] reads and writes datagrams, whose first octet tells the three apart;
//! [`jtcp`] reads and writes the streams of TCP connections, [`jserial`] the packets of serial lines.
//!
//! Parsing checks every length against what is there, and gives an [`Error`] with the offset at
//! fault; payloads are shared slices of the datagram. Nothing here judges whether a frame makes
//! sense: that is the endpoint's business.

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

/// Which header a frame came with, or is to be sent with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Version {
    /// SAE AS5669A, today's transport: first octet 02h.
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
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// One transport message: who to whom, how, and the octets of the JAUS message in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The header that it came with.
    pub version: Version,
    /// Message type and header compression; zero but in rare AS5669A frames.
    pub kind: Kind,
    /// Priority, broadcast, acknowledgement and data control. For the older headers these are
    /// translated.
    pub flags: Flags,
    /// For whom; may hold wildcards.
    pub destination: JausId,
    /// From whom.
    pub source: JausId,
    /// The number that acknowledgements, duplicates and fragments are told by.
    pub sequence: u16,
    /// The JAUS message, beginning with its two code octets (in the older headers these are a
    /// header field, and are moved here). Empty in an AS5669A acknowledgement; without code in all
    /// but the first fragment of a large message.
    pub payload: Bytes,
}

impl Frame {
    /// A single unacknowledged message for one receiver, with today's header and sequence number 0.
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

    /// The message code, which the payload begins with; `None` if it is too short.
    #[must_use]
    pub fn code(&self) -> Option<u16> {
        self.payload
            .first_chunk()
            .map(|&code| u16::from_le_bytes(code))
    }

    /// What the payload holds besides the code, of which the older headers' acknowledgements carry
    /// a copy.
    fn body_len(&self) -> usize {
        match self.version {
            Version::As5669a => self.payload.len(),
            Version::As5669 | Version::Ra => self.payload.len().saturating_sub(ra::CODE_LEN),
        }
    }

    /// Whether this is a pure acknowledgement, positive or negative, as it should be: without a
    /// message.
    #[must_use]
    pub fn is_acknowledgement(&self) -> bool {
        self.flags.acknowledgement().is_answer() && self.body_len() == 0
    }

    /// Whether this could have been written on purpose: an uncompressed message of type 0 from
    /// somebody to somebody.
    ///
    /// One peer leaves stale octets behind its messages; their beginnings seldom pass this test.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        self.kind == Kind::default()
            && self.source.is_unicast()
            && !self.destination.has_zero()
            && self.flags.broadcast().is_some()
            && (self.body_len() == 0 || !self.flags.acknowledgement().is_answer())
    }
}
