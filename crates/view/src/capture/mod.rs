//! Reading and writing capture files: pcap and pcapng, as used by tcpdump, Wireshark and similar
//! tools.
//!
//! A [`Capture`] yields [`Frame`]s one by one and holds only one in memory, so the input may be
//! arbitrarily long, or a pipe. A truncated or damaged file yields everything that is readable and
//! then reports where it ends.
//!
//! The reader is this project's own because neither crate that was tried provides this:
//!
//! - `pcap-parser` 0.17.0 reports a pcapng packet that claims more octets than its block holds as a
//!   truncated file, and likewise a malformed block that is irrelevant. Opening fails if the first
//!   `read` is short, as it may be on a pipe. The causes of I/O errors are lost. It rejects binary
//!   `if_tsresol`, reads `if_tsoffset` as little-endian and does not know obsolete packet blocks.
//!   Block lengths, byte order, options and obsolete packets would still have to be parsed here.
//! - `pcap-file` 2.0.0 reads every pcapng time stamp as nanoseconds, rejects pcap packets that were
//!   longer than the snap length, and repeats the error of a damaged block forever. Its raw blocks
//!   and packets avoid most of that, but leave their fields to be parsed here, and a truncated
//!   capture has no offset. 3.0.0-rc.3 needs a newer Rust than this crate.

mod input;
mod pcap;
mod pcapng;
mod writer;

use std::io::{self, Read};
use std::ops::Range;

use input::Input;
use thiserror::Error;

pub use writer::{CaptureWriter, InterfaceNumber};

use super::time::Timestamp;

/// A capture opened for reading.
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
    /// Capture time. A pcapng Simple Packet Block has none.
    pub time: Option<Timestamp>,
    /// Type of the link header.
    pub link: LinkType,
    /// The captured octets.
    pub octets: &'a [u8],
    /// Number of frames lost before this one, as reported by the capturing program (pcapng).
    pub lost: u64,
    /// Length of the frame on the link in octets. Greater than that of `octets` if the capture was
    /// limited to the beginning of each frame.
    pub length: u32,
    /// Name of the interface (pcapng); empty if the capture does not name it.
    pub interface: &'a str,
}

/// Link header type: a number from the registry at <https://www.tcpdump.org/linktypes.html>.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LinkType(pub u16);

impl LinkType {
    /// BSD loopback: the address family in the byte order of the capturing machine.
    pub const NULL: Self = Self(0);
    /// Ethernet.
    pub const ETHERNET: Self = Self(1);
    /// IP without a link header, as numbered by some BSD tools.
    pub const RAW_BSD: Self = Self(12);
    /// IP without a link header, as numbered by OpenBSD.
    pub const RAW_OPENBSD: Self = Self(14);
    /// IP without a link header.
    pub const RAW: Self = Self(101);
    /// OpenBSD loopback: the address family in network byte order.
    pub const LOOP: Self = Self(108);
    /// Linux cooked capture on the interface `any`.
    pub const LINUX_SLL: Self = Self(113);
    /// IPv4 without a link header.
    pub const IPV4: Self = Self(228);
    /// IPv6 without a link header.
    pub const IPV6: Self = Self(229);
    /// Linux cooked capture v2, used by newer tools on the interface `any`.
    pub const LINUX_SLL2: Self = Self(276);
}

/// Why a capture, or the rest of it, cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// The reader failed.
    #[error("cannot read the capture at octet {offset}: {source}")]
    Read {
        /// Offset in the file.
        offset: u64,
        /// The cause.
        source: io::Error,
    },
    /// The file is not a capture.
    #[error("not a pcap or pcapng file: it starts with {}{}", hex(.begin), advice(.begin))]
    NotACapture {
        /// The first octets of the file, at most four.
        begin: Vec<u8>,
    },
    /// The file ends within a packet or block.
    #[error(
        "the capture is truncated: the {what} at octet {offset} needs {wanted} octets, but {held} \
         are left"
    )]
    CutShort {
        /// Offset of the packet or block in the file.
        offset: u64,
        /// The incomplete structure.
        what: &'static str,
        /// Its stated length in octets.
        wanted: u64,
        /// Octets left in the file.
        held: u64,
    },
    /// The content is invalid.
    #[error("the capture is corrupt: {problem} at octet {offset}")]
    Damaged {
        /// Offset of the packet or block in the file.
        offset: u64,
        /// Description of the damage.
        problem: String,
    },
}

impl CaptureError {
    /// Offset in the file of the unreadable packet or block.
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
    /// Opens a capture and detects whether it is pcap or pcapng.
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
    /// After an error that leaves the start of the next packet known, reading can continue.
    /// Otherwise the error is the last item.
    ///
    /// # Errors
    /// [`CaptureError`]: the file is truncated, damaged or unreadable.
    pub fn next_frame(&mut self) -> Option<Result<Frame<'_>, CaptureError>> {
        if self.finished {
            return None;
        }
        let packet = match &mut self.format {
            Format::Pcap(header) => header.next_packet(&mut self.input),
            Format::PcapNg(section) => section.next_packet(&mut self.input),
        };
        match packet {
            Ok(Some(packet)) => {
                let interface = match &self.format {
                    Format::Pcap(_) => "",
                    Format::PcapNg(section) => section.interface_name(packet.interface),
                };
                Some(Ok(packet.frame(self.input.taken(), interface)))
            }
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
    /// Number of the interface in a pcapng section.
    interface: u32,
}

impl Packet {
    fn frame<'a>(self, taken: &'a [u8], interface: &'a str) -> Frame<'a> {
        Frame {
            time: self.time,
            link: self.link,
            octets: taken.get(self.octets).unwrap_or_default(),
            length: self.length,
            lost: self.lost,
            interface,
        }
    }
}

/// An error, and whether it also loses the position of the next packet.
struct Fault {
    error: CaptureError,
    last: bool,
}

/// Errors are final unless the format's reader states otherwise.
impl From<CaptureError> for Fault {
    fn from(error: CaptureError) -> Self {
        Self { error, last: true }
    }
}

fn hex(octets: &[u8]) -> String {
    if octets.is_empty() {
        return "nothing, the file is empty".to_owned();
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
