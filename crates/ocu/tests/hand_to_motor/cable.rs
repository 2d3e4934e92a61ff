//! The network between one page and the station, as TCP shows it: frames of a connection arrive in
//! order, a lost packet delays all that follow it, and all connections of the page share the rate. A cut
//! holds frames back; connections break, for one end sooner than for the other.

use std::collections::{BTreeMap, HashMap};
use std::time::Duration;

use jaus_test_kit::random::Random;

/// A connection: the page's load, and the number of the socket.
pub(crate) type Connection = (u64, u64);

/// What passes over a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Frame {
    /// The page asks for a WebSocket at this path, with these subprotocols.
    Open(String, Vec<String>),
    /// The station has opened it.
    Opened,
    Text(String),
    Close,
}

/// Quality of the link, in each direction.
#[derive(Clone, Debug)]
pub(crate) struct Wire {
    pub(crate) delay: Duration,
    pub(crate) jitter: Duration,
    /// Lost packets per 1000.
    pub(crate) lost: u32,
    /// Octets in a second; `None` for more than matters.
    pub(crate) rate: Option<f64>,
}

impl Wire {
    pub(crate) const fn good() -> Self {
        Self {
            delay: Duration::from_millis(2),
            jitter: Duration::from_millis(1),
            lost: 0,
            rate: None,
        }
    }

    /// The longest time that a small packet takes without loss.
    pub(crate) fn one_way(&self) -> Duration {
        self.delay + self.jitter + self.time_of(2 * SMALL)
    }

    fn time_of(&self, octets: usize) -> Duration {
        self.rate.map_or(Duration::ZERO, |rate| {
            Duration::from_secs_f64(octets as f64 / rate)
        })
    }
}

/// Octets of a setpoint or a stop with its headers.
const SMALL: usize = 100;
/// Octets of the headers of WebSocket, TCP and IP.
const HEADERS: usize = 58;
/// The least time until TCP sends a packet again.
const RETRANSMISSION: Duration = Duration::from_millis(200);

pub(crate) struct Cable {
    pub(crate) wire: Wire,
    random: Random,
    cut_at: Option<Duration>,
    pub(crate) up: Direction,
    pub(crate) down: Direction,
}

#[derive(Default)]
pub(crate) struct Direction {
    busy_until: Duration,
    /// When the last frame of a connection arrives.
    last: HashMap<Connection, Duration>,
    flights: BTreeMap<(Duration, u64), (Connection, Frame)>,
    /// What waits for the end of a cut.
    held: Vec<(Connection, Frame)>,
    launched: u64,
}

impl Cable {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            wire: Wire::good(),
            random: Random::new(seed),
            cut_at: None,
            up: Direction::default(),
            down: Direction::default(),
        }
    }

    pub(crate) const fn is_cut(&self) -> bool {
        self.cut_at.is_some()
    }

    pub(crate) fn cut(&mut self, now: Duration) {
        self.cut_at.get_or_insert(now);
    }

    /// Ends a cut. TCP tries again after pauses that have grown with its length.
    pub(crate) fn restore(&mut self, now: Duration) {
        let Some(begun) = self.cut_at.take() else {
            return;
        };
        let pause = self.random.between(&(Duration::ZERO..(now - begun) / 2));
        for direction in [&mut self.up, &mut self.down] {
            for (connection, frame) in std::mem::take(&mut direction.held) {
                direction.launch(now + pause, connection, frame, &self.wire, &mut self.random);
            }
        }
    }

    /// Makes it good again: what waits in the queue of a slow link goes out at once.
    pub(crate) fn mend(&mut self, now: Duration) {
        self.wire = Wire::good();
        for direction in [&mut self.up, &mut self.down] {
            direction.busy_until = now;
            direction.last.clear();
            for (connection, frame) in std::mem::take(&mut direction.flights).into_values() {
                direction.launch(now, connection, frame, &self.wire, &mut self.random);
            }
        }
    }

    pub(crate) fn send_up(&mut self, now: Duration, connection: Connection, frame: Frame) {
        if self.is_cut() {
            return self.up.held.push((connection, frame));
        }
        // Before the request there are two packets of TCP.
        let now = match frame {
            Frame::Open(..) => now + 2 * self.wire.one_way(),
            _ => now,
        };
        self.up
            .launch(now, connection, frame, &self.wire, &mut self.random);
    }

    pub(crate) fn send_down(&mut self, now: Duration, connection: Connection, frame: Frame) {
        if self.is_cut() {
            return self.down.held.push((connection, frame));
        }
        self.down
            .launch(now, connection, frame, &self.wire, &mut self.random);
    }

    /// Forgets what is on its way over a connection.
    pub(crate) fn forget(&mut self, connection: Connection) {
        for direction in [&mut self.up, &mut self.down] {
            direction.flights.retain(|_, (it, _)| *it != connection);
            direction.held.retain(|(it, _)| *it != connection);
        }
    }
}

impl Direction {
    fn launch(
        &mut self,
        now: Duration,
        connection: Connection,
        frame: Frame,
        wire: &Wire,
        random: &mut Random,
    ) {
        let octets = match &frame {
            Frame::Open(..) | Frame::Opened => 500,
            Frame::Text(text) => text.len() + HEADERS,
            Frame::Close => HEADERS,
        };
        self.busy_until = self.busy_until.max(now) + wire.time_of(octets);
        let mut arrival = self.busy_until + wire.delay;
        if !wire.jitter.is_zero() {
            arrival += random.between(&(Duration::ZERO..wire.jitter));
        }
        let mut pause = RETRANSMISSION.max(3 * wire.delay);
        while random.happens(wire.lost) {
            arrival += pause;
            pause *= 2;
        }
        let last = self.last.entry(connection).or_default();
        *last = arrival.max(*last);
        self.launched += 1;
        self.flights
            .insert((*last, self.launched), (connection, frame));
    }

    /// The next frame that has arrived by now.
    pub(crate) fn receive(&mut self, now: Duration) -> Option<(Connection, Frame)> {
        let entry = self.flights.first_entry()?;
        (entry.key().0 <= now).then(|| entry.remove())
    }
}
