//! Forwarding between links: chains, parallel routers and rings. Each world is a few networks in
//! memory that deliver after 100 µs.

mod forwarded;

use std::collections::VecDeque;

use super::*;
use crate::wire::Framing;

const A: JausId = JausId::new(1, 1, 1);
const B: JausId = JausId::new(2, 1, 1);
const C: JausId = JausId::new(3, 1, 1);

/// The connection of a node to a network.
struct Plug {
    node: usize,
    link: LinkId,
    network: usize,
    framing: Framing,
    address: SocketAddr,
}

/// Nodes, and the networks between them.
struct World {
    now: Instant,
    nodes: Vec<Endpoint>,
    inboxes: Vec<Inbox>,
    plugs: Vec<Plug>,
    flying: VecDeque<(usize, usize, Bytes)>,
    carried: usize,
}

impl World {
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn new() -> Self {
        Self {
            now: Instant::now(),
            nodes: Vec::new(),
            inboxes: Vec::new(),
            plugs: Vec::new(),
            flying: VecDeque::new(),
            carried: 0,
        }
    }

    /// A node with a component, on a network.
    fn host(&mut self, id: JausId, network: usize) -> usize {
        let node = self.add(Config::default(), &[network]);
        self.nodes[node].attach(id).unwrap();
        node
    }

    /// A node that forwards between networks.
    fn router(&mut self, networks: &[usize]) -> usize {
        self.add(router_config(), networks)
    }

    fn add(&mut self, config: Config, networks: &[usize]) -> usize {
        self.nodes.push(Endpoint::new(config));
        self.inboxes.push(Inbox::default());
        let node = self.nodes.len() - 1;
        for &network in networks {
            self.plug(node, network, Framing::Judp);
        }
        node
    }

    /// Connects a node; its links have the numbers of the networks.
    fn plug(&mut self, node: usize, network: usize, framing: Framing) {
        let link = LinkId(network as u16);
        let address = SocketAddr::from(([10, 0, network as u8, node as u8 + 1], judp::PORT));
        self.plugs.push(Plug {
            node,
            link,
            network,
            framing,
            address,
        });
        self.announce(node);
    }

    /// Announces its links to a node, as the owner of an endpoint does.
    fn announce(&mut self, node: usize) {
        let own = |plug: &&Plug| plug.node == node && plug.framing == Framing::Judp;
        let addresses: Vec<_> = self.plugs.iter().filter(own).map(|p| p.address).collect();
        for plug in self.plugs.iter().filter(|plug| plug.node == node) {
            let profile = LinkProfile {
                framing: plug.framing,
                ..LinkProfile::judp(addresses.clone())
            };
            self.nodes[node].add_link(plug.link, profile);
        }
    }

    fn restart(&mut self, node: usize, config: Config) {
        self.nodes[node] = Endpoint::new(config);
        self.announce(node);
    }

    /// Puts a node's output on the networks. Multicast also comes back to its sender.
    fn collect(&mut self, node: usize) {
        while let Some(transmit) = self.nodes[node].poll_transmit(self.now) {
            let from = self
                .plugs
                .iter()
                .position(|plug| plug.node == node && plug.link == transmit.link)
                .unwrap();
            self.carried += 1;
            let network = self.plugs[from].network;
            for (to, plug) in self.plugs.iter().enumerate() {
                let reached = match transmit.to {
                    To::Group => plug.framing == Framing::Judp || to != from,
                    To::Peer(peer) => peer == plug.address.into(),
                };
                if plug.network == network && reached {
                    self.flying.push_back((from, to, transmit.payload.clone()));
                }
            }
        }
    }

    fn send(&mut self, node: usize, message: Outgoing) -> MessageHandle {
        let inbox = &mut self.inboxes[node];
        let handle = self.nodes[node].send(self.now, message, inbox).unwrap();
        self.collect(node);
        handle
    }

    /// Delivers everything in transit, and all that follows from it.
    fn settle(&mut self) {
        for _round in 0..1_000_000 {
            let Some((from, to, octets)) = self.flying.pop_front() else {
                return;
            };
            self.now += Duration::from_micros(1);
            let (node, path) = (self.plugs[to].node, self.path(from, to));
            // The same octets, except that a connection delivers frames.
            let (now, inbox) = (self.now, &mut self.inboxes[node]);
            match self.plugs[to].framing {
                Framing::Judp => self.nodes[node].handle_datagram(now, path, octets, inbox),
                _ => {
                    for frame in judp::frames(octets).unwrap() {
                        self.nodes[node].handle_frame(now, path, &frame.unwrap(), inbox);
                    }
                }
            }
            self.collect(node);
        }
        panic!("a storm");
    }

    fn path(&self, from: usize, to: usize) -> Path {
        Path {
            link: self.plugs[to].link,
            peer: self.plugs[from].address.into(),
        }
    }

    /// Advances time and handles all events in between.
    fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        while self.now < end {
            self.settle();
            self.now += Duration::from_millis(1);
            for node in 0..self.nodes.len() {
                self.nodes[node].handle_timeout(self.now);
                self.collect(node);
            }
        }
        self.settle();
    }

    fn events(&mut self, node: usize) -> Vec<Event> {
        std::iter::from_fn(|| self.nodes[node].poll_event()).collect()
    }

    /// The messages that a node has received.
    fn received(&mut self, node: usize) -> Vec<Received> {
        std::mem::take(&mut self.inboxes[node].messages)
    }

    fn count(&self, node: usize, counter: Counter) -> u64 {
        self.nodes[node].counters().get(counter)
    }

    /// The path that a node has learned for an id.
    fn whereabouts(&self, node: usize, id: JausId) -> Option<Path> {
        self.nodes[node]
            .peers()
            .find(|peer| peer.id == id)
            .map(|peer| peer.path)
    }

    /// The address of a node on a network.
    fn address(&self, node: usize, network: usize) -> Remote {
        let on = |plug: &&Plug| plug.node == node && plug.network == network;
        self.plugs.iter().find(on).unwrap().address.into()
    }
}

fn router_config() -> Config {
    Config {
        routing: Routing {
            forward: true,
            ..Routing::default()
        },
        ..Config::default()
    }
}

fn query(source: JausId, destination: JausId) -> Outgoing {
    Outgoing::new(
        source,
        destination,
        Bytes::from_static(QUERY_IDENTIFICATION),
    )
}

/// Networks 0 and 1 with a host each, and a router between them.
fn chain() -> (World, usize, usize, usize) {
    let mut world = World::new();
    let (a, c) = (world.host(A, 0), world.host(C, 1));
    let router = world.router(&[0, 1]);
    (world, a, router, c)
}

#[test]
fn ends_find_each_other_through_a_router_and_go_on_by_unicast() {
    let (mut world, a, router, c) = chain();
    world.send(a, query(A, C));
    world.settle();
    assert_eq!(world.received(c).len(), 1);
    assert_eq!(
        [
            world.whereabouts(a, C).unwrap().peer,
            world.whereabouts(c, A).unwrap().peer
        ],
        [world.address(router, 0), world.address(router, 1)],
        "each sees the router's address as the other's"
    );
    world.carried = 0;
    world.send(c, query(C, A));
    world.settle();
    assert_eq!((world.received(a).len(), world.carried), (1, 2));
    for node in [a, c] {
        assert_eq!(world.count(node, Counter::IdConflict), 0);
    }
}

#[test]
fn a_large_acknowledged_message_passes_in_fragments_and_is_acknowledged_by_its_receiver() {
    for second in [Framing::Judp, Framing::Jtcp] {
        let mut world = World::new();
        let (a, c) = (world.host(A, 0), world.add(Config::default(), &[]));
        let router = world.router(&[0]);
        world.plug(c, 1, second);
        world.plug(router, 1, second);
        world.nodes[c].attach(C).unwrap();
        let payload: Bytes = (0..1 << 20).map(|at| (at % 251) as u8).collect();
        let message = Outgoing {
            acknowledge: true,
            payload: payload.clone(),
            ..query(A, C)
        };
        let handle = world.send(a, message);
        world.pass(Duration::from_secs(2));
        let received = world.received(c);
        assert_eq!(received.len(), 1, "{second:?}");
        assert!(received[0].payload == payload);
        let acknowledged = Event::Acknowledged {
            message: handle,
            by: C,
        };
        assert!(world.events(a).contains(&acknowledged));
        assert_eq!(world.nodes[router].reassembly.cost(), 0);
        assert_eq!(world.count(router, Counter::AcknowledgementsSent), 0);
    }
}

#[test]
fn whoever_does_not_forward_by_wish_does_not() {
    let mut world = World::new();
    let (a, c) = (world.host(A, 0), world.host(C, 1));
    let between = world.add(Config::default(), &[0, 1]);
    world.send(a, query(A, C));
    world.pass(Duration::from_secs(1));
    assert_eq!(world.received(c), []);
    assert_eq!(world.whereabouts(between, A), None);
    assert!(world.count(between, Counter::NotForUs) > 0);
}

#[test]
fn a_broadcast_reaches_the_routers_components_and_goes_on() {
    let (mut world, a, router, c) = chain();
    world.nodes[router].attach(B).unwrap();
    for scope in [Broadcast::Global, Broadcast::Local] {
        let message = Outgoing {
            broadcast: scope,
            ..query(A, JausId::EVERYONE)
        };
        world.send(a, message);
        world.settle();
        let mine = usize::from(scope == Broadcast::Global);
        assert_eq!(world.received(router).len(), mine, "{scope:?}");
        assert_eq!(world.received(c).len(), mine, "{scope:?}");
    }
    let sibling = JausId::new(A.subsystem(), 2, 1);
    world.nodes[c].attach(sibling).unwrap();
    let local = Outgoing {
        broadcast: Broadcast::Local,
        ..query(A, JausId::EVERYONE)
    };
    world.send(a, local);
    world.settle();
    let to: Vec<_> = world.received(c).iter().map(|message| message.to).collect();
    assert_eq!(to, [sibling], "a subsystem may span networks");
}

/// Two routers between the same two networks: one datagram from the sender, at most one from each
/// router.
#[test]
fn two_routers_in_parallel_deliver_once_and_make_no_storm() {
    let mut world = World::new();
    let (a, near, c) = (world.host(A, 0), world.host(B, 0), world.host(C, 1));
    let routers = [world.router(&[0, 1]), world.router(&[0, 1])];
    for _broadcast in 0..100 {
        world.carried = 0;
        world.send(a, query(A, JausId::EVERYONE));
        world.settle();
        assert_eq!(
            (world.received(near).len(), world.received(c).len()),
            (1, 1)
        );
        assert_eq!(world.carried, 1 + 2);
        world.pass(Duration::from_millis(10));
    }
    world.send(c, query(C, JausId::EVERYONE));
    world.settle();
    assert_eq!(world.received(a).len(), 1);
    // The route is through one of the two.
    world.carried = 0;
    world.send(c, query(C, A));
    world.settle();
    assert_eq!((world.received(a).len(), world.carried), (1, 2));
    for router in routers {
        assert_eq!(world.whereabouts(router, A).unwrap().link, LinkId(0));
        assert_eq!(world.whereabouts(router, C).unwrap().link, LinkId(1));
    }
    assert_eq!(world.count(a, Counter::IdConflict), 0);
}

/// A ring of three networks and three routers: one datagram from the sender, and each router
/// forwards it at most once.
#[test]
fn a_ring_of_three_routers_delivers_once_and_makes_no_storm() {
    let mut world = World::new();
    let (a, b, c) = (world.host(A, 0), world.host(B, 1), world.host(C, 2));
    for pair in [[0, 1], [1, 2], [2, 0]] {
        world.router(&pair);
    }
    for _broadcast in 0..100 {
        world.carried = 0;
        world.send(a, query(A, JausId::EVERYONE));
        world.settle();
        assert_eq!((world.received(b).len(), world.received(c).len()), (1, 1));
        assert!(world.carried <= 1 + 3, "{}", world.carried);
        world.pass(Duration::from_millis(10));
    }
    assert_eq!(world.received(a), []);
    // Messages for an id that does not exist do not circulate either.
    world.carried = 0;
    world.send(a, query(A, JausId::new(9, 9, 9)));
    world.settle();
    assert!(world.carried <= 1 + 3, "{}", world.carried);
    // A message for an existing id is acknowledged.
    let handle = world.send(
        b,
        Outgoing {
            acknowledge: true,
            ..query(B, C)
        },
    );
    world.pass(Duration::from_secs(1));
    let acknowledged = Event::Acknowledged {
        message: handle,
        by: C,
    };
    assert!(world.events(b).contains(&acknowledged));
    assert_eq!(world.received(c).len(), 1);
}

#[test]
fn a_restarted_router_goes_on() {
    let (mut world, a, router, c) = chain();
    world.send(a, query(A, C));
    world.settle();
    world.restart(router, router_config());
    for (node, from, to) in [(a, A, C), (c, C, A)] {
        let message = Outgoing {
            acknowledge: true,
            ..query(from, to)
        };
        let handle = world.send(node, message);
        world.pass(Duration::from_secs(1));
        let acknowledged = Event::Acknowledged {
            message: handle,
            by: to,
        };
        assert!(world.events(node).contains(&acknowledged), "{from}");
    }
}

#[test]
fn a_component_that_moves_to_another_network_is_found_there() {
    let mut world = World::new();
    let (a, before) = (world.host(A, 0), world.host(C, 1));
    let router = world.router(&[0, 1, 2]);
    world.send(before, query(C, JausId::EVERYONE));
    world.settle();
    assert_eq!(world.whereabouts(router, C).unwrap().link, LinkId(1));
    world.nodes[before].detach(C);
    let config = Config {
        first_sequence: 999,
        ..Config::default()
    };
    let after = world.add(config, &[2]);
    world.nodes[after].attach(C).unwrap();
    world.pass(Duration::from_secs(2));
    world.send(after, query(C, JausId::EVERYONE));
    world.settle();
    assert_eq!(world.whereabouts(router, C).unwrap().link, LinkId(2));
    world.send(a, query(A, C));
    world.settle();
    assert_eq!(world.received(after).len(), 1);
    assert_eq!(world.received(before), []);
}
