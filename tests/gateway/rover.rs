//! An RA vehicle as OpenJAUS 3.3.1's simulator behaves: it reports by service connections, obeys the
//! component in control, and wants to know that this one is ready.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::ra::{Message, RaId};

pub(crate) const SUBSYSTEM: u8 = 20;
pub(crate) const DRIVER: RaId = RaId::new(SUBSYSTEM, 1, 33, 1);

/// A global pose of a running OpenJAUS 3.3.1.
pub(crate) const GLOBAL_POSE: &str = "ff00eb0eed3425c8ccc63a8ee3b8295c8f020000000000401304";

pub(crate) fn bytes(hex: &str) -> Bytes {
    let octet = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
    (0..hex.len()).step_by(2).map(octet).collect()
}

#[derive(Default)]
pub(crate) struct Rover {
    pub(crate) controller: Option<(RaId, u8)>,
    /// Wrench efforts of the controller.
    pub(crate) efforts: Vec<Bytes>,
    /// Waypoints in the order in which they came, as OpenJAUS keeps them.
    pub(crate) waypoints: Vec<Bytes>,
    /// Speeds of travel.
    pub(crate) speeds: Vec<Bytes>,
    /// Rates that were asked for, by report.
    pub(crate) connections: BTreeMap<u16, f64>,
    streams: BTreeMap<u16, Stream>,
    /// Whether it answers no queries for poses, velocities and waypoints.
    pub(crate) mute: bool,
    /// What its controller says of itself.
    pub(crate) controller_ready: bool,
    pub(crate) state: u8,
    said: Vec<Message>,
}

struct Stream {
    to: Message,
    period: Duration,
    next: Instant,
}

impl Rover {
    pub(crate) fn new() -> Self {
        Self {
            state: 1,
            ..Self::default()
        }
    }

    pub(crate) fn handle_message(&mut self, now: Instant, message: &Message) {
        let from = message.source;
        match message.code {
            0x0008 => self.connect(now, message),
            0x000C => {
                let report = u16::from_le_bytes([message.data[0], message.data[1]]);
                self.streams.remove(&report);
                self.connections.remove(&report);
            }
            0x000D => self.request_control(message),
            0x000E => self.controller = None,
            0x0009 => {}
            0x4002 => {
                let is_controller = self.controller.is_some_and(|(id, _)| id == from);
                self.controller_ready = is_controller && message.data[0] == 1;
            }
            0x0003 => self.state = 2,
            0x0004 => self.state = 1,
            0x0006 => self.state = 5,
            0x0007 => self.state = 2,
            0x0405 if self.controller.is_some_and(|(id, _)| id == from) => {
                self.efforts.push(message.data.clone());
            }
            0x040C if self.controller.is_some_and(|(id, _)| id == from) => {
                self.waypoints.push(message.data.clone());
            }
            0x040A if self.controller.is_some_and(|(id, _)| id == from) => {
                self.speeds.push(message.data.clone());
            }
            0x240C if !self.mute => {
                let mut waypoints = self.waypoints.iter();
                if let Some(held) = waypoints.find(|held| held[1..3] == message.data[..2]) {
                    self.said.push(message.answer(0x440C, held.clone()));
                }
            }
            0x2002 => self.answer(message, 0x4002),
            0x2402 | 0x2404 | 0x2405 if !self.mute => {
                self.answer(message, message.code + 0x2000);
            }
            _ => {}
        }
    }

    fn answer(&mut self, query: &Message, report: u16) {
        self.said.push(query.answer(report, self.report(report)));
    }

    fn report(&self, report: u16) -> Bytes {
        match report {
            0x4002 => Bytes::from(vec![self.state, 0, 0, 0, 0]),
            0x4402 => bytes(GLOBAL_POSE),
            // A little more than 1.5 m/s forward.
            0x4404 => bytes("ff00fb8401000000000000000000b98d06000000000000000000"),
            _ => bytes("ff000000000000000000000000000000"),
        }
    }

    fn connect(&mut self, now: Instant, message: &Message) {
        let report = u16::from_le_bytes([message.data[0], message.data[1]]);
        let rate = [message.data[2], message.data[3]];
        let hz = f64::from(u16::from_le_bytes(rate)) * 1092.0 / 65535.0;
        self.connections.insert(report, hz);
        let stream = Stream {
            to: message.clone(),
            period: Duration::from_secs_f64(1.0 / hz),
            next: now,
        };
        self.streams.insert(report, stream);
        let mut body = message.data[..2].to_vec();
        body.extend([0, rate[0], rate[1], 0]);
        let mut confirm = message.answer(0x0009, body.into());
        confirm.connection = true;
        self.said.push(confirm);
    }

    fn request_control(&mut self, message: &Message) {
        let authority = message.data[0];
        let from = message.source;
        let refused = self
            .controller
            .is_some_and(|(id, rank)| id != from && rank >= authority);
        if refused {
            self.said.push(message.answer(0x0010, Bytes::new()));
            return;
        }
        if let Some((before, rank)) = self.controller
            && authority > rank
            && before.subsystem != SUBSYSTEM
        {
            self.said
                .push(Message::new(DRIVER, before, 0x0010, Bytes::new()));
        }
        self.controller = Some((from, authority));
        self.said
            .push(message.answer(0x000F, Bytes::from_static(&[0])));
        // It wants to know that its controller is ready, five times a second.
        let body = bytes("02402c0100000000");
        let mut connect = Message::new(message.destination, from, 0x0008, body);
        connect.connection = true;
        self.said.push(connect);
    }

    /// Somebody else takes control.
    pub(crate) fn lose_controller(&mut self) {
        if let Some((id, _)) = self.controller.take() {
            self.said
                .push(Message::new(DRIVER, id, 0x0010, Bytes::new()));
        }
    }

    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        let mut due = Vec::new();
        for (&report, stream) in self.streams.iter_mut().filter(|(_, it)| it.next <= now) {
            stream.next = now + stream.period;
            due.push((report, stream.to.clone()));
        }
        for (report, to) in due {
            let mut message = to.answer(report, self.report(report));
            message.connection = true;
            self.said.push(message);
        }
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.streams.values().map(|stream| stream.next).min()
    }

    pub(crate) fn take_said(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.said)
    }
}
