//! Incremental decoder for a JTCP stream, which may be split anywhere.

use bytes::{Buf, Bytes, BytesMut};
use nom::number::streaming::{be_u16, le_u16, u8};
use nom::{IResult, Parser};

use super::SIZE_LEN;
use crate::wire::judp::{VERSION_AS5669, VERSION_AS5669A};
use crate::wire::{Error, Frame, Kind, Problem, Version, as5669a, ra};

/// Messages up to this length are copied out of the stream's buffer (in well under a microsecond),
/// so that a retained small payload does not keep a large buffer alive.
const COPIED: usize = 16 * 1024;

/// Decodes one direction of a connection.
///
/// Append received octets to [`input`](Self::input), then take frames until there are no more: the
/// decoder then holds at most one unfinished message (64 KiB).
///
/// ```
/// use jaus::wire::jtcp::Decoder;
///
/// let mut decoder = Decoder::new();
/// // Recorded from JAUS++: 101.1.1 asks 102.1.1 who it is.
/// for part in [&b"\x02"[..], b"\x00\x11\x00\x01\x01\x01\x66\x00\x01\x01", b"\x65\x00\x00\x2B\x02\x01\x00"] {
///     assert_eq!(decoder.next_frame()?, None);
///     decoder.input().extend_from_slice(part);
/// }
/// assert_eq!(decoder.next_frame()?.and_then(|frame| frame.code()), Some(0x2B00));
/// # Ok::<(), jaus::wire::Error>(())
/// ```
#[derive(Debug, Default)]
pub struct Decoder {
    version: Option<Version>,
    input: BytesMut,
    /// Octets of the stream consumed before `input`.
    offset: usize,
    /// Whether a repeated version octet precedes the next message.
    version_again: bool,
    repeats_version: bool,
    failed: Option<Error>,
}

/// What was found where a message may begin.
enum Next {
    Version,
    /// A message of this many octets.
    Message(usize),
}

impl Decoder {
    /// Creates a decoder for a new connection.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The buffer to append received octets to.
    pub const fn input(&mut self) -> &mut BytesMut {
        &mut self.input
    }

    /// Frees memory that an idle connection does not need.
    pub fn release(&mut self) {
        if self.input.is_empty() {
            self.input = BytesMut::new();
        }
    }

    /// The version of the stream, once its first octet has arrived.
    #[must_use]
    pub const fn version(&self) -> Option<Version> {
        self.version
    }

    /// Whether a repeated version octet preceded the latest frame. JAUS++ writes one before each.
    #[must_use]
    pub const fn repeats_version(&self) -> bool {
        self.repeats_version
    }

    /// How many octets of an unfinished message are buffered.
    #[must_use]
    pub fn buffered(&self) -> usize {
        self.input.len()
    }

    /// The next frame, or `None` if it has not arrived in full.
    ///
    /// # Errors
    /// The fault, with its offset from the beginning of the stream. From then on every call returns
    /// this error: close the connection.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, Error> {
        if let Some(error) = self.failed {
            return Err(error);
        }
        let result = self.read();
        if let Err(error) = result {
            self.failed = Some(error);
            self.input = BytesMut::new();
        }
        result
    }

    fn read(&mut self) -> Result<Option<Frame>, Error> {
        let Some(version) = self.begin()? else {
            return Ok(None);
        };
        loop {
            match self.look(version)? {
                None => return Ok(None),
                Some(Next::Version) => {
                    self.skip(1);
                    self.version_again = true;
                }
                Some(Next::Message(size)) if self.input.len() < size => {
                    self.input.reserve(size - self.input.len());
                    return Ok(None);
                }
                Some(Next::Message(size)) => return self.take(version, size).map(Some),
            }
        }
    }

    /// Reads the version octet of the stream.
    fn begin(&mut self) -> Result<Option<Version>, Error> {
        if self.version.is_none() {
            self.version = match self.input.first() {
                None => None,
                Some(&VERSION_AS5669A) => Some(Version::As5669a),
                Some(&VERSION_AS5669) => Some(Version::As5669),
                Some(&other) => return Err(self.error(Problem::UnknownVersion(other))),
            };
            self.skip(usize::from(self.version.is_some()));
        }
        Ok(self.version)
    }

    /// Classifies the beginning of the input; `None` if there are too few octets.
    fn look(&self, version: Version) -> Result<Option<Next>, Error> {
        let looked = match version {
            Version::As5669a => look_as5669a(&self.input),
            Version::As5669 | Version::Ra => look_as5669(&self.input),
        };
        // These parsers fail only for want of octets.
        match looked {
            Ok((_, next)) => next.map(Some).map_err(|problem| self.error(problem)),
            Err(_) => Ok(None),
        }
    }

    fn take(&mut self, version: Version, size: usize) -> Result<Frame, Error> {
        let message = if size <= COPIED {
            Bytes::copy_from_slice(&self.input[..size])
        } else {
            self.input.split_to(size).freeze()
        };
        let read = match version {
            Version::As5669a => as5669a::parse(&message, 0),
            Version::As5669 | Version::Ra => ra::parse_message(&message, SIZE_LEN, Version::As5669),
        };
        let (frame, _) = read.map_err(|error| self.error(error.problem))?;
        if size <= COPIED {
            self.input.advance(size);
        }
        self.offset = self.offset.wrapping_add(size);
        self.repeats_version = std::mem::take(&mut self.version_again);
        Ok(frame)
    }

    fn skip(&mut self, octets: usize) {
        self.input.advance(octets);
        self.offset = self.offset.wrapping_add(octets);
    }

    const fn error(&self, problem: Problem) -> Error {
        Error {
            offset: self.offset,
            problem,
        }
    }
}

fn look_as5669a(input: &[u8]) -> IResult<&[u8], Result<Next, Problem>> {
    let (behind, first) = u8(input)?;
    if first == VERSION_AS5669A {
        let (_, next) = u8(behind)?;
        if Kind(next).message_type() == 0 {
            return Ok((behind, Ok(Next::Version)));
        }
    }
    let (rest, size) = le_u16(behind)?;
    let compression = if Kind(first).has_compression_fields() {
        2
    } else {
        0
    };
    Ok((rest, sized(size, as5669a::MIN_LEN + compression)))
}

/// The size before the header and the one in it must agree: this version offers no other check that
/// the decoder is in step with the stream.
fn look_as5669(input: &[u8]) -> IResult<&[u8], Result<Next, Problem>> {
    const DATA_SIZE_AT: usize = 12;
    let (rest, stated) = be_u16(input)?;
    let (rest, (_, data_control)) =
        (nom::bytes::streaming::take(DATA_SIZE_AT), le_u16).parse(rest)?;
    let by_header = ra::HEADER_LEN + usize::from(data_control & 0xFFF);
    let next = if usize::from(stated) == by_header {
        Ok(Next::Message(SIZE_LEN + by_header))
    } else {
        Err(Problem::SizesDiffer {
            stated: stated.into(),
            by_header,
        })
    };
    Ok((rest, next))
}

fn sized(size: u16, least: usize) -> Result<Next, Problem> {
    let size = usize::from(size);
    if size < least {
        return Err(Problem::SizeTooSmall { size, least });
    }
    Ok(Next::Message(size))
}
