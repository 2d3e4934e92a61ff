//! Rows of an explanation for the transport headers around messages.

use bytes::Bytes;
use jaus::wire::ra::{self, RaId};
use jaus::wire::{
    Broadcast, DataControl, Flags, Frame, Kind as WireKind, Version, as5669, as5669a, judp,
};
use jaus_cli::failure::Failure;
use jsidl::dynamic::Raw;
use jsidl::explain::{Explanation, Kind, Row};

/// A datagram that holds at least one plausible message.
pub(super) struct Datagram {
    octets: Bytes,
    version: Version,
    /// Each message with the offsets of its header and its end.
    frames: Vec<(usize, Frame, usize)>,
}

impl Datagram {
    /// Decodes the octets, if they are a datagram.
    pub(super) fn recognised(octets: &Bytes) -> Option<Self> {
        let mut frames = judp::frames(octets.clone()).ok()?;
        let version = frames.version();
        let mut found = Vec::new();
        loop {
            let start = frames.offset();
            let Some(frame) = frames.next() else { break };
            found.push((start, frame.ok()?, frames.offset()));
        }
        let (_, first, _) = found.first()?;
        first.is_plausible().then(|| Self {
            octets: octets.clone(),
            version,
            frames: found,
        })
    }

    pub(super) fn version(&self) -> Version {
        self.version
    }

    /// For example `A JUDP datagram (AS5669A) of 18 octets`.
    pub(super) fn title(&self) -> String {
        let standard = match self.version {
            Version::As5669a => "AS5669A",
            Version::As5669 => "AS5669",
            Version::Ra => "Reference Architecture",
        };
        format!(
            "A JUDP datagram ({standard}) of {} octets",
            self.octets.len()
        )
    }

    /// All rows, and the explained messages; `explain` returns `None` for unknown messages.
    pub(super) fn rows(
        &self,
        explain: impl Fn(&Frame) -> Result<Option<Explanation>, Failure>,
    ) -> Result<(Vec<Row>, Vec<Explanation>), Failure> {
        let mut rows = Rows {
            octets: &self.octets,
            position: 0,
            rows: Vec::new(),
        };
        let mut messages = Vec::new();
        let prefix = self.frames.first().map_or(0, |(start, ..)| *start);
        rows.take(prefix, "transport").name = Some(self.version.name().to_owned());
        for (start, frame, end) in &self.frames {
            rows.position = *start;
            rows.header(frame);
            if frame.flags.data() != DataControl::Single {
                rows.unread(end - trailer(frame), PART);
            } else if frame.is_acknowledgement() {
                // Only a header.
            } else if let Some(message) = explain(frame)? {
                rows.message(&message, frame.version);
                messages.push(message);
            } else {
                rows.unread(end - trailer(frame), NOBODYS);
            }
            if trailer(frame) > 0 {
                rows.number(trailer(frame), "sequence number");
            }
        }
        rows.unread(self.octets.len(), "stale octets after the last message");
        Ok((rows.rows, messages))
    }
}

/// Note on a fragment.
const PART: &str = "a fragment of a large message: reassemble it first";
/// Note on data with an unknown layout.
const NOBODYS: &str = "not defined in the Reference Architecture; choose another layout with \
    --service";

/// Octets of a frame after its message.
const fn trailer(frame: &Frame) -> usize {
    match frame.version {
        Version::As5669a => as5669a::TRAILER_LEN,
        Version::As5669 | Version::Ra => 0,
    }
}

/// For example `priority standard, broadcast none, ack request, data single`.
fn flags(flags: Flags) -> String {
    let broadcast = flags.broadcast().map_or("reserved", Broadcast::name);
    format!(
        "priority {}, broadcast {broadcast}, ack {}, data {}",
        flags.priority(),
        flags.acknowledgement(),
        flags.data()
    )
}

/// Consecutive rows.
struct Rows<'a> {
    octets: &'a [u8],
    position: usize,
    rows: Vec<Row>,
}

impl Rows<'_> {
    /// Adds a row of the next octets, and returns it for additions.
    fn take(&mut self, length: usize, field: &str) -> &mut Row {
        let end = (self.position + length).min(self.octets.len());
        let octets = self.octets.get(self.position..end).unwrap_or_default();
        let row = Row::new(Kind::Header, field, self.position, octets);
        self.position = end;
        let index = self.rows.len();
        self.rows.push(row);
        &mut self.rows[index]
    }

    /// The next octets as a little-endian number.
    fn number(&mut self, length: usize, field: &str) -> &mut Row {
        let row = self.take(length, field);
        let octets = row.octets.iter().rev();
        let number = octets.fold(0, |number, octet| number << 8 | u64::from(*octet));
        row.raw = Some(Raw::Unsigned(number));
        row
    }

    /// Adds a row of the unread octets before `end`, if any.
    fn unread(&mut self, end: usize, why: &str) {
        let length = end.saturating_sub(self.position);
        if length > 0 {
            let row = self.take(length, "");
            row.kind = Kind::Unread;
            row.note = Some(why.to_owned());
        }
    }

    fn header(&mut self, frame: &Frame) {
        match frame.version {
            Version::As5669a => self.as5669a(frame),
            Version::As5669 => {
                self.number(2, "header compression");
                // The only big-endian number in the header.
                let row = self.take(as5669::PREFIX_LEN - 2, "length");
                row.note = Some("of header and data, big-endian".to_owned());
                self.ra(frame);
            }
            Version::Ra => self.ra(frame),
        }
    }

    fn as5669a(&mut self, frame: &Frame) {
        let kind = self.number(1, "message type");
        if frame.kind == WireKind::default() {
            kind.note = Some("a JAUS message, header not compressed".to_owned());
        }
        let size = self.number(2, "size");
        size.note = Some("octets from the message type to the sequence number".to_owned());
        if frame.kind.has_compression_fields() {
            self.number(1, "header compression number");
            self.number(1, "header compression length");
        }
        self.number(1, "flags").note = Some(flags(frame.flags));
        self.addresses(frame);
    }

    /// The header of the Reference Architecture, which AS5669 adopted.
    fn ra(&mut self, frame: &Frame) {
        self.number(2, "properties").note = Some(flags(frame.flags));
        let code = self.number(ra::CODE_LEN, "");
        code.kind = Kind::Code;
        self.addresses(frame);
        self.number(2, "data control");
        self.number(2, "sequence number");
    }

    fn addresses(&mut self, frame: &Frame) {
        for (field, id) in [("destination", frame.destination), ("source", frame.source)] {
            let shown = match frame.version {
                Version::Ra => RaId::from(id).to_string(),
                _ => id.to_string(),
            };
            self.number(4, field).name = Some(shown);
        }
    }

    /// The rows of the next message; in the older headers its code comes earlier.
    fn message(&mut self, message: &Explanation, version: Version) {
        let before = match version {
            Version::As5669a => 0,
            Version::As5669 | Version::Ra => ra::CODE_LEN,
        };
        let rows = message.rows.iter().filter(|row| row.offset >= before);
        for row in rows {
            let mut row = row.clone();
            row.offset = row.offset - before + self.position;
            self.rows.push(row);
        }
        let length: usize = message.rows.iter().map(|row| row.octets.len()).sum();
        self.position += length.saturating_sub(before);
    }
}
