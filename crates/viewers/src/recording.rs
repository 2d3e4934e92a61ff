//! Reading the frames of a recording, whatever its format.

use std::collections::BTreeSet;
use std::io::{self, BufRead};

use jaus_view::{Capture, CaptureError, Frame};
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::frames::{self, FRAMES_TOPIC, OwnedFrame};

/// Limit of a record, in octets: more than a chunk of usual writers.
const LONGEST_RECORD: usize = 64 << 20;

/// A recording opened for reading: pcap, pcapng, or MCAP with frames as
/// [`McapRecorder`](crate::McapRecorder) writes it.
pub struct Recording<R>(Format<R>);

enum Format<R> {
    Capture(Box<Capture<R>>),
    Mcap(Box<McapFrames<R>>),
}

/// Why a recording, or the rest of it, cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A capture.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The reader failed.
    #[error("cannot read the recording at octet {offset}: {source}")]
    Read {
        /// Octets read before.
        offset: u64,
        /// The cause.
        source: io::Error,
    },
    /// The file ends within its content, as after a crash.
    #[error("the recording is truncated: it ends at octet {offset}, within a record")]
    CutShort {
        /// Octets of the file.
        offset: u64,
    },
    /// The chunks are compressed.
    #[error(
        "the recording is compressed with {compression}, which this program cannot read: run `mcap \
         compress --compression none` on it first"
    )]
    Compressed {
        /// Name of the compression.
        compression: String,
    },
    /// The content is invalid.
    #[error("the recording is corrupt: {problem} before octet {offset}")]
    Damaged {
        /// Octets read before.
        offset: u64,
        /// Description of the damage.
        problem: String,
    },
    /// There are no frames in an MCAP file.
    #[error(
        "the recording has no channel {FRAMES_TOPIC}, so it holds no frames of JAUS: record with \
         `jaus record`, or convert a capture with `jaus convert`"
    )]
    NoFrames,
}

impl RecordingError {
    /// Offset in the file where it was noticed.
    #[must_use]
    pub fn offset(&self) -> u64 {
        match self {
            Self::Capture(error) => error.offset(),
            Self::Read { offset, .. }
            | Self::CutShort { offset }
            | Self::Damaged { offset, .. } => *offset,
            Self::Compressed { .. } | Self::NoFrames => 0,
        }
    }
}

impl<R: BufRead> Recording<R> {
    /// Opens a recording and detects its format.
    ///
    /// # Errors
    /// If the file is none of them, ends within its header, or cannot be read.
    pub fn new(mut reader: R) -> Result<Self, RecordingError> {
        let begin = reader
            .fill_buf()
            .map_err(|source| RecordingError::Read { offset: 0, source })?;
        // A pipe may give less at first, but no capture begins with this octet.
        let is_mcap = begin.first() == mcap::MAGIC.first();
        Ok(Self(match is_mcap {
            true => Format::Mcap(Box::new(McapFrames::new(reader))),
            false => Format::Capture(Box::new(Capture::new(reader)?)),
        }))
    }

    /// The next frame; `None` at the end. After an error, reading can continue if it concerned one
    /// frame; otherwise the error is the last item.
    ///
    /// # Errors
    /// [`RecordingError`]: the file is truncated, damaged or unreadable.
    pub fn next_frame(&mut self) -> Option<Result<Frame<'_>, RecordingError>> {
        match &mut self.0 {
            Format::Capture(capture) => {
                let frame = capture.next_frame()?;
                Some(frame.map_err(RecordingError::Capture))
            }
            Format::Mcap(frames) => frames.next_frame(),
        }
    }
}

/// The frames of an MCAP file, read from its beginning to its end.
struct McapFrames<R> {
    reader: R,
    decoder: LinearReader,
    /// Octets read.
    offset: u64,
    /// The numbers of the channels with frames.
    channels: BTreeSet<u16>,
    frame: Option<OwnedFrame>,
    is_finished: bool,
}

impl<R: BufRead> McapFrames<R> {
    fn new(reader: R) -> Self {
        let options = LinearReaderOptions::default()
            .with_record_length_limit(LONGEST_RECORD)
            .with_validate_chunk_crcs(true);
        Self {
            reader,
            decoder: LinearReader::new_with_options(options),
            offset: 0,
            channels: BTreeSet::new(),
            frame: None,
            is_finished: false,
        }
    }

    fn next_frame(&mut self) -> Option<Result<Frame<'_>, RecordingError>> {
        if self.is_finished {
            return None;
        }
        match self.advance() {
            Ok(Some(frame)) => self.frame = Some(frame),
            Ok(None) => {
                self.is_finished = true;
                let is_empty = self.channels.is_empty();
                return is_empty.then_some(Err(RecordingError::NoFrames));
            }
            Err(Fault { error, is_last }) => {
                self.is_finished = is_last;
                return Some(Err(error));
            }
        }
        self.frame.as_ref().map(|frame| Ok(frame.borrow()))
    }

    /// The next frame; `None` at the end.
    fn advance(&mut self) -> Result<Option<OwnedFrame>, Fault> {
        loop {
            let offset = self.offset;
            let event = match self.decoder.next_event() {
                None => return Ok(None),
                Some(event) => event.map_err(|error| Fault::last(of_mcap(error, offset)))?,
            };
            match event {
                LinearReadEvent::ReadRequest(wanted) => {
                    let read = self.reader.read(self.decoder.insert(wanted));
                    let read = match read {
                        Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                        read => read,
                    };
                    let count = read
                        .map_err(|source| Fault::last(RecordingError::Read { offset, source }))?;
                    self.offset += count as u64;
                    self.decoder.notify_read(count);
                }
                LinearReadEvent::Record { opcode, data } => {
                    let is_relevant =
                        [mcap::records::op::CHANNEL, mcap::records::op::MESSAGE].contains(&opcode);
                    if !is_relevant {
                        continue;
                    }
                    let record = mcap::parse_record(opcode, data)
                        .map_err(|error| Fault::last(of_mcap(error, offset)))?;
                    if let Some(frame) = handle(record, &mut self.channels) {
                        return frame.map(Some).map_err(|problem| Fault {
                            error: RecordingError::Damaged { offset, problem },
                            is_last: false,
                        });
                    }
                }
            }
        }
    }
}

/// An error, and whether reading ends with it.
struct Fault {
    error: RecordingError,
    is_last: bool,
}

impl Fault {
    const fn last(error: RecordingError) -> Self {
        Self {
            error,
            is_last: true,
        }
    }
}

/// The frame in a record, if there is one.
fn handle(record: Record<'_>, channels: &mut BTreeSet<u16>) -> Option<Result<OwnedFrame, String>> {
    match record {
        Record::Channel(channel) => {
            if channel.topic == FRAMES_TOPIC && channel.message_encoding == "json" {
                channels.insert(channel.id);
            }
            None
        }
        Record::Message { header, data } => {
            let is_frame = channels.contains(&header.channel_id);
            is_frame.then(|| frames::from_json(&data))
        }
        _ => None,
    }
}

fn of_mcap(error: McapError, offset: u64) -> RecordingError {
    match error {
        McapError::UnexpectedEof | McapError::UnexpectedEoc => RecordingError::CutShort { offset },
        McapError::UnsupportedCompression(compression) => {
            RecordingError::Compressed { compression }
        }
        other => RecordingError::Damaged {
            offset,
            problem: other.to_string(),
        },
    }
}
