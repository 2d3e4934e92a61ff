//! Reading a serial line as it comes, with noise in it.

use bytes::{Buf, Bytes, BytesMut};

use super::packet::{Fault, Packet, Progress};
use super::{DLE, MAX_CONTENT, SOH};
use crate::wire::{Frame, Version, as5669, as5669a};

/// What a line has brought. The numbers only grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// Sound packets.
    pub packets: u64,
    /// Messages in them.
    pub messages: u64,
    /// Octets that belong to no sound packet.
    pub rubbish_octets: u64,
    /// What looked like the beginning of a packet, but has no sound header.
    pub bad_headers: u64,
    /// Packets with more messages than this side takes.
    pub too_long: u64,
    /// Packets with a marker in the wrong place, cut short or lengthened.
    pub bad_forms: u64,
    /// Packets whose content does not have the stated checksum.
    pub bad_checksums: u64,
    /// Sound packets in which a message does not fit its own sizes; the rest of such a packet is
    /// lost.
    pub malformed: u64,
}

/// The receiving side of a line: octets in, frames out.
///
/// Give it what arrives with [`push`](Self::push) and take frames until there are no more, each
/// time. It holds at most one unfinished packet, as it came and unstuffed.
///
/// Noise costs the packets that it hits. Whatever cannot become a packet any more is searched for
/// another beginning right behind its own, since a DLE from the noise may have hidden the next
/// packet's; content is gone through twice at the most.
#[derive(Debug)]
pub struct Decoder {
    limit: usize,
    /// What has come, from the beginning of the packet that is being read.
    input: BytesMut,
    /// How much of it has been read.
    at: usize,
    /// How much of it was content of a packet that failed. What fails in there is not gone
    /// through again.
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
    /// A decoder that takes packets of any length.
    #[must_use]
    pub fn new() -> Self {
        Self::with_limit(MAX_CONTENT)
    }

    /// A decoder that takes packets with at most `limit` octets of messages.
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

    /// What the line has brought so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// How many octets wait for the rest of their packet.
    #[must_use]
    pub fn buffered(&self) -> usize {
        self.input.len()
    }

    /// Takes what has arrived.
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

    /// Reads on to the end of the next sound packet; whether there is one.
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

    /// Finds the beginning of a packet, and drops what stands before it.
    fn begin(&mut self) -> Option<Packet> {
        let found = self.input.windows(2).position(|pair| pair == [DLE, SOH]);
        let rubbish = found.unwrap_or_else(|| {
            // The last octet may be half of a beginning.
            self.input.len() - usize::from(self.input.last() == Some(&DLE))
        });
        self.counters.rubbish_octets += rubbish as u64;
        self.drop_input(rubbish);
        found?;
        self.at = 2;
        Some(Packet::new(self.limit))
    }

    /// Reads what has arrived into a packet, up to its end.
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

    /// Counts why there is no packet here, and lets the search go on.
    fn give_up(&mut self, fault: Fault, had_header: bool) {
        *match fault {
            Fault::Header => &mut self.counters.bad_headers,
            Fault::TooLong => &mut self.counters.too_long,
            Fault::Form => &mut self.counters.bad_forms,
            Fault::Checksum => &mut self.counters.bad_checksums,
        } += 1;
        // A false header ends within a few octets, but content can be long.
        let rubbish = if had_header && self.searched > 0 {
            // The last two may be the marker that broke it, and begin the next packet.
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

/// The messages of a sound packet that have not been read yet.
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

    /// The next message, or what is wrong with it; behind a wrong one there is none.
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
