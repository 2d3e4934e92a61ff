//! Two endpoints and a simulated wire with delay, loss and a bottleneck, in virtual time.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::*;

/// The conditions on the wire.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conditions {
    pub(super) delay: Duration,
    /// The largest random extra delay; it reorders datagrams.
    pub(super) jitter: Duration,
    /// Datagrams lost, per 1000.
    pub(super) loss: u64,
    /// The most datagrams in transit in one direction; more are lost.
    pub(super) room: usize,
}

impl Default for Conditions {
    fn default() -> Self {
        Self {
            delay: Duration::from_micros(500),
            jitter: Duration::ZERO,
            loss: 0,
            room: usize::MAX,
        }
    }
}

/// Arrival time, serial number, receiving end and octets.
type Arrival = (Instant, u64, usize, Vec<u8>);

/// [`US`] at one end, [`PEER`] at the other.
pub(super) struct Wire {
    pub(super) ends: [Endpoint; 2],
    pub(super) now: Instant,
    pub(super) conditions: Conditions,
    chance: u64,
    sent: u64,
    under_way: BinaryHeap<Reverse<Arrival>>,
    /// The events and deliveries at each end.
    pub(super) told: [Vec<Event>; 2],
    inboxes: [Inbox; 2],
    /// How many datagrams each end has sent.
    pub(super) datagrams: [usize; 2],
}

impl Wire {
    pub(super) fn new(seed: u64, conditions: Conditions) -> Self {
        Self::with(seed, conditions, &Config::default())
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    pub(super) fn with(seed: u64, conditions: Conditions, config: &Config) -> Self {
        let end = |host, id| {
            let mut endpoint = Endpoint::new(config.clone());
            endpoint.add_link(WIRE, LinkProfile::judp(path(host).peer.socket()));
            endpoint.attach(id).unwrap();
            endpoint
        };
        Self {
            ends: [end(OUR_HOST, US), end(PEER_HOST, PEER)],
            now: Instant::now(),
            conditions,
            chance: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1,
            sent: 0,
            under_way: BinaryHeap::new(),
            told: [Vec::new(), Vec::new()],
            inboxes: Default::default(),
            datagrams: [0, 0],
        }
    }

    /// A random number below `limit`.
    fn draw(&mut self, limit: u64) -> u64 {
        self.chance ^= self.chance << 13;
        self.chance ^= self.chance >> 7;
        self.chance ^= self.chance << 17;
        self.chance % limit.max(1)
    }

    pub(super) fn send(&mut self, message: Outgoing) -> MessageHandle {
        let inbox = &mut self.inboxes[0];
        let message = self.ends[0].send(self.now, message, inbox).unwrap();
        self.carry();
        message
    }

    /// Collects the output of both ends.
    fn carry(&mut self) {
        for end in 0..2 {
            while let Some(transmit) = self.ends[end].poll_transmit(self.now) {
                let length = transmit.segment.unwrap_or(transmit.payload.len());
                for datagram in transmit.payload.chunks(length) {
                    self.put_on(end, datagram);
                }
            }
            while let Some(event) = self.ends[end].poll_event() {
                self.told[end].push(event);
            }
        }
    }

    fn put_on(&mut self, from: usize, datagram: &[u8]) {
        self.datagrams[from] += 1;
        let to = 1 - from;
        let room = self.conditions.room;
        let ahead = || {
            self.under_way
                .iter()
                .filter(|entry| entry.0.2 == to)
                .count()
        };
        let full = room < usize::MAX && ahead() >= room;
        if full || self.draw(1000) < self.conditions.loss {
            return;
        }
        let jitter = self.draw(1 + self.conditions.jitter.as_micros() as u64);
        let at = self.now + self.conditions.delay + Duration::from_micros(jitter);
        self.sent += 1;
        let entry = (at, self.sent, to, datagram.to_vec());
        self.under_way.push(Reverse(entry));
    }

    /// Advances to the next event; returns whether there was one before `end`.
    fn step(&mut self, end: Instant) -> bool {
        let arrival = self.under_way.peek().map(|entry| entry.0.0);
        let timeouts = self.ends.iter().filter_map(Endpoint::poll_timeout);
        let Some(next) = timeouts.chain(arrival).min().filter(|&next| next <= end) else {
            return false;
        };
        self.now = self.now.max(next);
        while let Some(Reverse((at, ..))) = self.under_way.peek()
            && *at <= self.now
            && let Some(Reverse((_, _, to, datagram))) = self.under_way.pop()
        {
            let from = path([PEER_HOST, OUR_HOST][to]);
            let inbox = &mut self.inboxes[to];
            self.ends[to].handle_datagram(self.now, from, datagram.into(), inbox);
        }
        for end in &mut self.ends {
            if end.poll_timeout().is_some_and(|at| at <= self.now) {
                end.handle_timeout(self.now);
            }
        }
        self.carry();
        true
    }

    /// Advances time until nothing more happens, or for at most `time`; returns the time passed.
    pub(super) fn run_for(&mut self, time: Duration) -> Duration {
        let (begin, end) = (self.now, self.now + time);
        while self.step(end) {}
        self.now - begin
    }

    /// The payloads delivered at the other end.
    pub(super) fn delivered(&mut self) -> Vec<Bytes> {
        let messages = self.inboxes[1].messages.drain(..);
        messages.map(|received| received.payload).collect()
    }

    /// The delivery results at our end.
    pub(super) fn results(&mut self) -> Vec<Event> {
        let is_result = |event: &Event| {
            matches!(
                event,
                Event::Acknowledged { .. } | Event::NotAcknowledged { .. }
            )
        };
        self.told[0].drain(..).filter(is_result).collect()
    }
}

/// A message of this many octets without repeated parts.
pub(super) fn large(length: usize) -> Bytes {
    let octets = (0..length as u64).map(|index| (index.wrapping_mul(0x9E37_79B9) >> 13) as u8);
    [0x01, 0x4B]
        .into_iter()
        .chain(octets)
        .take(length)
        .collect()
}

/// A message to [`PEER`] that requests an acknowledgement.
pub(super) fn reliable(payload: Bytes) -> Outgoing {
    Outgoing {
        acknowledge: true,
        payload,
        ..to_peer()
    }
}
