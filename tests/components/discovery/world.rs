//! A network in virtual time: endpoints with components, datagrams with a delay, and no sockets.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Config, Endpoint, LinkId, LinkProfile, Outgoing, Path, Received, To};
use jaus::service::{
    Change, Discovery, Kind, Liveness, Profile, Scope, Service, Stack, Timing, Transport,
};

const LINK: LinkId = LinkId(0);
const DELAY: Duration = Duration::from_millis(1);

/// The whole network, with its virtual time.
pub(crate) struct World {
    pub(crate) now: Instant,
    nodes: Vec<Node>,
    /// Datagrams in flight, by arrival time and number.
    flights: BTreeMap<(Instant, u64), Flight>,
    flown: u64,
    /// The network loses one of this number of datagrams; 0 for none.
    lost_of: u64,
}

/// A host with one component: a stack, or a puppet that the test controls.
struct Node {
    address: SocketAddr,
    id: JausId,
    endpoint: Endpoint,
    inbox: Vec<Received>,
    stack: Option<Stack>,
    up: bool,
    datagrams: u64,
    received: Vec<Received>,
    changes: Vec<(Instant, Change)>,
}

struct Flight {
    from: Path,
    to: SocketAddr,
    payload: Bytes,
}

/// A node of a [`World`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place(usize);

/// A component with the default timing.
pub(crate) fn stack(id: JausId, name: &str, services: Vec<Box<dyn Service>>) -> Stack {
    let profile = Profile::new(Kind::Vehicle, name);
    let timing = Timing::default();
    let discovery = Discovery::new(id, profile, Scope::System, timing, id.to_u32().into());
    let mut all: Vec<Box<dyn Service>> = vec![Box::new(Transport), Box::new(Liveness::new())];
    all.extend(services);
    Stack::new(discovery, all)
}

impl World {
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    pub(crate) fn new() -> Self {
        Self {
            now: Instant::now(),
            nodes: Vec::new(),
            flights: BTreeMap::new(),
            flown: 0,
            lost_of: 0,
        }
    }

    /// Starts a component on its own node.
    pub(crate) fn start(&mut self, mut stack: Stack) -> Place {
        stack.start(self.now);
        self.add(stack.id(), Some(stack))
    }

    /// Adds a component that sends only on the test's request.
    pub(crate) fn puppet(&mut self, id: JausId) -> Place {
        self.add(id, None)
    }

    fn add(&mut self, id: JausId, stack: Option<Stack>) -> Place {
        let place = self.nodes.len();
        let port = 10_000 + u16::try_from(place).unwrap();
        let address = SocketAddr::from(([10, 0, 0, 1], port));
        let mut endpoint = Endpoint::new(Config::default());
        endpoint.add_link(LINK, LinkProfile::judp([address]));
        endpoint.attach(id).unwrap();
        self.nodes.push(Node {
            address,
            id,
            endpoint,
            inbox: Vec::new(),
            stack,
            up: true,
            datagrams: 0,
            received: Vec::new(),
            changes: Vec::new(),
        });
        Place(place)
    }

    /// Takes a node off the network, without a shutdown notice.
    pub(crate) fn kill(&mut self, place: Place) {
        self.nodes[place.0].up = false;
    }

    /// Reconnects a node to the network, with its state unchanged.
    pub(crate) fn revive(&mut self, place: Place) {
        self.nodes[place.0].up = true;
    }

    pub(crate) fn stack(&mut self, place: Place) -> &mut Stack {
        self.nodes[place.0].stack.as_mut().unwrap()
    }

    /// Changes noticed by a component since the last call, with their times.
    pub(crate) fn changes(&mut self, place: Place) -> Vec<(Instant, Change)> {
        std::mem::take(&mut self.nodes[place.0].changes)
    }

    /// Messages received by a puppet since the last call.
    pub(crate) fn received(&mut self, place: Place) -> Vec<Received> {
        std::mem::take(&mut self.nodes[place.0].received)
    }

    /// The messages of one type received by a puppet since the last call; all others are discarded.
    pub(crate) fn received_as<M: Message>(&mut self, place: Place) -> Vec<M> {
        let received = self.received(place);
        received
            .iter()
            .filter_map(|message| M::decode(&message.payload).ok())
            .collect()
    }

    /// Number of datagrams sent by a node; a multicast counts once.
    pub(crate) fn datagrams(&self, place: Place) -> u64 {
        self.nodes[place.0].datagrams
    }

    /// Sends a message from a puppet.
    pub(crate) fn say<M: Message>(&mut self, place: Place, to: JausId, message: &M) {
        self.say_octets(place, to, message.encode().unwrap());
    }

    /// Sends octets from a puppet.
    pub(crate) fn say_octets(&mut self, place: Place, to: JausId, payload: Bytes) {
        let node = &mut self.nodes[place.0];
        node.endpoint
            .send(
                self.now,
                Outgoing::new(node.id, to, payload),
                &mut node.inbox,
            )
            .unwrap();
    }

    /// Makes the network lose one of `many` datagrams on average, always the same ones.
    pub(crate) fn lose_every(&mut self, many: u64) {
        self.lost_of = many;
    }

    fn is_lost(&self) -> bool {
        let mixed = self.flown.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
        self.lost_of > 0 && mixed.is_multiple_of(self.lost_of)
    }

    /// Advances time.
    pub(crate) fn run(&mut self, duration: Duration) {
        let end = self.now + duration;
        loop {
            for place in 0..self.nodes.len() {
                self.pump(place);
            }
            let Some(next) = self.next_wakeup().filter(|next| *next <= end) else {
                break;
            };
            assert!(next >= self.now, "time does not run backwards");
            self.now = next;
            self.land();
            self.wake();
        }
        self.now = end;
    }

    fn next_wakeup(&self) -> Option<Instant> {
        let flights = self.flights.keys().next().map(|(arrival, _)| *arrival);
        let nodes = self.nodes.iter().filter(|node| node.up).flat_map(|node| {
            let stack = node.stack.as_ref().and_then(Stack::poll_timeout);
            [node.endpoint.poll_timeout(), stack].into_iter().flatten()
        });
        flights
            .into_iter()
            .chain(nodes)
            .min()
            .map(|next| next.max(self.now))
    }

    fn land(&mut self) {
        while let Some(entry) = self.flights.first_entry() {
            if entry.key().0 > self.now {
                return;
            }
            let flight = entry.remove();
            let receiver = self.nodes.iter_mut().find(|node| node.address == flight.to);
            if let Some(node) = receiver.filter(|node| node.up) {
                node.endpoint.handle_datagram(
                    self.now,
                    flight.from,
                    flight.payload,
                    &mut node.inbox,
                );
            }
        }
    }

    fn wake(&mut self) {
        let due = |wake: Option<Instant>| wake.is_some_and(|wake| wake <= self.now);
        for node in self.nodes.iter_mut().filter(|node| node.up) {
            if due(node.endpoint.poll_timeout()) {
                node.endpoint.handle_timeout(self.now);
            }
            if let Some(stack) = node
                .stack
                .as_mut()
                .filter(|stack| due(stack.poll_timeout()))
            {
                stack.handle_timeout(self.now);
            }
        }
    }

    /// Carries messages between a node's component, its endpoint and the network.
    fn pump(&mut self, place: usize) {
        let now = self.now;
        let node = &mut self.nodes[place];
        if !node.up {
            return;
        }
        loop {
            while node.endpoint.poll_event().is_some() {}
            for message in std::mem::take(&mut node.inbox) {
                match &mut node.stack {
                    Some(stack) => stack.handle_message(now, &message),
                    None => node.received.push(message),
                }
            }
            let Some(stack) = &mut node.stack else { break };
            while let Some(event) = stack.poll_event() {
                if let jaus::service::Event::Change(change) = event {
                    node.changes.push((now, change));
                }
            }
            let Some(message) = stack.poll_transmit() else {
                break;
            };
            node.endpoint.send(now, message, &mut node.inbox).unwrap();
        }
        let mut departures = Vec::new();
        while let Some(transmit) = node.endpoint.poll_transmit(now) {
            node.datagrams += 1;
            departures.push((node.address, transmit));
        }
        for (from, transmit) in departures {
            let everybody = self.nodes.iter().map(|node| node.address);
            let receivers: Vec<_> = match transmit.to {
                To::Peer(peer) => peer.socket().into_iter().collect(),
                To::Group => everybody.filter(|address| *address != from).collect(),
            };
            for to in receivers {
                self.flown += 1;
                let from = Path {
                    link: LINK,
                    peer: from.into(),
                };
                let flight = Flight {
                    from,
                    to,
                    payload: transmit.payload.clone(),
                };
                if !self.is_lost() {
                    self.flights.insert((now + DELAY, self.flown), flight);
                }
            }
        }
    }
}
