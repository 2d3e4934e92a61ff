//! A client that replays captured messages and records the vehicle's answers.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::net::{Ipv4Addr, UdpSocket};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{
    CancelEvent, ConfirmControl, ConfirmElementRequest, ConfirmEventRequest, CreateEvent, Event,
    QueryEvents, RejectControl, RejectEventRequest, ReleaseControl, RequestControl, Reset,
    SetElement, UpdateEvent, query_events::QueryEventsVar,
};
use jaus::wire::{Acknowledgement, Flags, Frame, judp};
use jaus_test_kit::waiting::LIMIT;

use crate::tool::judge::replay::capture::Said;
use crate::tool::judge::replay::vehicle::{VEHICLE, Vehicle};

/// Offset of the message in a datagram: version and header.
const MESSAGE: usize = 13;

/// Keeps the pauses of the capture, up to this limit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pauses(pub(crate) Duration);

/// A message, and the answers received before the next one was sent.
#[derive(Debug)]
pub(crate) struct Exchange {
    pub(crate) said: Frame,
    /// The vehicle's messages to any client, except events and its own queries.
    pub(crate) answers: Vec<Frame>,
}

/// A confirmed event stream.
#[derive(Debug, Clone, Copy)]
struct Stream {
    /// The id that the captured vehicle assigned.
    captured: u8,
    /// The id that our vehicle assigned.
    ours: u8,
    is_running: bool,
}

fn acknowledgement_of(query: &Frame) -> Frame {
    Frame {
        flags: Flags::default().with_acknowledgement(Acknowledgement::Positive),
        sequence: query.sequence,
        ..Frame::new(query.destination, query.source, Bytes::new())
    }
}

/// The client and its event streams.
pub(crate) struct Client {
    socket: UdpSocket,
    vehicle: Vehicle,
    streams: Vec<Stream>,
    /// The sequence numbers of the received events, by stream.
    events: BTreeMap<u8, Vec<u8>>,
    heard: VecDeque<Frame>,
    /// Whether it acknowledges messages that request it, as JAUS++ does and the judging tool does
    /// not.
    pub(crate) acknowledges: bool,
}

impl Client {
    pub(crate) fn new(vehicle: Vehicle) -> Self {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let options = socket2::SockRef::from(&socket);
        options.set_multicast_if_v4(&Ipv4Addr::LOCALHOST).unwrap();
        Self {
            socket,
            vehicle,
            streams: Vec::new(),
            events: BTreeMap::new(),
            heard: VecDeque::new(),
            acknowledges: false,
        }
    }

    /// Sends all messages in order, each after the answer to the one before.
    pub(crate) fn replay(&mut self, all: &[Said], pauses: Pauses) -> Vec<Exchange> {
        let mut exchanges = Vec::new();
        for (number, said) in all.iter().enumerate() {
            let next = all
                .get(number + 1)
                .map_or(Duration::ZERO, |next| next.pause);
            exchanges.push(self.say(said, next.min(pauses.0)));
        }
        exchanges
    }

    /// Sends one message. Receives until the answer has arrived and the pause is over.
    fn say(&mut self, said: &Said, pause: Duration) -> Exchange {
        let start = Instant::now();
        let datagram = self.with_our_stream(said);
        let frame = first(&datagram).unwrap();
        let result = if said.frame.destination.has_wildcard() {
            self.socket.send_to(&datagram, self.vehicle.group)
        } else {
            self.socket.send_to(&datagram, self.vehicle.address)
        };
        result.unwrap();
        let wanted = answers_to(said.code());
        let mut answers: Vec<Frame> = Vec::new();
        loop {
            let is_answered = wanted.is_empty()
                || answers.iter().any(|answer| {
                    answer.destination == said.frame.source
                        && wanted.contains(&answer.code().unwrap())
                });
            let until = if is_answered { pause } else { LIMIT.max(pause) };
            match self.hear(start + until) {
                Some(answer) => answers.push(answer),
                None => break,
            }
        }
        self.note_streams(said, &answers);
        Exchange {
            said: frame,
            answers,
        }
    }

    /// The next answer before the deadline. Events are counted, and queries skipped.
    fn hear(&mut self, deadline: Instant) -> Option<Frame> {
        let mut buffer = [0; 65_536];
        loop {
            while let Some(frame) = self.heard.pop_front() {
                let code = frame.code()?;
                if let Ok(event) = Event::decode(&frame.payload) {
                    let events = self.events.entry(event.event_id).or_default();
                    events.push(event.sequence_number);
                } else if code >> 12 != 2 {
                    return Some(frame);
                }
            }
            let left = deadline.checked_duration_since(Instant::now())?;
            let left = left.max(Duration::from_millis(1));
            self.socket.set_read_timeout(Some(left)).unwrap();
            if let Ok((length, from)) = self.socket.recv_from(&mut buffer) {
                let frames = judp::frames(Bytes::copy_from_slice(&buffer[..length])).unwrap();
                let of_vehicle: Vec<_> = frames.map_while(Result::ok).collect();
                for query in of_vehicle.iter().filter(|_| self.acknowledges) {
                    if query.flags.acknowledgement() == Acknowledgement::Request {
                        let answer = judp::encode(&acknowledgement_of(query)).unwrap();
                        self.socket.send_to(&answer, from).unwrap();
                    }
                }
                let of_vehicle = of_vehicle.into_iter();
                let of_vehicle = of_vehicle.filter(|frame| frame.source == VEHICLE);
                self.heard
                    .extend(of_vehicle.filter(|frame| frame.code().is_some()));
            }
        }
    }

    /// Receives only events for a while. Returns their sequence numbers by stream.
    pub(crate) fn listen(&mut self, time: Duration) -> BTreeMap<u8, Vec<u8>> {
        self.events.clear();
        let deadline = Instant::now() + time;
        while self.hear(deadline).is_some() {}
        std::mem::take(&mut self.events)
    }

    /// The datagram, with the captured vehicle's event id replaced by our vehicle's.
    fn with_our_stream(&self, said: &Said) -> Vec<u8> {
        let mut datagram = said.datagram.clone();
        let Some((at, captured)) = stream_in(&said.frame.payload) else {
            return datagram;
        };
        let mut named = self
            .streams
            .iter()
            .filter(|stream| stream.captured == captured);
        let running = named.clone().find(|stream| stream.is_running);
        // A stream may be queried after its end.
        if let Some(stream) = running.or(named.next_back()) {
            assert_eq!(datagram[MESSAGE + at], captured);
            datagram[MESSAGE + at] = stream.ours;
        }
        datagram
    }

    fn note_streams(&mut self, said: &Said, answers: &[Frame]) {
        let mut answers = answers.iter();
        let confirmation =
            answers.find_map(|answer| ConfirmEventRequest::decode(&answer.payload).ok());
        let Some(confirmation) = confirmation else {
            return;
        };
        match said.code() {
            CreateEvent::CODE => self.streams.push(Stream {
                captured: said.event_id.unwrap_or(confirmation.event_id),
                ours: confirmation.event_id,
                is_running: true,
            }),
            CancelEvent::CODE => {
                let ended = |stream: &&mut Stream| stream.ours == confirmation.event_id;
                self.streams
                    .iter_mut()
                    .filter(ended)
                    .for_each(|stream| stream.is_running = false);
            }
            _ => {}
        }
    }

    /// The ids of the streams that our vehicle has confirmed and that were not cancelled.
    pub(crate) fn running(&self) -> BTreeSet<u8> {
        let running = self.streams.iter().filter(|stream| stream.is_running);
        running.map(|stream| stream.ours).collect()
    }
}

/// The event id in a message and its offset.
fn stream_in(message: &Bytes) -> Option<(usize, u8)> {
    let at = match u16::from_le_bytes(*message.first_chunk()?) {
        // Code, request id, type, rate.
        UpdateEvent::CODE => 6,
        // Code, request id.
        CancelEvent::CODE => 3,
        // Code, variant.
        QueryEvents::CODE => {
            let query = QueryEvents::decode(message).ok()?;
            matches!(query.query_events_var, QueryEventsVar::EventIdRec(_)).then_some(3)?
        }
        _ => return None,
    };
    Some((at, *message.get(at)?))
}

/// The codes of which one must answer; none for commands and for answers to the vehicle's own
/// queries.
pub(crate) fn answers_to(code: u16) -> Vec<u16> {
    match code {
        CreateEvent::CODE => vec![ConfirmEventRequest::CODE, RejectEventRequest::CODE],
        UpdateEvent::CODE | CancelEvent::CODE => vec![ConfirmEventRequest::CODE],
        RequestControl::CODE => vec![ConfirmControl::CODE],
        // The client that resets is in control and loses it.
        ReleaseControl::CODE | Reset::CODE => vec![RejectControl::CODE],
        SetElement::CODE => vec![ConfirmElementRequest::CODE],
        query if query >> 12 == 2 => vec![query + 0x2000],
        _ => Vec::new(),
    }
}

/// Whether the exchange has the required answer.
pub(crate) fn is_answered(exchange: &Exchange) -> bool {
    let wanted = answers_to(exchange.said.code().unwrap());
    let to: JausId = exchange.said.source;
    let is_it =
        |answer: &Frame| answer.destination == to && wanted.contains(&answer.code().unwrap());
    wanted.is_empty() || exchange.answers.iter().any(is_it)
}

fn first(datagram: &[u8]) -> Option<Frame> {
    let frames = judp::frames(Bytes::copy_from_slice(datagram)).ok()?;
    frames.map_while(Result::ok).next()
}
