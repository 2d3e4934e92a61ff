//! The pcap format: a file header of 24 octets, then record headers of 16 octets, each followed by
//! a frame.

use std::io::Read;

use super::input::{Input, LONGEST};
use super::{CaptureError, Fault, LinkType, Packet};
use crate::time::Timestamp;

const HEADER: usize = 24;
const RECORD: usize = 16;

/// Byte order of the writing machine, and resolution of fractional seconds.
#[derive(Clone, Copy)]
pub(super) struct Endian {
    big: bool,
    nanoseconds: bool,
}

impl Endian {
    /// Detects a pcap file by its magic number; `None` if it is another file.
    pub(super) fn of_magic(magic: &[u8]) -> Option<Self> {
        let (big, nanoseconds) = match magic {
            [0xa1, 0xb2, 0xc3, 0xd4] => (true, false),
            [0xd4, 0xc3, 0xb2, 0xa1] => (false, false),
            [0xa1, 0xb2, 0x3c, 0x4d] => (true, true),
            [0x4d, 0x3c, 0xb2, 0xa1] => (false, true),
            _ => return None,
        };
        Some(Self { big, nanoseconds })
    }

    fn u32(self, octets: &[u8; RECORD], at: usize) -> u32 {
        let octets = [octets[at], octets[at + 1], octets[at + 2], octets[at + 3]];
        if self.big {
            u32::from_be_bytes(octets)
        } else {
            u32::from_le_bytes(octets)
        }
    }
}

/// File header data that applies to all records.
pub(super) struct Header {
    endian: Endian,
    link: LinkType,
}

impl Header {
    /// Reads the file header after the magic number.
    pub(super) fn read<R: Read>(
        endian: Endian,
        input: &mut Input<R>,
    ) -> Result<Self, CaptureError> {
        // Version, two unused words and the snap length, then the link type.
        let mut rest = [0; HEADER - 4];
        let held = input.fill(&mut rest)?;
        if held < rest.len() {
            return Err(CaptureError::CutShort {
                offset: 0,
                what: "file header",
                wanted: HEADER as u64,
                held: input.offset(),
            });
        }
        // The upper half may contain the length of the frame check sequence.
        let link = if endian.big {
            u16::from_be_bytes([rest[18], rest[19]])
        } else {
            u16::from_le_bytes([rest[16], rest[17]])
        };
        Ok(Self {
            endian,
            link: LinkType(link),
        })
    }

    /// Advances to the next record, whose frame is then in the input's buffer.
    pub(super) fn next_packet<R: Read>(
        &self,
        input: &mut Input<R>,
    ) -> Result<Option<Packet>, Fault> {
        let offset = input.offset();
        let mut record = [0; RECORD];
        let held = input.fill(&mut record)?;
        if held == 0 {
            return Ok(None);
        }
        let cut_short = |what, wanted, held| CaptureError::CutShort {
            offset,
            what,
            wanted,
            held,
        };
        if held < RECORD {
            Err(cut_short("packet header", RECORD as u64, held as u64))?;
        }
        let captured = self.endian.u32(&record, 8);
        if captured > LONGEST {
            Err(CaptureError::Damaged {
                offset,
                problem: format!("a packet of {captured} octets"),
            })?;
        }
        let held = input.take(captured)?;
        if held < captured {
            let header = RECORD as u64;
            Err(cut_short(
                "packet",
                header + u64::from(captured),
                header + u64::from(held),
            ))?;
        }
        Ok(Some(Packet {
            time: Some(self.time(&record)),
            link: self.link,
            length: self.endian.u32(&record, 12),
            lost: 0,
            octets: 0..captured as usize,
            interface: 0,
        }))
    }

    fn time(&self, record: &[u8; RECORD]) -> Timestamp {
        let seconds = i64::from(self.endian.u32(record, 0));
        let fraction = self.endian.u32(record, 4);
        if self.endian.nanoseconds {
            Timestamp::new(seconds, fraction, 9)
        } else {
            // A fraction of one second or more carries over. Real writers exceed this by a few
            // seconds at most.
            Timestamp::new(seconds, fraction.saturating_mul(1000), 6)
        }
    }
}
