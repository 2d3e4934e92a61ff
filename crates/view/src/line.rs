//! One message as one JSON object: the output format of `jaus decode`, one per line.

use bytes::Bytes;
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::capture::CaptureError;
use super::definition::{Body, Unreadable};
use super::dictionary::{Dictionary, Reading};
use super::hex::{from_hex, to_hex};
use super::time::Timestamp;
use jaus::address::JausId;
use jaus::wire::ra::RaId;
use jaus::wire::{self, Frame, Version};

/// A message, or the reason why it is unreadable.
///
/// Serializes as one object with the keys in the order given here. Unknown values are omitted.
#[derive(Debug, Clone)]
pub struct Line<'d> {
    /// `time`, `source`, `destination`, `transport`, `priority`, `broadcast`, `ack`, `data`,
    /// `sequence`: capture time and transport header. Absent for bare messages.
    pub envelope: Option<Envelope>,
    /// `code`: four hexadecimal digits.
    pub code: Option<u16>,
    /// `message`: its name in the definition.
    pub message: Option<&'d str>,
    /// `service`: the URN of a service that defines it.
    pub service: Option<&'d str>,
    /// `version`: of the service, unless it is the one tried first.
    pub version: Option<jsidl::model::Version>,
    /// The content of the message.
    pub content: Content,
    /// `carries`: the message inside an event or a request for events, as an object of this kind.
    pub carried: Option<Box<Self>>,
    /// The message from its code on, unless this is a fragment, an acknowledgement or an error
    /// outside any message. Not in the object.
    pub octets: Option<Bytes>,
}

/// The content of a [`Line`].
#[derive(Debug, Clone)]
pub enum Content {
    /// `body`: the fields.
    Body(Body),
    /// `length`: the size in octets of a fragment of a large message. The message follows when it
    /// is complete.
    Fragment(usize),
    /// `octets`: the message in hexadecimal, if no definition of its body is available.
    Octets(Bytes),
    /// Nothing: an acknowledgement.
    Empty,
    /// `error` and `offset`; then `octets`, the whole message, if there is one.
    Unreadable {
        /// Description of the error.
        error: String,
        /// Offset of the error: in a message counted from its code, in a datagram or a file from
        /// its first octet.
        offset: u64,
        /// The message concerned.
        octets: Option<Bytes>,
    },
}

/// Capture time and transport header of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Envelope {
    /// Capture time.
    pub time: Option<Timestamp>,
    /// The transport header; `None` if it was unreadable.
    pub header: Option<Header>,
}

/// The fields of a transport header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// The sender.
    pub source: JausId,
    /// The destination.
    pub destination: JausId,
    /// Version of the header.
    pub transport: Version,
    /// Whether it came by TCP.
    pub by_tcp: bool,
    /// Priority, broadcast, acknowledgement.
    pub flags: wire::Flags,
    /// `single`, `first`, `middle` or `last`; `whole` for a reassembled message.
    pub data: &'static str,
    /// The sequence number; that of the first fragment for a reassembled message.
    pub sequence: u16,
}

impl Line<'_> {
    /// Whether the line reports an error.
    pub fn is_error(&self) -> bool {
        matches!(self.content, Content::Unreadable { .. })
    }

    /// The object as text, without a line ending.
    pub fn to_json(&self) -> String {
        // Serialising to memory fails only for non-text map keys, which do not occur.
        serde_json::to_string(self).unwrap_or_default()
    }
}

impl Dictionary {
    /// The message as a line without transport keys.
    pub fn line(&self, octets: &Bytes) -> Line<'_> {
        let line = Line::of_reading(None, self.read(octets), octets);
        line.opened(|carried| Some(self.read(carried)))
    }
}

/// The messages with a message inside: Create Event, Update Event, Create Command Event, Event. The
/// Reference Architecture has the same codes and field names.
const CARRIERS: [u16; 4] = [0x01F0, 0x01F1, 0x01F6, 0x41F1];
/// The fields with the message inside.
pub(super) const CARRIED: [&str; 3] = ["ReportMessage", "QueryMessage", "CommandMessage"];

/// The message inside the body of an event or a request for events.
fn carried(body: &Body) -> Option<Bytes> {
    let body = serde_json::to_value(body).ok()?;
    let text = CARRIED
        .iter()
        .find_map(|&field| body.get(field)?.as_str())?;
    let octets = from_hex(text).ok()?;
    (!octets.is_empty()).then(|| octets.into())
}

impl<'d> Line<'d> {
    /// Creates the line of a decoded message.
    pub(super) fn of_reading(
        envelope: Option<Envelope>,
        reading: Reading<'d>,
        octets: &Bytes,
    ) -> Self {
        let content = match reading.body {
            Ok(body) => Content::Body(body),
            Err(Unreadable { problem, offset }) => Content::Unreadable {
                error: problem,
                offset: offset as u64,
                octets: (!octets.is_empty()).then(|| octets.clone()),
            },
        };
        Self {
            envelope,
            code: reading.code,
            message: reading.message,
            service: reading.service,
            version: reading.version,
            content,
            carried: None,
            octets: Some(octets.clone()),
        }
    }

    /// Adds the message inside an event or a request for events, decoded by `read`. A further
    /// message inside that one stays as it is.
    pub(super) fn opened(self, read: impl FnOnce(&Bytes) -> Option<Reading<'d>>) -> Self {
        let is_carrier = self.code.is_some_and(|code| CARRIERS.contains(&code));
        let octets = match &self.content {
            Content::Body(body) if is_carrier => carried(body),
            _ => None,
        };
        let carried = octets.and_then(|octets| {
            let line = Self::of_reading(None, read(&octets)?, &octets);
            Some(Box::new(line))
        });
        Self { carried, ..self }
    }

    /// Creates the line of an error outside any message.
    pub fn of_error(envelope: Option<Envelope>, error: &impl ToString, offset: u64) -> Self {
        Self {
            envelope,
            code: None,
            message: None,
            service: None,
            version: None,
            content: Content::Unreadable {
                error: error.to_string(),
                offset,
                octets: None,
            },
            carried: None,
            octets: None,
        }
    }
}

impl From<&CaptureError> for Line<'_> {
    fn from(error: &CaptureError) -> Self {
        Self::of_error(None, error, error.offset())
    }
}

impl Header {
    pub(super) fn of(frame: &Frame) -> Self {
        Self {
            source: frame.source,
            destination: frame.destination,
            transport: frame.version,
            by_tcp: false,
            flags: frame.flags,
            data: frame.flags.data().name(),
            sequence: frame.sequence,
        }
    }

    /// Whether the message belongs to the Reference Architecture, judged by header version and
    /// source.
    pub(super) fn is_ra(&self) -> bool {
        RaId::in_header(self.transport, self.source).is_some()
    }

    /// Formats an id such as `42.1.1`. Reference Architecture ids have four parts.
    fn id(&self, id: JausId) -> String {
        if self.transport == Version::Ra || self.is_ra() {
            RaId::from(id).to_string()
        } else {
            id.to_string()
        }
    }
}

impl Serialize for Line<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        if let Some(envelope) = &self.envelope {
            envelope.write(&mut map)?;
        }
        if let Some(code) = self.code {
            map.serialize_entry("code", &format_args!("{code:04X}"))?;
        }
        if let Some(message) = self.message {
            map.serialize_entry("message", message)?;
        }
        if let Some(service) = self.service {
            map.serialize_entry("service", service)?;
        }
        if let Some(version) = self.version {
            map.serialize_entry("version", &format_args!("{version}"))?;
        }
        match &self.content {
            Content::Body(body) => map.serialize_entry("body", body)?,
            Content::Fragment(length) => map.serialize_entry("length", length)?,
            Content::Octets(octets) => map.serialize_entry("octets", &to_hex(octets))?,
            Content::Empty => {}
            Content::Unreadable {
                error,
                offset,
                octets,
            } => {
                map.serialize_entry("error", error)?;
                map.serialize_entry("offset", offset)?;
                if let Some(octets) = octets {
                    map.serialize_entry("octets", &to_hex(octets))?;
                }
            }
        }
        if let Some(carried) = &self.carried {
            map.serialize_entry("carries", carried)?;
        }
        map.end()
    }
}

impl Envelope {
    fn write<M: SerializeMap>(&self, map: &mut M) -> Result<(), M::Error> {
        if let Some(time) = self.time {
            map.serialize_entry("time", &format_args!("{time}"))?;
        }
        let Some(header) = &self.header else {
            return Ok(());
        };
        let flags = header.flags;
        map.serialize_entry("source", &header.id(header.source))?;
        map.serialize_entry("destination", &header.id(header.destination))?;
        let name = header.transport.name();
        let transport = if header.by_tcp {
            name.replace("judp", "jtcp")
        } else {
            name.to_owned()
        };
        map.serialize_entry("transport", &transport)?;
        map.serialize_entry("priority", flags.priority().name())?;
        let broadcast = flags.broadcast().map_or("reserved", wire::Broadcast::name);
        map.serialize_entry("broadcast", broadcast)?;
        map.serialize_entry("ack", flags.acknowledgement().name())?;
        map.serialize_entry("data", header.data)?;
        map.serialize_entry("sequence", &header.sequence)
    }
}
