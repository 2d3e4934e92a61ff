//! The pcapng format: a chain of blocks, of which packets and interface descriptions are evaluated.
//!
//! <https://www.ietf.org/archive/id/draft-ietf-opsawg-pcapng-02.html>. Every block states its
//! length, so unknown or invalid blocks can be skipped.

use std::io::Read;
use std::ops::Range;

use super::input::{Input, LONGEST};
use super::{CaptureError, Fault, LinkType, Packet};
use crate::time::Timestamp;

/// Type of a Section Header Block. Identical in both byte orders.
pub(super) const SECTION_HEADER: [u8; 4] = [0x0a, 0x0d, 0x0d, 0x0a];
const INTERFACE_DESCRIPTION: u32 = 1;
const OBSOLETE_PACKET: u32 = 2;
const SIMPLE_PACKET: u32 = 3;
const ENHANCED_PACKET: u32 = 6;

const OPTION_NAME: u16 = 2;
const OPTION_TIME_RESOLUTION: u16 = 9;
const OPTION_TIME_OFFSET: u16 = 14;

const SHORTEST_BLOCK: u32 = 12;
const SHORTEST_HEADER: u32 = 28;
const TOO_SHORT: &str = "a packet block that is too short";

/// Limit of the name of an interface, in octets.
const LONGEST_NAME: usize = 256;

/// Limit of interface descriptions kept. A capture has only a handful of interfaces.
const MOST_INTERFACES: usize = 4096;

/// The current section: its byte order and the interfaces described so far.
pub(super) struct Section {
    big_endian: bool,
    interfaces: Vec<Interface>,
}

/// Content of an Interface Description Block.
struct Interface {
    name: String,
    link: LinkType,
    snap_length: u32,
    ticks: Ticks,
    time_offset: i64,
}

/// `if_tsresol`: the unit of time stamps.
#[derive(Clone, Copy)]
enum Ticks {
    /// 10^-n seconds.
    Decimal(u8),
    /// 2^-n seconds.
    Binary(u8),
}

impl Interface {
    fn time(&self, ticks: u64) -> Timestamp {
        let (per_second, decimals) = match self.ticks {
            Ticks::Decimal(n) => (10_u64.checked_pow(n.into()), n),
            Ticks::Binary(n) => (1_u64.checked_shl(n.into()), 9),
        };
        // At a resolution beyond 64 bits, time stamps are fractions of a second only.
        let per_second = u128::from(per_second.unwrap_or(u64::MAX));
        let ticks = u128::from(ticks);
        let seconds = i64::try_from(ticks / per_second).unwrap_or(i64::MAX);
        let nanos = (ticks % per_second) * 1_000_000_000 / per_second;
        Timestamp::new(
            seconds.saturating_add(self.time_offset),
            u32::try_from(nanos).unwrap_or(0),
            decimals,
        )
    }
}

impl Section {
    /// Reads the section header at the start of the file, after its type.
    pub(super) fn read_first<R: Read>(input: &mut Input<R>) -> Result<Self, CaptureError> {
        let mut section = Self {
            big_endian: false,
            interfaces: Vec::new(),
        };
        section.enter(input, 0)?;
        Ok(section)
    }

    /// Reads a section header. Its type is at `offset` and has already been read.
    fn enter<R: Read>(&mut self, input: &mut Input<R>, offset: u64) -> Result<(), CaptureError> {
        let mut begin = [0; 8];
        let held = input.fill(&mut begin)?;
        if held < begin.len() {
            return Err(cut_short(offset, SHORTEST_HEADER, held as u32 + 4));
        }
        let [l0, l1, l2, l3, order @ ..] = begin;
        self.big_endian = match order {
            [0x1a, 0x2b, 0x3c, 0x4d] => true,
            [0x4d, 0x3c, 0x2b, 0x1a] => false,
            _ => return Err(damaged(offset, "a section header without byte order")),
        };
        self.interfaces.clear();
        let length = self.u32([l0, l1, l2, l3]);
        if !(SHORTEST_HEADER..=LONGEST).contains(&length) {
            return Err(damaged(offset, "a section header of wrong length"));
        }
        let held = input.take(length - 12)?;
        if held < length - 12 {
            return Err(cut_short(offset, length, held + 12));
        }
        Ok(())
    }

    /// Advances to the next packet block, whose body is then in the input's buffer.
    pub(super) fn next_packet<R: Read>(
        &mut self,
        input: &mut Input<R>,
    ) -> Result<Option<Packet>, Fault> {
        loop {
            let offset = input.offset();
            let Some(kind) = self.next_block(input, offset)? else {
                return Ok(None);
            };
            // The block ends with a copy of its length.
            let Some((body, _length)) = input.taken().split_last_chunk::<4>() else {
                continue;
            };
            let found = match kind {
                INTERFACE_DESCRIPTION => self.describe(body).map(|()| None),
                ENHANCED_PACKET => self.enhanced_packet(body).map(Some),
                SIMPLE_PACKET => self.simple_packet(body).map(Some),
                OBSOLETE_PACKET => self.obsolete_packet(body).map(Some),
                _ => Ok(None),
            };
            match found {
                Ok(None) => {}
                Ok(packet) => return Ok(packet),
                Err(problem) => {
                    // The start of the next block is still known.
                    return Err(Fault {
                        error: damaged(offset, problem),
                        last: false,
                    });
                }
            }
        }
    }

    /// Reads the body of the block at `offset` and returns its type. Enters a new section
    /// immediately.
    fn next_block<R: Read>(
        &mut self,
        input: &mut Input<R>,
        offset: u64,
    ) -> Result<Option<u32>, CaptureError> {
        let mut kind = [0; 4];
        let held = input.fill(&mut kind)?;
        if held == 0 {
            return Ok(None);
        }
        if kind == SECTION_HEADER {
            self.enter(input, offset)?;
            return Ok(Some(u32::from_be_bytes(kind)));
        }
        let mut length = [0; 4];
        let held = held + input.fill(&mut length)?;
        if held < 8 {
            return Err(cut_short(offset, SHORTEST_BLOCK, held as u32));
        }
        let (kind, length) = (self.u32(kind), self.u32(length));
        if !(SHORTEST_BLOCK..=LONGEST).contains(&length) || length % 4 != 0 {
            return Err(damaged(offset, &format!("a block of {length} octets")));
        }
        let held = input.take(length - 8)?;
        if held < length - 8 {
            return Err(cut_short(offset, length, held + 8));
        }
        Ok(Some(kind))
    }

    /// Stores an Interface Description Block.
    fn describe(&mut self, body: &[u8]) -> Result<(), &'static str> {
        if self.interfaces.len() >= MOST_INTERFACES {
            return Err("one interface description too many");
        }
        let mut fields = self.fields(body);
        let (Some(link), Some(_reserved), Some(snap_length)) =
            (fields.u16(), fields.u16(), fields.u32())
        else {
            return Err("an interface description that is too short");
        };
        let mut interface = Interface {
            name: String::new(),
            link: LinkType(link),
            snap_length,
            ticks: Ticks::Decimal(6),
            time_offset: 0,
        };
        while let Some((code, value)) = fields.option() {
            match (code, value) {
                (OPTION_NAME, name) if name.len() <= LONGEST_NAME => {
                    interface.name = String::from_utf8_lossy(name).into_owned();
                }
                (OPTION_TIME_RESOLUTION, &[n]) if n & 0x80 != 0 => {
                    interface.ticks = Ticks::Binary(n & 0x7f);
                }
                (OPTION_TIME_RESOLUTION, &[n]) => interface.ticks = Ticks::Decimal(n),
                (OPTION_TIME_OFFSET, value) => {
                    let mut fields = self.fields(value);
                    interface.time_offset = fields.u64().map_or(0, u64::cast_signed);
                }
                _ => {}
            }
        }
        self.interfaces.push(interface);
        Ok(())
    }

    fn enhanced_packet(&self, body: &[u8]) -> Result<Packet, &'static str> {
        let mut fields = self.fields(body);
        let interface = fields.u32().ok_or(TOO_SHORT)?;
        self.stamped_packet(interface, fields)
    }

    fn obsolete_packet(&self, body: &[u8]) -> Result<Packet, &'static str> {
        let mut fields = self.fields(body);
        let interface = fields.u16().ok_or(TOO_SHORT)?;
        let _drops = fields.u16().ok_or(TOO_SHORT)?;
        self.stamped_packet(interface.into(), fields)
    }

    /// Reads the common part of the two blocks with a time stamp.
    fn stamped_packet(&self, id: u32, mut fields: Fields<'_>) -> Result<Packet, &'static str> {
        let interface = self.interface(id)?;
        let (Some(high), Some(low), Some(captured), Some(length)) =
            (fields.u32(), fields.u32(), fields.u32(), fields.u32())
        else {
            return Err(TOO_SHORT);
        };
        let octets = fields.range(captured as usize).ok_or(TOO_SHORT)?;
        Ok(Packet {
            time: Some(interface.time(u64::from(high) << 32 | u64::from(low))),
            link: interface.link,
            length,
            lost: fields.lost_before(captured as usize),
            octets,
            interface: id,
        })
    }

    /// Reads a Simple Packet Block: no time, always the first interface, only the original length.
    fn simple_packet(&self, body: &[u8]) -> Result<Packet, &'static str> {
        let interface = self.interface(0)?;
        let mut fields = self.fields(body);
        let length = fields.u32().ok_or(TOO_SHORT)?;
        let captured = match interface.snap_length {
            0 => length,
            snap_length => length.min(snap_length),
        };
        Ok(Packet {
            time: None,
            link: interface.link,
            length,
            lost: 0,
            octets: fields.range(captured as usize).ok_or(TOO_SHORT)?,
            interface: 0,
        })
    }

    /// The name of an interface; empty if it has none.
    pub(super) fn interface_name(&self, id: u32) -> &str {
        self.interfaces.get(id as usize).map_or("", |it| &it.name)
    }

    fn interface(&self, id: u32) -> Result<&Interface, &'static str> {
        let interface = self.interfaces.get(id as usize);
        interface.ok_or("a packet from an interface that is not described")
    }

    fn u32(&self, octets: [u8; 4]) -> u32 {
        if self.big_endian {
            u32::from_be_bytes(octets)
        } else {
            u32::from_le_bytes(octets)
        }
    }

    fn fields<'a>(&self, body: &'a [u8]) -> Fields<'a> {
        Fields {
            big_endian: self.big_endian,
            octets: body,
            at: 0,
        }
    }
}

/// A reader for the fields of a block body.
struct Fields<'a> {
    big_endian: bool,
    octets: &'a [u8],
    at: usize,
}

impl<'a> Fields<'a> {
    fn range(&mut self, length: usize) -> Option<Range<usize>> {
        let range = self.at..self.at.checked_add(length)?;
        self.octets.get(range.clone())?;
        self.at = range.end;
        Some(range)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let range = self.range(N)?;
        self.octets[range].try_into().ok()
    }

    fn u16(&mut self) -> Option<u16> {
        let octets = self.array()?;
        Some(if self.big_endian {
            u16::from_be_bytes(octets)
        } else {
            u16::from_le_bytes(octets)
        })
    }

    fn u32(&mut self) -> Option<u32> {
        let octets = self.array()?;
        Some(if self.big_endian {
            u32::from_be_bytes(octets)
        } else {
            u32::from_le_bytes(octets)
        })
    }

    fn u64(&mut self) -> Option<u64> {
        let octets = self.array()?;
        Some(if self.big_endian {
            u64::from_be_bytes(octets)
        } else {
            u64::from_le_bytes(octets)
        })
    }

    /// The drop count in the options after a packet of `captured` octets.
    fn lost_before(&mut self, captured: usize) -> u64 {
        // All fields are padded to a multiple of four octets.
        let padding = captured.next_multiple_of(4) - captured;
        if self.range(padding).is_none() {
            return 0;
        }
        while let Some((code, value)) = self.option() {
            if code == super::writer::LOST
                && let Ok(octets) = value.try_into()
            {
                return if self.big_endian {
                    u64::from_be_bytes(octets)
                } else {
                    u64::from_le_bytes(octets)
                };
            }
        }
        0
    }

    /// The next option as code and value; `None` at the end or if it exceeds the block.
    fn option(&mut self) -> Option<(u16, &'a [u8])> {
        let (code, length) = (self.u16()?, self.u16()?);
        if code == 0 {
            return None;
        }
        let value = self.range(length.into())?;
        let padding = value.len().next_multiple_of(4) - value.len();
        self.range(padding)?;
        Some((code, &self.octets[value]))
    }
}

fn cut_short(offset: u64, wanted: u32, held: u32) -> CaptureError {
    CaptureError::CutShort {
        offset,
        what: "block",
        wanted: wanted.into(),
        held: held.into(),
    }
}

fn damaged(offset: u64, problem: &str) -> CaptureError {
    CaptureError::Damaged {
        offset,
        problem: problem.to_owned(),
    }
}
