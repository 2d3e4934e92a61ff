//! Behaviour tests of the endpoint, one rule per test. Time is virtual; peers are hand-written
//! frames.

mod acknowledgements;
mod anything;
mod bounds;
mod bridged;
mod budget;
mod cancelling;
mod delivery;
mod duplicates;
mod flood;
mod fragments;
mod hosts;
mod identity;
mod junior;
mod output;
mod profiles;
mod receiving;
mod reserved;
mod restricted;
mod routes;
mod routing;
mod sending;
mod wire;

use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;

use super::*;
use crate::wire::{Acknowledgement, Broadcast, Flags, Frame, Priority, Version, judp};

/// Query Identification about a subsystem.
const QUERY_IDENTIFICATION: &[u8] = b"\x00\x2B\x02";
/// Query Heartbeat Pulse.
const QUERY_HEARTBEAT: &[u8] = b"\x02\x22";

const WIRE: LinkId = LinkId(0);
const US: JausId = JausId::new(101, 1, 1);
const SIBLING: JausId = JausId::new(101, 1, 2);
const PEER: JausId = JausId::new(42, 1, 1);

fn id(text: &str) -> JausId {
    text.parse().unwrap()
}

/// The path of host `host` on the wire, with the default port.
fn path(host: u8) -> Path {
    Path {
        link: WIRE,
        peer: SocketAddr::from(([10, 0, 0, host], judp::PORT)).into(),
    }
}

const OUR_HOST: u8 = 1;
const PEER_HOST: u8 = 2;

/// Messages delivered to components, and the components without room.
#[derive(Default)]
struct Inbox {
    messages: Vec<Received>,
    full: Vec<JausId>,
    /// The parts of unfinished messages: when each arrived, its source and its destination.
    parts: Vec<(Instant, JausId, JausId)>,
}

impl Sink for Inbox {
    fn has_room(&self, to: JausId, _: Priority) -> bool {
        !self.full.contains(&to)
    }

    fn deliver(&mut self, message: Received) {
        self.messages.push(message);
    }

    fn progress(&mut self, now: Instant, source: JausId, to: JausId) {
        self.parts.push((now, source, to));
    }
}

/// An endpoint with a link, an attached [`US`] and a clock.
struct Rig {
    endpoint: Endpoint,
    inbox: Inbox,
    now: Instant,
}

impl Rig {
    fn new() -> Self {
        Self::with(Config::default())
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn with(config: Config) -> Self {
        let mut endpoint = Endpoint::new(config);
        endpoint.add_link(WIRE, LinkProfile::judp(path(OUR_HOST).peer.socket()));
        endpoint.attach(US).unwrap();
        Self {
            endpoint,
            inbox: Inbox::default(),
            now: Instant::now(),
        }
    }

    fn pass(&mut self, time: Duration) {
        self.now += time;
        self.endpoint.handle_timeout(self.now);
    }

    fn hear_from(&mut self, host: u8, frame: &Frame) {
        self.hear_octets(host, judp::encode(frame).unwrap());
    }

    fn hear(&mut self, frame: &Frame) {
        self.hear_from(PEER_HOST, frame);
    }

    fn hear_octets(&mut self, host: u8, datagram: Bytes) {
        self.hear_datagram(path(host), datagram);
    }

    fn hear_datagram(&mut self, from: impl Into<Ingress>, datagram: Bytes) {
        self.endpoint
            .handle_datagram(self.now, from, datagram, &mut self.inbox);
    }

    /// Has a peer acknowledge a message on its route.
    fn vouch_for(&mut self, id: JausId) {
        let (path, _) = self.endpoint.route(id).unwrap();
        self.endpoint.peers.verify(id, path);
    }

    /// Makes [`PEER`] known and verified.
    fn meet_peer(&mut self) {
        self.hear(&Frame {
            sequence: 900,
            ..from_peer(QUERY_HEARTBEAT)
        });
        self.vouch_for(PEER);
        self.events();
        self.received();
    }

    fn send(&mut self, message: Outgoing) -> Result<MessageHandle, SendError> {
        self.endpoint.send(self.now, message, &mut self.inbox)
    }

    fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.endpoint.poll_event()).collect()
    }

    /// The messages delivered to components.
    fn received(&mut self) -> Vec<Received> {
        std::mem::take(&mut self.inbox.messages)
    }

    fn transmits(&mut self) -> Vec<Transmit> {
        std::iter::from_fn(|| self.endpoint.poll_transmit(self.now)).collect()
    }

    /// Whether there are no new deliveries, events or transmits.
    fn is_silent(&mut self) -> bool {
        let (messages, events) = (self.received(), self.events());
        messages.is_empty() && events.is_empty() && self.transmits().is_empty()
    }

    /// The datagrams sent, decoded.
    fn sent(&mut self) -> Vec<(To, Frame)> {
        let read = |transmit: Transmit| {
            (
                transmit.to,
                judp::frames(transmit.payload)
                    .unwrap()
                    .next()
                    .unwrap()
                    .unwrap(),
            )
        };
        self.transmits().into_iter().map(read).collect()
    }

    fn count(&self, counter: Counter) -> u64 {
        self.endpoint.counters().get(counter)
    }
}

/// A message from [`PEER`] to [`US`].
fn from_peer(payload: &'static [u8]) -> Frame {
    Frame {
        sequence: 1,
        ..Frame::new(PEER, US, Bytes::from_static(payload))
    }
}

/// A message from [`US`] to [`PEER`].
fn to_peer() -> Outgoing {
    Outgoing::new(US, PEER, Bytes::from_static(QUERY_IDENTIFICATION))
}
