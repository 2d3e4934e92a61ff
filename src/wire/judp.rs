//! JUDP: what one UDP datagram holds. The first octet tells which transport wrote it.
//!
//! An AS5669A datagram is the octet 02h and one message or several. JAUS++ does not shorten its
//! send buffer, so that the end of an older, longer message may follow; hence reading stops quietly
//! at the first implausible header after the first message.

use bytes::{BufMut, Bytes, BytesMut};

use super::{EncodeError, Error, Frame, Problem, Version, as5669, as5669a, ra};

/// The port that IANA registered for JAUS.
pub const PORT: u16 = 3794;

/// The first octet of an AS5669A datagram.
pub const VERSION_AS5669A: u8 = 2;
/// The first octet of an AS5669 datagram.
pub const VERSION_AS5669: u8 = 1;

/// The longest payload of one AS5669A message in one datagram over IPv4.
pub const MAX_PAYLOAD: usize = 65_507 - 1 - as5669a::MIN_LEN;

/// Which transport wrote the datagram, and where its first message begins.
///
/// # Errors
/// An empty datagram, or octets that belong to none.
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
/// A datagram of no JAUS transport. What is wrong with the first message comes out of the iterator.
pub fn frames(datagram: Bytes) -> Result<Frames, Error> {
    let (version, offset) = version(&datagram)?;
    Ok(Frames {
        datagram,
        version,
        offset,
        state: State::First,
    })
}

/// The messages of a datagram: the first, or why it cannot be read; then the others up to the first
/// implausible one.
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
    /// Which transport wrote the datagram.
    #[must_use]
    pub fn version(&self) -> Version {
        self.version
    }

    /// Where the next message would begin, or at the end where the octets begin that no message was
    /// found in.
    #[must_use]
    pub fn offset(&self) -> usize {
        self.offset
    }

    /// How many octets lie behind the messages read so far; at the end, how many are stale.
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

/// Writes a datagram that holds one message, with the frame's own header version.
///
/// # Errors
/// A frame that its header cannot carry.
pub fn encode(frame: &Frame) -> Result<Bytes, EncodeError> {
    let mut out = BytesMut::with_capacity(ra::PREFIX.len() + ra::HEADER_LEN + frame.payload.len());
    emit(frame, &mut out)?;
    Ok(out.freeze())
}

/// Writes such a datagram behind what `out` holds; on an error nothing is written.
///
/// # Errors
/// A frame that its header cannot carry.
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
