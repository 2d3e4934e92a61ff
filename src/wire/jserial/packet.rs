//! The state of a packet that is being read: the octets unstuffed so far, and whether they can
//! still become a valid packet.

use bytes::{Bytes, BytesMut};

use super::{CHECK, CHECK_LEN, ETX, HEADER_LEN, STX};
use crate::wire::Version;

/// Octets of the optional address in the header.
const ADDRESS_LEN: usize = 2;

/// A packet in progress, beginning after its `DLE SOH`.
#[derive(Debug)]
pub(super) struct Packet {
    /// The most octets of messages to accept.
    limit: usize,
    /// Header, header checksum, messages and content checksum, without markers and stuffing.
    octets: BytesMut,
    /// Set by `DLE STX`.
    header_len: Option<usize>,
    /// Set when the header checksum is correct.
    header: Option<Header>,
    /// Set by `DLE ETX`.
    ended: bool,
}

#[derive(Clone, Copy, Debug)]
struct Header {
    version: Version,
    /// Where the messages begin in [`Packet::octets`].
    begin: usize,
    /// Where they end.
    end: usize,
}

/// The effect of an octet on the packet.
#[derive(Debug)]
pub(super) enum Progress {
    /// The packet continues.
    Unfinished,
    /// The packet is complete and valid; these are its messages.
    Whole(Version, Bytes),
    /// The packet is invalid.
    Broken(Fault),
}

/// Why a packet is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// The header has an invalid form, version or checksum.
    Header,
    /// The header states more octets than are accepted.
    TooLong,
    /// A marker is in the wrong place, or the packet does not end where the header says.
    Form,
    /// The content checksum is wrong.
    Checksum,
}

impl Packet {
    pub(super) fn new(limit: usize) -> Self {
        Self {
            limit,
            octets: BytesMut::new(),
            header_len: None,
            header: None,
            ended: false,
        }
    }

    /// Whether a valid header has been read.
    pub(super) const fn has_header(&self) -> bool {
        self.header.is_some()
    }

    /// Adds a data octet.
    pub(super) fn octet(&mut self, octet: u8) -> Progress {
        self.octets.extend_from_slice(&[octet]);
        let len = self.octets.len();
        match (self.header_len, self.header) {
            (None, _) if len > HEADER_LEN + ADDRESS_LEN => Progress::Broken(Fault::Header),
            (Some(header_len), None) if len == header_len + CHECK_LEN => {
                self.check_header(header_len)
            }
            (_, Some(header)) if len > header.end && !self.ended => Progress::Broken(Fault::Form),
            (_, Some(header)) if len == header.end + CHECK_LEN => self.check_content(header),
            _ => Progress::Unfinished,
        }
    }

    /// Handles the octet after a DLE.
    pub(super) fn marker(&mut self, marker: u8) -> Progress {
        let len = self.octets.len();
        match (marker, self.header_len, self.header) {
            (STX, None, _) if len == HEADER_LEN || len == HEADER_LEN + ADDRESS_LEN => {
                self.header_len = Some(len);
            }
            (ETX, _, Some(header)) if len == header.end && !self.ended => self.ended = true,
            (_, _, Some(_)) => return Progress::Broken(Fault::Form),
            (_, _, None) => return Progress::Broken(Fault::Header),
        }
        Progress::Unfinished
    }

    fn check_header(&mut self, header_len: usize) -> Progress {
        if !is_sound(&self.octets, header_len) {
            return Progress::Broken(Fault::Header);
        }
        let version = match self.octets[0] & 0x0F {
            2 => Version::As5669a,
            1 => Version::As5669,
            _ => return Progress::Broken(Fault::Header),
        };
        let length = usize::from(u16::from_le_bytes([self.octets[1], self.octets[2]]));
        if length > self.limit {
            return Progress::Broken(Fault::TooLong);
        }
        let begin = header_len + CHECK_LEN;
        self.header = Some(Header {
            version,
            begin,
            end: begin + length,
        });
        Progress::Unfinished
    }

    fn check_content(&mut self, header: Header) -> Progress {
        if !is_sound(&self.octets, header.end) {
            return Progress::Broken(Fault::Checksum);
        }
        let messages = std::mem::take(&mut self.octets).freeze();
        Progress::Whole(header.version, messages.slice(header.begin..header.end))
    }
}

/// Whether the two octets after the first `len` are their checksum.
fn is_sound(octets: &[u8], len: usize) -> bool {
    let (covered, check) = octets.split_at(len);
    CHECK.checksum(covered).to_le_bytes() == *check
}
