//! One packet as it is read, octet by octet: what has been unstuffed so far, and whether it can
//! still become a packet.

use bytes::{Bytes, BytesMut};

use super::{CHECK, CHECK_LEN, ETX, HEADER_LEN, STX};
use crate::wire::Version;

/// Octets of the address that a header may hold besides.
const ADDRESS_LEN: usize = 2;

/// A packet behind its `DLE SOH`.
#[derive(Debug)]
pub(super) struct Packet {
    /// The most octets of messages.
    limit: usize,
    /// Header, its checksum, messages, their checksum; without markers and stuffing.
    octets: BytesMut,
    /// Set by `DLE STX`.
    header_len: Option<usize>,
    /// Set when the header has proved sound.
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

/// What an octet has made of a packet.
#[derive(Debug)]
pub(super) enum Progress {
    /// It goes on.
    Unfinished,
    /// It is whole and sound: these are its messages.
    Whole(Version, Bytes),
    /// It cannot be a packet.
    Broken(Fault),
}

/// Why a packet is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// The header has no form, version or checksum that a header can have.
    Header,
    /// The header states more than is taken.
    TooLong,
    /// A marker stands where none can, or the end is not where the header says.
    Form,
    /// The checksum of the content is wrong.
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

    /// Whether the header was found to be sound.
    pub(super) const fn has_header(&self) -> bool {
        self.header.is_some()
    }

    /// Takes an octet that means itself.
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

    /// Takes an octet that stood behind a DLE.
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

/// Whether the two octets behind the first `len` are their checksum.
fn is_sound(octets: &[u8], len: usize) -> bool {
    let (covered, check) = octets.split_at(len);
    CHECK.checksum(covered).to_le_bytes() == *check
}
