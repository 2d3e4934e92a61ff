//! Tests of the client side against a scripted peer, in virtual time.

mod control;
mod dispatch;
mod session;
mod streams;
mod subscriptions;

use std::time::{Duration, Instant};

use bytes::Bytes;

use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::service::{Discovery, Event, Kind, Profile, Scope, Stack, Timing};
use crate::wire::{Broadcast, Priority};

const CLIENT: JausId = JausId::new(42, 1, 1);
const PEER: JausId = JausId::new(101, 1, 33);
const OTHER: JausId = JausId::new(102, 1, 33);

/// A client's stack and its clock.
struct Bench {
    now: Instant,
    stack: Stack,
    sent: Vec<(JausId, Bytes)>,
    events: Vec<Event>,
    /// The next sequence number of the peers' messages; none if they are of the same node.
    number: Option<u16>,
}

impl Bench {
    fn new() -> Self {
        Self::looking_for(Scope::Nobody)
    }

    /// A client whose discovery searches for other components.
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn looking_for(scope: Scope) -> Self {
        let profile = Profile::new(Kind::OperatorControlUnit, "Operator");
        let discovery = Discovery::new(CLIENT, profile, scope, Timing::default(), 1);
        let mut bench = Self {
            now: Instant::now(),
            stack: Stack::new(discovery, Vec::new()),
            sent: Vec::new(),
            events: Vec::new(),
            number: None,
        };
        bench.stack.start(bench.now);
        bench.collect();
        bench
    }

    /// Advances the time, and handles every timeout when it is due.
    fn run(&mut self, duration: Duration) {
        let end = self.now + duration;
        while let Some(wake) = self.stack.poll_timeout().filter(|wake| *wake <= end) {
            assert!(wake > self.now || self.sent.len() < 100_000, "it spins");
            self.now = wake.max(self.now);
            self.stack.handle_timeout(self.now);
            self.collect();
        }
        self.now = end;
    }

    fn run_ms(&mut self, milliseconds: u64) {
        self.run(Duration::from_millis(milliseconds));
    }

    /// Handles a message from a peer.
    fn hear<M: Message>(&mut self, source: JausId, message: &M) {
        self.hear_octets(source, message.encode().expect("a message"));
    }

    fn hear_octets(&mut self, source: JausId, payload: Bytes) {
        let message = Received {
            source,
            destination: CLIENT,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            payload,
            sequence: self.number,
            path: None,
            to: CLIENT,
            acknowledged: false,
        };
        self.number = self.number.map(|number| number.wrapping_add(1));
        self.stack.handle_message(self.now, &message);
        self.collect();
    }

    fn collect(&mut self) {
        while let Some(message) = self.stack.poll_transmit() {
            self.sent.push((message.destination, message.payload));
        }
        while let Some(event) = self.stack.poll_event() {
            self.events.push(event);
        }
    }

    /// The messages of one type sent to the peer since the last call; all others are dropped.
    fn sent<M: Message>(&mut self) -> Vec<M> {
        let sent = std::mem::take(&mut self.sent);
        let to_peer = sent.into_iter().filter(|(to, _)| *to == PEER);
        to_peer
            .filter_map(|(_, payload)| M::decode(&payload).ok())
            .collect()
    }

    fn events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
}
