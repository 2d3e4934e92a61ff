//! The 16-octet header of the Reference Architecture 3.x, which AS5669 adopted, and its UDP framing
//! "JAUS01.0".
//!
//! Layout, little-endian: properties (2), command code (2), destination (4), source (4), data
//! control (2: size in bits 0-11, fragment flag in bits 12-15), sequence number (2). Properties:
//! priority 0..=15 in bits 0-3, acknowledgement in 4-5, service connection in 6, experimental in 7,
//! version in 8-13.
//!
//! An RA id has four fields of one octet each. Read as a [`JausId`], its subsystem and node
//! together form the 16-bit subsystem number; [`RaId`] gives access to all four.

use bytes::{BufMut, Bytes, BytesMut};
use deku::prelude::*;

mod id;

use super::{
    Acknowledgement, Broadcast, DataControl, EncodeError, Error, Flags, Frame, Kind, Priority,
    Problem, Version,
};
use crate::address::JausId;
pub use id::{BadId, InvalidRaId, RaId, Recipients};

/// The first octets of an RA datagram.
pub const PREFIX: &[u8; 8] = b"JAUS01.0";
/// Octets of the header.
pub const HEADER_LEN: usize = 16;
/// Octets of the message code, which is a header field here and the beginning of the payload in a
/// [`Frame`].
pub const CODE_LEN: usize = 2;
/// The version bits of outgoing headers: RA 3.2 and 3.3.
const VERSION_3_3: u16 = 2 << 8;
/// The longest data that such a header may state (RA 3.3; the field could hold 4095).
pub const MAX_DATA: usize = 4080;

/// The fields of a header of version 2 (RA 3.2 and 3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fields {
    /// The priority, 0..=15; higher values are clamped.
    pub priority: u8,
    /// Whether the message requests an acknowledgement, or is one.
    pub acknowledgement: Acknowledgement,
    /// Whether the message belongs to a service connection.
    pub service_connection: bool,
    /// Whether its code is experimental.
    pub experimental: bool,
    /// The message (command) code.
    pub code: u16,
    /// The destination.
    pub destination: RaId,
    /// The source.
    pub source: RaId,
    /// The data flag, as in [`Header::data_flag`].
    pub data_flag: u8,
    /// Octets of data, at most [`MAX_DATA`]; higher values are clamped.
    pub data_size: usize,
    /// The sequence number.
    pub sequence: u16,
}

/// The header as it is on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, DekuRead)]
#[deku(endian = "little")]
pub struct Header {
    properties: u16,
    /// The message (command) code.
    pub code: u16,
    destination: u32,
    source: u32,
    data_control: u16,
    /// The sequence number; always 0 in some peers.
    pub sequence: u16,
}

impl Header {
    /// The priority, 0..=15; the default is 6.
    #[must_use]
    pub const fn priority(&self) -> u8 {
        (self.properties & 0xF) as u8
    }

    /// Whether the message belongs to a service connection.
    #[must_use]
    pub const fn service_connection(&self) -> bool {
        self.properties & 1 << 6 != 0
    }

    /// Whether the message is marked as experimental.
    #[must_use]
    pub const fn experimental(&self) -> bool {
        self.properties & 1 << 7 != 0
    }

    /// The version field: 0 is RA 2.x, 1 is 3.0 and 3.1, 2 is 3.2 and 3.3 (and AS5669).
    #[must_use]
    pub const fn header_version(&self) -> u8 {
        (self.properties >> 8 & 0x3F) as u8
    }

    /// The acknowledgement field.
    #[must_use]
    pub const fn acknowledgement(&self) -> Acknowledgement {
        Flags((self.properties & 0b11_0000) as u8).acknowledgement()
    }

    /// The data flag: 0 is a single message, 1 the first part of a large one, 2 a later part, 4 a
    /// retransmitted part, 8 the last; other values are undefined.
    #[must_use]
    pub const fn data_flag(&self) -> u8 {
        (self.data_control >> 12) as u8
    }

    /// Octets of data after the header.
    #[must_use]
    pub const fn data_size(&self) -> usize {
        (self.data_control & 0xFFF) as usize
    }

    /// The destination.
    #[must_use]
    pub const fn destination(&self) -> JausId {
        JausId::from_u32(self.destination)
    }

    /// The source.
    #[must_use]
    pub const fn source(&self) -> JausId {
        JausId::from_u32(self.source)
    }

    /// Reads a header from the beginning of `octets`.
    ///
    /// # Errors
    /// [`Problem::Truncated`] if there are too few octets for a header. The data size is not
    /// checked.
    #[inline]
    pub fn decode(octets: &[u8]) -> Result<Self, Problem> {
        let truncated = || Problem::Truncated {
            needed: HEADER_LEN,
            available: octets.len(),
        };
        let (_, header) = Self::from_bytes((octets, 0)).map_err(|_| truncated())?;
        Ok(header)
    }

    /// Priority, acknowledgement and data control translated to AS5669A; a wildcard makes the
    /// message a global broadcast.
    fn flags(&self) -> Result<Flags, Problem> {
        let data = match self.data_control >> 12 {
            0 => DataControl::Single,
            1 => DataControl::First,
            2 | 4 => DataControl::Middle,
            8 => DataControl::Last,
            other => return Err(Problem::UnknownDataControl(other as u8)),
        };
        Ok(Flags::new(priority_from_ra(self.priority()))
            .with_acknowledgement(self.acknowledgement())
            .with_broadcast(if self.destination().has_wildcard() {
                Broadcast::Global
            } else {
                Broadcast::None
            })
            .with_data(data))
    }

    /// Creates a header with these fields.
    #[must_use]
    pub fn new(fields: &Fields) -> Self {
        let flag = |set: bool, bit: u16| u16::from(set) << bit;
        let size = fields.data_size.min(MAX_DATA) as u16;
        Self {
            properties: VERSION_3_3
                | u16::from(fields.priority.min(15))
                | (fields.acknowledgement as u16) << 4
                | flag(fields.service_connection, 6)
                | flag(fields.experimental, 7),
            code: fields.code,
            destination: JausId::from(fields.destination).to_u32(),
            source: JausId::from(fields.source).to_u32(),
            data_control: u16::from(fields.data_flag & 0xF) << 12 | size,
            sequence: fields.sequence,
        }
    }

    /// Encodes the header.
    #[must_use]
    pub fn octets(&self) -> [u8; HEADER_LEN] {
        let mut octets = [0; HEADER_LEN];
        octets[..2].copy_from_slice(&self.properties.to_le_bytes());
        octets[2..4].copy_from_slice(&self.code.to_le_bytes());
        octets[4..8].copy_from_slice(&self.destination.to_le_bytes());
        octets[8..12].copy_from_slice(&self.source.to_le_bytes());
        octets[12..14].copy_from_slice(&self.data_control.to_le_bytes());
        octets[14..].copy_from_slice(&self.sequence.to_le_bytes());
        octets
    }

    /// The header of a frame with `data_size` octets of data, not counting the message code.
    fn from_frame(frame: &Frame, code: u16, data_size: usize) -> Self {
        let flags = frame.flags;
        Self::new(&Fields {
            priority: priority_to_ra(flags.priority()),
            acknowledgement: flags.acknowledgement(),
            service_connection: false,
            experimental: false,
            code,
            destination: frame.destination.into(),
            source: frame.source.into(),
            data_flag: match flags.data() {
                DataControl::Single => 0,
                DataControl::First => 1,
                DataControl::Middle => 2,
                DataControl::Last => 8,
            },
            data_size,
            sequence: frame.sequence,
        })
    }
}

/// Maps sixteen priorities to four, with the default 6 becoming standard, as Junior does.
const fn priority_from_ra(priority: u8) -> Priority {
    match priority {
        0..=5 => Priority::Low,
        6..=8 => Priority::Standard,
        9..=11 => Priority::High,
        _ => Priority::SafetyCritical,
    }
}

/// The middle of the range that [`priority_from_ra`] maps to the same priority.
const fn priority_to_ra(priority: Priority) -> u8 {
    3 * priority.bits() + 3
}

/// Reads the message after the "JAUS01.0" that ends at `offset`; returns it with its end.
///
/// # Errors
/// The header is incomplete, or its size does not fit the available octets.
pub fn parse(datagram: &Bytes, offset: usize) -> Result<(Frame, usize), Error> {
    parse_message(datagram, offset, Version::Ra)
}

/// Reads header and data at `offset`, and moves the code to the beginning of the payload.
pub(super) fn parse_message(
    datagram: &Bytes,
    offset: usize,
    version: Version,
) -> Result<(Frame, usize), Error> {
    let at = |problem| Error { offset, problem };
    let octets = datagram.get(offset..).unwrap_or_default();
    let header = Header::decode(octets).map_err(at)?;
    let (size, available) = (header.data_size(), octets.len() - HEADER_LEN);
    let data = octets
        .get(HEADER_LEN..HEADER_LEN + size)
        .ok_or_else(|| at(Problem::SizeTooLarge { size, available }))?;
    let mut payload = BytesMut::with_capacity(CODE_LEN + size);
    payload.put_u16_le(header.code);
    payload.put_slice(data);
    let frame = Frame {
        version,
        kind: Kind::default(),
        flags: header.flags().map_err(at)?,
        destination: header.destination(),
        source: header.source(),
        sequence: header.sequence,
        payload: payload.freeze(),
    };
    Ok((frame, offset + HEADER_LEN + size))
}

/// Appends header and data to `out`; on an error nothing is written.
///
/// # Errors
/// The payload has no code or exceeds [`MAX_DATA`], or the frame has a type or compression.
pub fn emit(frame: &Frame, out: &mut BytesMut) -> Result<(), EncodeError> {
    let length = frame.payload.len();
    let Some((code, data)) = frame.payload.split_first_chunk() else {
        return Err(EncodeError::NoMessageCode { length });
    };
    if frame.kind != Kind::default() {
        return Err(EncodeError::NotPlain);
    }
    if data.len() > MAX_DATA {
        return Err(EncodeError::PayloadTooLong {
            length,
            limit: CODE_LEN + MAX_DATA,
        });
    }
    let header = Header::from_frame(frame, u16::from_le_bytes(*code), data.len());
    out.put_slice(&header.octets());
    out.put_slice(data);
    Ok(())
}
