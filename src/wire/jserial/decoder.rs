//! Incremental decoder for a serial line, which tolerates noise.

use bytes::{Buf, Bytes, BytesMut};

use super::packet::{Fault, Packet, Progress};
use super::{DLE, MAX_CONTENT, SOH};
use crate::wire::{Frame, Version, as5669, as5669a};

/// Statistics of a serial line. The counters only grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// Valid packets.
    pub packets: u64,
    /// Messages in valid packets.
    pub messages: u64,
    /// Octets outside valid packets.
    pub rubbish_octets: u64,
    /// Packet starts without a valid header.
    pub bad_headers: u64,
    /// Packets longer than the decoder's limit.
    pub too_long: u64,
    /// Packets with a misplaced marker, cut short or lengthened.
    pub bad_forms: u64,
    /// Packets with a wrong content checksum.
    pub bad_checksums: u64,
    /// Valid packets with a message that contradicts its own sizes; the rest of such a packet is
    /// lost.
    pub malformed: u64,
}

/// Decodes the receiving direction of a line.
///
/// Pass received octets to [`push`](Self::push), then take frames until there are no more. The
/// decoder holds at most one unfinished packet, both raw and unstuffed.
///
/// Noise destroys only the packets that it hits. After a broken packet, the search for the next
/// start resumes right after the broken one's own start, because a DLE in the noise may have hidden
/// the next packet's. Content is scanned at most twice.
#[derive(Debug)]
pub struct Decoder {
    limit: usize,
    /// Received octets, from the beginning of the current packet.
    input: BytesMut,
    /// How many of them have been read.
    at: usize,
    /// How many of them were content of a failed packet. A failure within them does not cause
    /// another scan.
    searched: usize,
    packet: Option<Packet>,
    messages: Messages,
    counters: Counters,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// Creates a decoder that accepts packets of any length.
    #[must_use]
    pub fn new() -> Self {
        Self::with_limit(MAX_CONTENT)
    }

    /// Creates a decoder that accepts at most `limit` octets of messages per packet.
    #[must_use]
    pub fn with_limit(limit: usize) -> Self {
        Self {
            limit,
            input: BytesMut::new(),
            at: 0,
            searched: 0,
            packet: None,
            messages: Messages::default(),
            counters: Counters::default(),
        }
    }

    /// The statistics so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// How many octets of an unfinished packet are buffered.
    #[must_use]
    pub fn buffered(&self) -> usize {
        self.input.len()
    }

    /// Adds received octets.
    pub fn push(&mut self, octets: &[u8]) {
        self.input.extend_from_slice(octets);
    }

    /// The next frame, if it has arrived in full.
    pub fn next_frame(&mut self) -> Option<Frame> {
        loop {
            match self.messages.next() {
                Some(Ok(frame)) => {
                    self.counters.messages += 1;
                    return Some(frame);
                }
                Some(Err(_)) => self.counters.malformed += 1,
                None if self.read_packet() => {}
                None => return None,
            }
        }
    }

    /// Reads up to the end of the next valid packet; returns whether there is one.
    fn read_packet(&mut self) -> bool {
        loop {
            let Some(mut packet) = self.packet.take().or_else(|| self.begin()) else {
                return false;
            };
            match self.read_into(&mut packet) {
                Progress::Unfinished => {
                    self.packet = Some(packet);
                    return false;
                }
                Progress::Whole(version, octets) => {
                    self.counters.packets += 1;
                    self.messages = Messages { version, octets };
                    self.drop_input(self.at);
                    return true;
                }
                Progress::Broken(fault) => self.give_up(fault, packet.has_header()),
            }
        }
    }

    /// Finds the start of a packet, and drops everything before it.
    fn begin(&mut self) -> Option<Packet> {
        let found = self.input.windows(2).position(|pair| pair == [DLE, SOH]);
        let rubbish = found.unwrap_or_else(|| {
            // The last octet may be the first half of a start marker.
            self.input.len() - usize::from(self.input.last() == Some(&DLE))
        });
        self.counters.rubbish_octets += rubbish as u64;
        self.drop_input(rubbish);
        found?;
        self.at = 2;
        Some(Packet::new(self.limit))
    }

    /// Feeds received octets to a packet, up to its end.
    fn read_into(&mut self, packet: &mut Packet) -> Progress {
        while let Some(&octet) = self.input.get(self.at) {
            let progress = if octet != DLE {
                self.at += 1;
                packet.octet(octet)
            } else if let Some(&behind) = self.input.get(self.at + 1) {
                self.at += 2;
                if behind == DLE {
                    packet.octet(DLE)
                } else {
                    packet.marker(behind)
                }
            } else {
                break;
            };
            if !matches!(progress, Progress::Unfinished) {
                return progress;
            }
        }
        Progress::Unfinished
    }

    /// Counts a broken packet, and moves on to continue the search.
    fn give_up(&mut self, fault: Fault, had_header: bool) {
        *match fault {
            Fault::Header => &mut self.counters.bad_headers,
            Fault::TooLong => &mut self.counters.too_long,
            Fault::Form => &mut self.counters.bad_forms,
            Fault::Checksum => &mut self.counters.bad_checksums,
        } += 1;
        // A false header ends within a few octets, but content can be long.
        let rubbish = if had_header && self.searched > 0 {
            // The last two octets may be the marker that broke the packet and starts the next one.
            self.at - 2
        } else {
            2
        };
        if had_header {
            self.searched = self.searched.max(self.at);
        }
        self.counters.rubbish_octets += rubbish as u64;
        self.drop_input(rubbish);
    }

    fn drop_input(&mut self, octets: usize) {
        self.input.advance(octets);
        self.at = 0;
        self.searched = self.searched.saturating_sub(octets);
    }
}

/// The unread messages of a valid packet.
#[derive(Debug)]
struct Messages {
    version: Version,
    octets: Bytes,
}

impl Default for Messages {
    fn default() -> Self {
        Self {
            version: Version::As5669a,
            octets: Bytes::new(),
        }
    }
}

impl Iterator for Messages {
    type Item = Result<Frame, crate::wire::Error>;

    /// The next message, or its error, which ends the iteration.
    fn next(&mut self) -> Option<Self::Item> {
        if self.octets.is_empty() {
            return None;
        }
        let octets = std::mem::take(&mut self.octets);
        let read = match self.version {
            Version::As5669a => as5669a::parse(&octets, 0),
            Version::As5669 | Version::Ra => as5669::parse(&octets, 0),
        };
        Some(read.map(|(frame, end)| {
            self.octets = octets.slice(end..);
            frame
        }))
    }
}
