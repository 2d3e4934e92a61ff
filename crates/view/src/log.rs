//! Decoding of the messages in a capture's datagrams.

use std::net::IpAddr;

use bytes::Bytes;
use serde_json::{Map, Value as Json};

use super::dictionary::{Dictionary, Reading};
use super::hex::from_hex;
use super::large::LargeMessages;
use super::line::{Content, Envelope, Header, Line};
use super::network::Datagram;
use super::time::Timestamp;
use jaus::wire::{self, DataControl, Frame, Version, judp};

/// When a message arrived, and from which network address, as far as known.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    pub(super) time: Option<Timestamp>,
    pub(super) from: Option<IpAddr>,
}

/// Decodes datagrams one by one and yields a [`Line`] for every message.
///
/// Octets after the messages of a datagram are ignored silently, because JAUS++ leaves remains of
/// older, longer messages there. Sometimes such remains look like a message. Therefore, data after
/// the first message is accepted only if its header is plausible ([`Frame::is_plausible`]) and its
/// source is on the same node as that of the first message, since a datagram comes from a single
/// node.
#[derive(Debug)]
pub struct MessageLog<'d> {
    dictionary: &'d Dictionary,
    large: LargeMessages,
    stale_octets: u64,
}

impl<'d> MessageLog<'d> {
    /// Creates a log that decodes with `dictionary`.
    pub fn new(dictionary: &'d Dictionary) -> Self {
        Self {
            dictionary,
            large: LargeMessages::default(),
            stale_octets: 0,
        }
    }

    /// Number of octets ignored after messages so far.
    pub fn stale_octets(&self) -> u64 {
        self.stale_octets
    }

    /// Number of large messages with missing fragments so far.
    pub fn incomplete_messages(&self) -> u64 {
        self.large.incomplete()
    }

    /// An object of a line whose writer had no definition of the message, or of the one inside an
    /// event, with the fields that the definitions here give it. Others stay as they are.
    pub(super) fn decoded(&self, mut object: Map<String, Json>) -> Map<String, Json> {
        let carried = object.get_mut("carries").and_then(Json::as_object_mut);
        if let Some(carried) = carried {
            *carried = self.decoded(std::mem::take(carried));
            return object;
        }
        let octets = object.get("octets").and_then(Json::as_str);
        let Some(Ok(octets)) = octets.map(from_hex) else {
            return object;
        };
        let line = self.dictionary.line(&octets.into());
        let decoded = serde_json::to_value(&line);
        if let (false, Ok(Json::Object(decoded))) = (line.is_error(), decoded) {
            object.retain(|key, _| !["error", "offset", "octets"].contains(&key.as_str()));
            object.extend(decoded);
        }
        object
    }

    /// The messages of a datagram, or the reason why there are none.
    pub fn read(&mut self, time: Option<Timestamp>, datagram: &Datagram<'_>) -> Vec<Line<'d>> {
        let mut lines = Vec::new();
        let octets = Bytes::copy_from_slice(&datagram.payload);
        let arrival = Arrival {
            time,
            from: Some(datagram.source.ip()),
        };
        if let Err(error) = self.messages(arrival, octets, &mut lines) {
            let envelope = Envelope { time, header: None };
            let sentence = match datagram.missing {
                0 => error.to_string(),
                missing => format!("{error}; the capture truncated {missing} octets"),
            };
            let offset = error.offset as u64;
            lines.push(Line::of_error(Some(envelope), &sentence, offset));
        }
        let envelopes = lines.iter_mut().filter_map(|line| line.envelope.as_mut());
        for header in envelopes.filter_map(|it| it.header.as_mut()) {
            header.by_tcp = datagram.by_tcp;
        }
        lines
    }

    /// Adds the lines of a datagram's messages.
    fn messages(
        &mut self,
        arrival: Arrival,
        octets: Bytes,
        lines: &mut Vec<Line<'d>>,
    ) -> Result<(), wire::Error> {
        let mut frames = judp::frames(octets)?;
        let mut sender = None;
        loop {
            let rest = frames.remaining();
            let frame = frames.next().transpose()?.filter(|frame| {
                let node = frame.source.whole_node();
                *sender.get_or_insert(node) == node
            });
            let Some(frame) = frame else {
                self.stale_octets += rest as u64;
                return Ok(());
            };
            self.message(arrival, &frame, lines);
        }
    }

    /// Adds the line of a message, and of a large message that it completes.
    fn message(&mut self, arrival: Arrival, frame: &Frame, lines: &mut Vec<Line<'d>>) {
        let envelope = Envelope {
            time: arrival.time,
            header: Some(Header::of(frame)),
        };
        if frame.is_acknowledgement() {
            lines.push(self.bare(envelope, None, Content::Empty));
        } else if frame.flags.data() != DataControl::Single {
            lines.push(self.fragment(envelope, frame));
            lines.extend(self.whole(arrival, frame));
        } else {
            lines.push(self.line(envelope, &frame.payload));
        }
    }

    /// The line of a complete message. `None` for acknowledgements and incomplete messages.
    pub(super) fn whole_message(&mut self, arrival: Arrival, frame: &Frame) -> Option<Line<'d>> {
        if frame.is_acknowledgement() {
            return None;
        }
        if frame.flags.data() != DataControl::Single {
            return self.whole(arrival, frame);
        }
        let envelope = Envelope {
            time: arrival.time,
            header: Some(Header::of(frame)),
        };
        Some(self.line(envelope, &frame.payload))
    }

    /// The line of a complete message, with the message inside an event.
    fn line(&self, envelope: Envelope, octets: &Bytes) -> Line<'d> {
        let header = envelope.header.clone();
        match self.reading(header.as_ref(), octets) {
            Some(reading) => Line::of_reading(Some(envelope), reading, octets)
                .opened(|carried| self.reading(header.as_ref(), carried)),
            None => {
                let code = octets.first_chunk().map(|&code| u16::from_le_bytes(code));
                self.bare(envelope, code, Content::Octets(octets.clone()))
            }
        }
    }

    /// The fields of a message by the definitions that its header determines; `None` for an unknown
    /// message of the Reference Architecture.
    ///
    /// Those share codes and names with the messages of services, but not layouts. Decoding them
    /// with service definitions would produce wrong values.
    fn reading(&self, header: Option<&Header>, octets: &Bytes) -> Option<Reading<'d>> {
        let transport = header.map(|header| header.transport);
        let reading = self.ra(header).and_then(|ra| ra.read_ra(octets));
        match (reading, transport) {
            (Some(reading), _) if reading.body.is_ok() => Some(reading),
            (reading, Some(Version::Ra)) => reading,
            // With the other older header, a service message may come from a subsystem number that
            // resembles the Reference Architecture.
            (of_ra, _) => {
                let reading = self.dictionary.read(octets);
                Some(of_ra.filter(|_| reading.body.is_err()).unwrap_or(reading))
            }
        }
    }

    /// The dictionary, if the message may belong to the Reference Architecture.
    fn ra(&self, header: Option<&Header>) -> Option<&'d Dictionary> {
        let is_ra = header.is_some_and(Header::is_ra);
        is_ra.then_some(self.dictionary)
    }

    fn fragment(&self, envelope: Envelope, frame: &Frame) -> Line<'d> {
        // Only the first fragment reliably starts with the code. The older headers contain it.
        let has_code =
            frame.version != Version::As5669a || frame.flags.data() == DataControl::First;
        let code = frame.code().filter(|_| has_code);
        self.bare(envelope, code, Content::Fragment(frame.payload.len()))
    }

    /// The line of the large message that this fragment completes.
    fn whole(&mut self, arrival: Arrival, frame: &Frame) -> Option<Line<'d>> {
        let whole = self.large.insert(arrival.from, frame)?;
        let envelope = Envelope {
            time: arrival.time,
            header: Some(Header {
                data: "whole",
                sequence: whole.sequence,
                ..Header::of(frame)
            }),
        };
        let line = self.line(envelope.clone(), &whole.plain);
        let Some(octets) = whole.without_repeated_code.filter(|_| line.is_error()) else {
            return Some(line);
        };
        let other = self.line(envelope, &octets);
        Some(if other.is_error() { line } else { other })
    }

    /// A line without a body.
    fn bare(&self, envelope: Envelope, code: Option<u16>, content: Content) -> Line<'d> {
        let name = |code| {
            let ra = self.ra(envelope.header.as_ref());
            ra.and_then(|ra| ra.ra_name_of(code))
                .or_else(|| self.dictionary.name_of(code))
        };
        let message = code.and_then(name);
        let octets = match &content {
            Content::Octets(octets) => Some(octets.clone()),
            _ => None,
        };
        Line {
            envelope: Some(envelope),
            code,
            message,
            service: None,
            version: None,
            content,
            carried: None,
            octets,
        }
    }
}
