//! Writing MCAP: the frames as captured, and the samples of their messages.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::rc::Rc;

use jaus_view::{Dictionary, Filter, Frame, MessageStream, Network};
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};

use crate::channels::{Channel, Channels, Sample, nanoseconds};
use crate::frames::{self, FRAMES_TOPIC};
use crate::schema::Schema;

/// Octets of a chunk: what is in memory before it is written.
const CHUNK: u64 = 256 << 10;

/// Writes frames and the samples of their messages to an MCAP file.
///
/// The file consists of chunks without compression. [`flush`](Self::flush) ends a chunk; all chunks
/// before a crash are readable. In memory are a chunk, the channels, and the index of the file: 16
/// octets for each channel in a chunk.
///
/// ```
/// use jaus_view::{Dictionary, Frame, LinkType, Network, Timestamp};
/// use jaus_viewers::{McapRecorder, Recording};
///
/// let dictionary = Dictionary::new().with_catalogue();
/// let mut file = Vec::new();
/// let mut recorder = McapRecorder::new(&mut file, &dictionary, Network::by_content())?;
/// let frame = Frame {
///     time: Some(Timestamp::new(1_790_000_000, 0, 9)),
///     link: LinkType::RAW,
///     octets: &[0x45; 60],
///     lost: 0,
///     length: 60,
///     interface: "eth0",
/// };
/// recorder.write_frame(&frame)?;
/// recorder.finish()?;
///
/// let mut recording = Recording::new(&file[..])?;
/// assert_eq!(recording.next_frame().expect("a frame")?, frame);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct McapRecorder<'d, W: Write> {
    writer: Writer<NoSeek<Counting<W>>>,
    written: Rc<Cell<u64>>,
    network: Network,
    messages: MessageStream<'d>,
    channels: Channels<'d>,
    frames: u16,
    /// The numbers of the channels in the file, in the order of [`Channels::all`].
    numbers: Vec<u16>,
    counts: McapSummary,
    sample_limit: u64,
    /// Time of the latest frame, for those without.
    time: u64,
    sequence: u32,
}

/// What a recording holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct McapSummary {
    /// Frames.
    pub frames: u64,
    /// Samples on all channels but that of the frames.
    pub samples: u64,
    /// Samples left out because of the limit of channels, or of [`McapRecorder::limit_samples`].
    pub left_out: u64,
    /// Size of the file in octets.
    pub octets: u64,
}

impl<'d, W: Write> McapRecorder<'d, W> {
    /// Starts a file. `network` selects the datagrams that are decoded with `dictionary`.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn new(out: W, dictionary: &'d Dictionary, network: Network) -> io::Result<Self> {
        let written = Rc::new(Cell::new(0));
        let counting = Counting {
            out,
            written: written.clone(),
        };
        let options = WriteOptions::new()
            .compression(None)
            .profile("")
            .library(concat!("jaus ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK))
            .disable_seeking(true);
        let mut writer = options.create(NoSeek::new(counting)).map_err(io_error)?;
        let frames = add_channel(&mut writer, FRAMES_TOPIC, &frames::SCHEMA)?;
        Ok(Self {
            writer,
            written,
            network,
            messages: MessageStream::new(dictionary, Filter::default()),
            channels: Channels::new(dictionary),
            frames,
            numbers: Vec::new(),
            counts: McapSummary::default(),
            sample_limit: u64::MAX,
            time: 0,
            sequence: 0,
        })
    }

    /// Writes a frame, and the samples of the messages that it contains or completes.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn write_frame(&mut self, frame: &Frame<'_>) -> io::Result<()> {
        if let Some(time) = frame.time {
            self.time = nanoseconds(time);
        }
        self.write(self.frames, &frames::to_json(frame))?;
        self.counts.frames += 1;
        for datagram in self.network.handle_frame(frame) {
            for entry in self.messages.read_datagram(frame.time, &datagram) {
                let from = Some(datagram.source.ip());
                for sample in self.channels.handle_entry(&entry, from, self.time) {
                    self.write_sample(&sample)?;
                }
            }
        }
        Ok(())
    }

    fn write_sample(&mut self, sample: &Sample) -> io::Result<()> {
        if self.written() >= self.sample_limit {
            self.counts.left_out += 1;
            return Ok(());
        }
        let number = self.number(sample.channel)?;
        // Serialising to memory fails only for non-text map keys, which do not occur.
        let data = serde_json::to_vec(&sample.value).unwrap_or_default();
        self.write(number, &data)?;
        self.counts.samples += 1;
        Ok(())
    }

    /// Limits the samples: when the file has this many octets, it gets frames alone. The further
    /// samples are counted.
    pub const fn limit_samples(&mut self, octets: u64) {
        self.sample_limit = octets;
    }

    /// The number of a channel in the file. Channels are written in the order in which they open.
    fn number(&mut self, channel: usize) -> io::Result<u16> {
        while self.numbers.len() <= channel
            && let Some(next) = self.channels.get(self.numbers.len())
        {
            let Channel { topic, schema, .. } = &**next;
            let number = add_channel(&mut self.writer, topic, schema)?;
            self.numbers.push(number);
        }
        let number = self.numbers.get(channel).copied();
        number.ok_or_else(|| io::Error::other("a sample without a channel"))
    }

    fn write(&mut self, channel_id: u16, data: &[u8]) -> io::Result<()> {
        let header = MessageHeader {
            channel_id,
            sequence: self.sequence,
            log_time: self.time,
            publish_time: self.time,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let written = self.writer.write_to_known_channel(&header, data);
        written.map_err(io_error)
    }

    /// Octets written so far, without those that wait in memory.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.written.get()
    }

    /// What was written so far.
    #[must_use]
    pub fn summary(&self) -> McapSummary {
        McapSummary {
            left_out: self.counts.left_out + self.channels.left_out(),
            octets: self.written(),
            ..self.counts
        }
    }

    /// Ends the chunk, and flushes the writer.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(io_error)
    }

    /// Ends the file with its index.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn finish(mut self) -> io::Result<McapSummary> {
        self.writer.finish().map_err(io_error)?;
        let summary = self.summary();
        self.writer.into_inner().into_inner().flush()?;
        Ok(summary)
    }
}

fn add_channel<W: Write + io::Seek>(
    writer: &mut Writer<W>,
    topic: &str,
    schema: &Schema,
) -> io::Result<u16> {
    let schema = writer
        .add_schema(&schema.name, "jsonschema", schema.text.as_bytes())
        .map_err(io_error)?;
    let channel = writer.add_channel(schema, topic, "json", &BTreeMap::new());
    channel.map_err(io_error)
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}

/// Counts the octets that pass.
struct Counting<W> {
    out: W,
    written: Rc<Cell<u64>>,
}

impl<W: Write> Write for Counting<W> {
    fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
        let count = self.out.write(octets)?;
        self.written.set(self.written.get() + count as u64);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
