//! JUDP: the messages in a UDP datagram. The first octet identifies the transport.
//!
//! An AS5669A datagram is the octet 02h and one or more messages. JAUS++ does not truncate its send
//! buffer, so the end of an older, longer message may follow. Reading therefore stops silently at
//! the first implausible header after the first message.

use bytes::{BufMut, Bytes, BytesMut};

use super::{EncodeError, Error, Frame, Problem, Version, as5669, as5669a, ra};

/// The UDP port that IANA registered for JAUS.
pub const PORT: u16 = 3794;

/// The first octet of an AS5669A datagram.
pub const VERSION_AS5669A: u8 = 2;
/// The first octet of an AS5669 datagram.
pub const VERSION_AS5669: u8 = 1;

/// The longest payload of one AS5669A message in one datagram over IPv4.
pub const MAX_PAYLOAD: usize = 65_507 - 1 - as5669a::MIN_LEN;

/// Identifies the transport, and the offset of the first message.
///
/// # Errors
/// The datagram is empty or belongs to no JAUS transport.
pub fn version(datagram: &[u8]) -> Result<(Version, usize), Error> {
    let at_start = |problem| Error { offset: 0, problem };
    match datagram.first() {
        Some(&VERSION_AS5669A) => Ok((Version::As5669a, 1)),
        Some(&VERSION_AS5669) => Ok((Version::As5669, 1)),
        Some(_) if datagram.starts_with(ra::PREFIX) => Ok((Version::Ra, ra::PREFIX.len())),
        Some(&other) => Err(at_start(Problem::UnknownVersion(other))),
        None => Err(at_start(Problem::Empty)),
    }
}

/// Reads a datagram's messages.
///
/// ```
/// use bytes::Bytes;
/// use jaus::wire::judp;
///
/// // Recorded from JAUS++: 1000.1.7 asks everyone who they are.
/// let datagram = Bytes::from_static(b"\x02\x00\x11\x00\x09\xFF\xFF\xFF\xFF\x07\x01\xE8\x03\x00\x2B\x02\x00\x00");
/// let frame = judp::frames(datagram)?.next().expect("a first message or an error")?;
/// assert_eq!(frame.source.to_string(), "1000.1.7");
/// assert_eq!(frame.code(), Some(0x2B00));
/// # Ok::<(), jaus::wire::Error>(())
/// ```
///
/// # Errors
/// The datagram belongs to no JAUS transport. Errors in the first message are returned by the
/// iterator.
pub fn frames(datagram: Bytes) -> Result<Frames, Error> {
    let (version, offset) = version(&datagram)?;
    Ok(Frames {
        datagram,
        version,
        offset,
        state: State::First,
    })
}

/// Iterates over the messages of a datagram: the first, or its error; then the others up to the
/// first implausible one.
#[derive(Clone, Debug)]
pub struct Frames {
    datagram: Bytes,
    version: Version,
    offset: usize,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    First,
    Following,
    Ended,
}

impl Frames {
    /// The transport of the datagram.
    #[must_use]
    pub fn version(&self) -> Version {
        self.version
    }

    /// The offset of the next message or, at the end, of the octets after the last message.
    #[must_use]
    pub fn offset(&self) -> usize {
        self.offset
    }

    /// How many octets follow the messages read so far; at the end, these are stale.
    #[must_use]
    pub fn remaining(&self) -> usize {
        self.datagram.len().saturating_sub(self.offset)
    }

    fn parse(&self) -> Result<(Frame, usize), Error> {
        match self.version {
            Version::As5669a => as5669a::parse(&self.datagram, self.offset),
            Version::As5669 => as5669::parse(&self.datagram, self.offset),
            Version::Ra => ra::parse(&self.datagram, self.offset),
        }
    }
}

impl Iterator for Frames {
    type Item = Result<Frame, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let result = match self.state {
            State::Ended => return None,
            State::First => self.parse(),
            State::Following => Ok(self
                .parse()
                .ok()
                .filter(|(frame, _)| frame.is_plausible())?),
        };
        self.state = match (&result, self.version) {
            (Ok(_), Version::As5669a | Version::As5669) => State::Following,
            (Ok(_), Version::Ra) | (Err(_), _) => State::Ended,
        };
        Some(result.map(|(frame, end)| {
            self.offset = end;
            frame
        }))
    }
}

/// Encodes a datagram with one message, with the frame's own header version.
///
/// # Errors
/// The header cannot carry the frame.
pub fn encode(frame: &Frame) -> Result<Bytes, EncodeError> {
    let mut out = BytesMut::with_capacity(ra::PREFIX.len() + ra::HEADER_LEN + frame.payload.len());
    emit(frame, &mut out)?;
    Ok(out.freeze())
}

/// Appends such a datagram to `out`; on an error nothing is written.
///
/// # Errors
/// The header cannot carry the frame.
pub fn emit(frame: &Frame, out: &mut BytesMut) -> Result<(), EncodeError> {
    let start = out.len();
    let emitted = match frame.version {
        Version::As5669a => {
            out.put_u8(VERSION_AS5669A);
            as5669a::emit(frame, out)
        }
        Version::As5669 => {
            out.put_u8(VERSION_AS5669);
            as5669::emit(frame, out)
        }
        Version::Ra => {
            out.put_slice(ra::PREFIX);
            ra::emit(frame, out)
        }
    };
    emitted.inspect_err(|_| out.truncate(start))
}
