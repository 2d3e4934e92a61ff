//! Simulated RA vehicle with the behaviour of OpenJAUS 3.3.1's simulator: it reports over service
//! connections and obeys the component in control, or any component while there is none. It keeps
//! the last effort and applies it as long as its controller reports ready or standby over a service
//! connection. It keeps the last speed and applies it in any case. It does not report its
//! controller.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use bytes::{BufMut, Bytes, BytesMut};
use jaus_ra::{Message, RaId};

/// The vehicle's subsystem.
pub const SUBSYSTEM: u8 = 20;
/// Its primitive driver.
pub const DRIVER: RaId = RaId::new(SUBSYSTEM, 1, 33, 1);

/// A global pose from OpenJAUS 3.3.1.
pub const GLOBAL_POSE: &str = "ff00eb0eed3425c8ccc63a8ee3b8295c8f020000000000401304";

/// Decodes hexadecimal digits.
#[must_use]
pub fn bytes(hex: &str) -> Bytes {
    let octet = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
    (0..hex.len()).step_by(2).map(octet).collect()
}

/// A message in the framing "JAUS01.0".
#[must_use]
pub fn datagram(source: RaId, destination: RaId, code: u16, data: &[u8]) -> Bytes {
    let mut datagram = BytesMut::from(&b"JAUS01.0"[..]);
    datagram.put_u16_le(0x0206);
    datagram.put_u16_le(code);
    for id in [destination, source] {
        datagram.put_slice(&[id.instance, id.component, id.node, id.subsystem]);
    }
    datagram.put_u16_le(data.len() as u16);
    datagram.put_u16_le(0);
    datagram.put_slice(data);
    datagram.freeze()
}

/// The vehicle's state, without I/O.
#[derive(Default)]
pub struct Rover {
    /// The component in control, and its authority.
    pub controller: Option<(RaId, u8)>,
    /// Received wrench efforts.
    pub efforts: Vec<Bytes>,
    /// Waypoints in order of arrival, as OpenJAUS stores them.
    pub waypoints: Vec<Bytes>,
    /// Received travel speeds.
    pub speeds: Vec<Bytes>,
    /// Requested rates by report.
    pub connections: BTreeMap<u16, f64>,
    streams: BTreeMap<u16, Stream>,
    /// Whether it ignores queries for poses, velocities and waypoints.
    pub mute: bool,
    /// Whether its controller reports ready.
    pub controller_ready: bool,
    /// Whether it reports its controller, as RA systems other than OpenJAUS do.
    pub reports_control: bool,
    /// Time of the controller's last report of ready or standby.
    controller_heard: Option<Instant>,
    next_connection: Option<Instant>,
    /// The driver component under control.
    driver: Option<RaId>,
    /// Received vectors.
    pub vectors: Vec<Bytes>,
    /// Its primary status, as in Report Component Status.
    pub state: u8,
    said: Vec<Message>,
}

struct Stream {
    to: Message,
    period: Duration,
    next: Instant,
}

impl Rover {
    /// A vehicle in standby without a controller.
    #[must_use]
    pub fn new() -> Self {
        Self {
            state: 1,
            ..Self::default()
        }
    }

    /// An effort ends this long after the controller's last report of ready or standby.
    const CONTROLLER_TIMEOUT: Duration = Duration::from_millis(1500);

    /// Whether the vehicle moves at this time.
    #[must_use]
    pub fn drives(&self, now: Instant) -> bool {
        let heard = self.controller_heard.filter(|_| self.controller.is_some());
        let is_ready = heard.is_some_and(|at| now < at + Self::CONTROLLER_TIMEOUT);
        let pushes = |effort: &Bytes| effort[0] & 1 != 0 && effort[2..4] != [0, 0];
        let effort = is_ready && self.efforts.last().is_some_and(pushes);
        let is_fast = |speed: &Bytes| speed[..2] != [0, 0];
        // The smallest integer means no speed.
        let is_vector = |vector: &Bytes| vector[..4] != [1, 0, 0, 0x80];
        effort
            || self.speeds.last().is_some_and(is_fast)
            || self.vectors.last().is_some_and(is_vector)
    }

    /// Processes one message received.
    pub fn handle_message(&mut self, now: Instant, message: &Message) {
        let from = message.source;
        let obeys = self.controller.is_none_or(|(id, _)| id == from);
        let is_command = matches!(message.code, 0x0002..=0x0007 | 0x000E | 0x0400..=0x04FF);
        if is_command && !obeys {
            return;
        }
        match message.code {
            0x0008 => self.connect(now, message),
            0x000C => {
                let report = u16::from_le_bytes([message.data[0], message.data[1]]);
                self.streams.remove(&report);
                self.connections.remove(&report);
            }
            0x000D => self.request_control(message),
            0x000E if Some(message.destination) == self.driver => self.end_control(),
            0x200D if self.reports_control => {
                let id = self.controller.map_or(RaId::new(0, 0, 0, 0), |(id, _)| id);
                let body = vec![id.subsystem, id.node, id.component, id.instance, 0];
                self.said.push(message.answer(0x400D, body.into()));
            }
            0x0009 => {}
            0x4002 => {
                let is_controller = self.controller.is_some_and(|(id, _)| id == from);
                self.controller_ready = is_controller && message.data[0] == 1;
                if is_controller {
                    let may_drive = matches!(message.data[0], 1 | 2);
                    self.controller_heard = may_drive.then_some(now);
                    self.next_connection = Some(now + Self::CONTROLLER_TIMEOUT);
                }
            }
            0x0003 => self.state = 2,
            0x0004 => self.state = 1,
            0x0006 => self.state = 5,
            0x0007 => self.state = 2,
            0x0405 => self.efforts.push(message.data.clone()),
            0x040C => self.waypoints.push(message.data.clone()),
            0x040A => self.speeds.push(message.data.clone()),
            0x0408 => self.vectors.push(message.data.clone()),
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
            // Slightly more than 1.5 m/s forward.
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
        let rank = self.controller.map_or(0, |(_, rank)| rank);
        self.controller = Some((from, authority.max(rank)));
        self.driver = Some(message.destination);
        self.said
            .push(message.answer(0x000F, Bytes::from_static(&[0])));
        self.connect_to(message.destination, from);
    }

    /// Requests its controller's status five times a second.
    fn connect_to(&mut self, own: RaId, controller: RaId) {
        let body = bytes("02402c0100000000");
        let mut connect = Message::new(own, controller, 0x0008, body);
        connect.connection = true;
        self.said.push(connect);
    }

    fn end_control(&mut self) {
        if let Some((id, _)) = self.controller.take() {
            let body = Bytes::from_static(&[0x02, 0x40, 0]);
            let own = self.driver.unwrap_or(DRIVER);
            self.said.push(Message::new(own, id, 0x000C, body));
        }
        self.controller_heard = None;
        self.controller_ready = false;
        self.next_connection = None;
    }

    /// Gives control to another client.
    pub fn lose_controller(&mut self) {
        if let Some((id, _)) = self.controller.take() {
            self.said
                .push(Message::new(DRIVER, id, 0x0010, Bytes::new()));
        }
    }

    /// Sends all due messages.
    pub fn handle_timeout(&mut self, now: Instant) {
        if let Some((id, _)) = self.controller
            && self.next_connection.is_some_and(|due| due <= now)
        {
            self.next_connection = Some(now + Self::CONTROLLER_TIMEOUT);
            self.connect_to(self.driver.unwrap_or(DRIVER), id);
        }
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

    /// When to call `handle_timeout` next.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let streams = self.streams.values().map(|stream| stream.next);
        streams.chain(self.next_connection).min()
    }

    /// The messages to send.
    pub fn take_said(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.said)
    }
}
