//! Reading and writing capture files: pcap and pcapng, as tcpdump, Wireshark and friends have them.
//!
//! A [`Capture`] hands out [`Frame`]s one after the other and keeps only one in memory, so that a
//! file may be as long as it likes and may as well be a pipe. A file that was cut short, or is
//! damaged, gives everything that can be had and then says where it ends.
//!
//! The reader is our own because neither crate that was tried keeps this promise:
//!
//! * `pcap-parser` 0.17.0 reports a pcapng packet that claims more octets than its block has as a
//!   file cut short, and so a malformed block that nobody needs. Opening fails if the first `read`
//!   is as short as a pipe's may be; causes of I/O errors are lost. It refuses binary `if_tsresol`,
//!   takes `if_tsoffset` for little-endian and does not know obsolete packet blocks. Around it,
//!   block lengths, byte order, options and obsolete packets would still have to be read here.
//! * `pcap-file` 2.0.0 takes every pcapng time stamp for nanoseconds, refuses pcap packets that were
//!   longer than the snap length, and repeats the error of a damaged block for ever. Its raw blocks
//!   and packets avoid most of that, but leave their fields to be read here, and a capture cut short
//!   gives no place. 3.0.0-rc.3 needs a newer Rust than this crate.

mod input;
mod pcap;
mod pcapng;
mod writer;

use std::io::{self, Read};
use std::ops::Range;

use input::Input;
use thiserror::Error;

pub use writer::{CaptureWriter, InterfaceNumber};

use super::Timestamp;

/// A capture that is being read.
///
/// ```no_run
/// let file = std::fs::File::open("drive.pcapng")?;
/// let mut capture = jaus_view::Capture::new(file)?;
/// while let Some(frame) = capture.next_frame() {
///     let frame = frame?;
///     println!("{:?}: {} octets", frame.time, frame.octets.len());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Capture<R> {
    input: Input<R>,
    format: Format,
    finished: bool,
}

enum Format {
    Pcap(pcap::Header),
    PcapNg(pcapng::Section),
}

/// One captured link-layer frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame<'a> {
    /// When it was captured; a pcapng Simple Packet Block does not say.
    pub time: Option<Timestamp>,
    /// How the frame begins.
    pub link: LinkType,
    /// The octets that were kept.
    pub octets: &'a [u8],
    /// How many frames were lost before this one, as far as whoever captured says (pcapng).
    pub lost: u64,
    /// How many octets the frame had on the link; more than `octets` if the capture was told to
    /// keep only the beginning of each.
    pub length: u32,
}

/// What a frame begins with: a number from the registry at
/// <https://www.tcpdump.org/linktypes.html>.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LinkType(pub u16);

impl LinkType {
    /// The BSDs' loopback: the address family in the capturing machine's byte order.
    pub const NULL: Self = Self(0);
    /// Ethernet.
    pub const ETHERNET: Self = Self(1);
    /// IP without a link header, as some BSD tools number it.
    pub const RAW_BSD: Self = Self(12);
    /// IP without a link header, as OpenBSD numbers it.
    pub const RAW_OPENBSD: Self = Self(14);
    /// IP without a link header.
    pub const RAW: Self = Self(101);
    /// OpenBSD's loopback: the address family in network byte order.
    pub const LOOP: Self = Self(108);
    /// Linux, captured on the interface `any`.
    pub const LINUX_SLL: Self = Self(113);
    /// IPv4 without a link header.
    pub const IPV4: Self = Self(228);
    /// IPv6 without a link header.
    pub const IPV6: Self = Self(229);
    /// Linux, captured on the interface `any` by newer tools.
    pub const LINUX_SLL2: Self = Self(276);
}

/// Why (the rest of) a capture cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// The reader failed.
    #[error("the capture cannot be read at octet {offset}: {source}")]
    Read {
        /// Where in the file.
        offset: u64,
        /// What the operating system says.
        source: io::Error,
    },
    /// Not a capture at all.
    #[error("this is not a pcap or pcapng file: it begins with {}{}", hex(.begin), advice(.begin))]
    NotACapture {
        /// The first octets, at most four.
        begin: Vec<u8>,
    },
    /// The file ends within a packet or block.
    #[error(
        "the capture is cut short: the {what} at octet {offset} needs {wanted} octets, {held} are left"
    )]
    CutShort {
        /// Where in the file the packet or block begins.
        offset: u64,
        /// What is incomplete.
        what: &'static str,
        /// Octets that it claims to have.
        wanted: u64,
        /// Octets that the file still holds.
        held: u64,
    },
    /// Something that no writer writes.
    #[error("the capture is damaged: {problem} at octet {offset}")]
    Damaged {
        /// Where in the file the packet or block begins.
        offset: u64,
        /// What is wrong with it.
        problem: String,
    },
}

impl CaptureError {
    /// Where in the file the packet or block begins that could not be read.
    pub fn offset(&self) -> u64 {
        match self {
            Self::Read { offset, .. }
            | Self::CutShort { offset, .. }
            | Self::Damaged { offset, .. } => *offset,
            Self::NotACapture { .. } => 0,
        }
    }
}

impl<R: Read> Capture<R> {
    /// Looks at the beginning of the file, which tells pcap from pcapng.
    ///
    /// # Errors
    /// If the file is neither, ends within its header, or cannot be read.
    pub fn new(reader: R) -> Result<Self, CaptureError> {
        let mut input = Input::new(reader);
        let mut magic = [0; 4];
        let held = input.fill(&mut magic)?;
        let format = if let Some(endian) = pcap::Endian::of_magic(&magic[..held]) {
            Format::Pcap(pcap::Header::read(endian, &mut input)?)
        } else if magic[..held] == pcapng::SECTION_HEADER {
            Format::PcapNg(pcapng::Section::read_first(&mut input)?)
        } else {
            let begin = magic[..held].to_vec();
            return Err(CaptureError::NotACapture { begin });
        };
        Ok(Self {
            input,
            format,
            finished: false,
        })
    }

    /// The next frame; `None` at the end of the file.
    ///
    /// After an error that leaves the beginning of the next packet known, reading goes on behind
    /// it; otherwise the error is the last thing that the capture gives.
    ///
    /// # Errors
    /// [`CaptureError`]: the file is cut short, damaged or unreadable.
    pub fn next_frame(&mut self) -> Option<Result<Frame<'_>, CaptureError>> {
        if self.finished {
            return None;
        }
        let packet = match &mut self.format {
            Format::Pcap(header) => header.next_packet(&mut self.input),
            Format::PcapNg(section) => section.next_packet(&mut self.input),
        };
        match packet {
            Ok(Some(packet)) => Some(Ok(packet.frame(self.input.taken()))),
            Ok(None) => {
                self.finished = true;
                None
            }
            Err(fault) => {
                self.finished = fault.last;
                Some(Err(fault.error))
            }
        }
    }
}

/// A frame whose octets are still in the input's buffer.
struct Packet {
    time: Option<Timestamp>,
    link: LinkType,
    length: u32,
    lost: u64,
    octets: Range<usize>,
}

impl Packet {
    fn frame(self, taken: &[u8]) -> Frame<'_> {
        Frame {
            time: self.time,
            link: self.link,
            octets: taken.get(self.octets).unwrap_or_default(),
            length: self.length,
            lost: self.lost,
        }
    }
}

/// An error, and whether the place of the next packet is lost with it.
struct Fault {
    error: CaptureError,
    last: bool,
}

/// Errors are final unless the reader of a format knows better.
impl From<CaptureError> for Fault {
    fn from(error: CaptureError) -> Self {
        Self { error, last: true }
    }
}

fn hex(octets: &[u8]) -> String {
    if octets.is_empty() {
        return "nothing, it is empty".to_owned();
    }
    octets.iter().map(|octet| format!("{octet:02x}")).collect()
}

fn advice(begin: &[u8]) -> &'static str {
    match begin {
        [0x1f, 0x8b, ..] => "; it is compressed: run gunzip on it first",
        [0x28, 0xb5, 0x2f, 0xfd] => "; it is compressed: run unzstd on it first",
        [b'P', b'K', ..] => "; it is a zip archive: unpack it first",
        [] => "",
        _ => "; save it from Wireshark or tcpdump as pcapng or pcap",
    }
}
