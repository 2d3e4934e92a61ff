//! Simulated network in memory: endpoints, virtual time, and a seeded wire that delays, loses,
//! duplicates and reorders datagrams.
//!
//! Used by several test binaries (`mod sim;`). Each node is an [`Endpoint`] with an [`Owner`] that
//! takes its events: [`Mailbox`] stores them for the test; a service or component on top of the
//! endpoint brings its own state machine. A node has a link on one or several networks, and may
//! forward between them. Nothing waits for real time, and the same seed gives the same run.

#![allow(
    clippy::expect_used,
    clippy::panic,
    dead_code,
    unreachable_pub,
    unused_imports,
    reason = "each test binary uses its own part"
)]

mod clock;
mod owned;
pub mod seeds;
mod trace;
mod wire;

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::endpoint::{
    self, Endpoint, LinkId, LinkProfile, MessageHandle, Outgoing, Path, Received, SendError, To,
    Transmit,
};
use jaus::wire::judp;

use clock::VirtualTime;
pub use clock::WallClock;
pub use jaus_test_kit::random::Random;
pub use owned::{Event, OwnedEndpoint};
pub use trace::Trace;
use wire::{Backlog, Flight, Wire};
pub use wire::{Conditions, Harm, Socket};

/// The first link of each node; most nodes have no other.
pub const WIRE: LinkId = LinkId(0);
/// Limit of steps at one instant; a higher number means an endless loop.
const MOST_STEPS: u32 = 100_000;

/// Takes the events of a simulated node; may also wake up and send by itself.
pub trait Owner {
    /// Takes an event; may send through the endpoint at once.
    fn handle_event(&mut self, now: Instant, endpoint: &mut OwnedEndpoint, event: Event);

    /// Called when the time of [`poll_timeout`](Self::poll_timeout) has come.
    fn handle_timeout(&mut self, _now: Instant, _endpoint: &mut OwnedEndpoint) {}

    /// The next wake-up time.
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

/// An owner that stores its events.
#[derive(Debug, Default)]
pub struct Mailbox {
    /// The events, with their times, oldest first.
    pub events: Vec<(Instant, Event)>,
}

impl Owner for Mailbox {
    fn handle_event(&mut self, now: Instant, _endpoint: &mut OwnedEndpoint, event: Event) {
        self.events.push((now, event));
    }
}

impl Mailbox {
    /// Removes and returns the messages; the other events remain.
    pub fn take_messages(&mut self) -> Vec<Received> {
        let messages = self
            .events
            .extract_if(.., |(_, event)| matches!(event, Event::Received(_)));
        let message = |(_, event)| match event {
            Event::Received(received) => Some(received),
            Event::News(_) => None,
        };
        messages.filter_map(message).collect()
    }

    /// Removes and returns the endpoint's other events; the messages remain.
    pub fn take_news(&mut self) -> Vec<endpoint::Event> {
        let news = self
            .events
            .extract_if(.., |(_, event)| matches!(event, Event::News(_)));
        let event = |(_, event)| match event {
            Event::Received(_) => None,
            Event::News(event) => Some(event),
        };
        news.filter_map(event).collect()
    }
}

/// Index of a node, in order of joining.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Host(pub usize);

struct Node<O> {
    endpoint: OwnedEndpoint,
    owner: O,
    attachments: Vec<Attachment>,
    /// Limit of datagrams per transmit of its links.
    max_segments: usize,
    /// Whether its owner takes the events.
    is_read: bool,
    process: Process,
}

/// A link of a node: its network, and the node's address there.
#[derive(Clone, Copy)]
struct Attachment {
    link: LinkId,
    network: u8,
    address: SocketAddr,
}

/// State of a node's process.
enum Process {
    Running,
    /// Stopped by a signal: it does nothing, and its socket fills up.
    Suspended(Backlog),
    Dead,
}

impl<O> Node<O> {
    const fn is_running(&self) -> bool {
        matches!(self.process, Process::Running)
    }

    /// Adds the node's links to the endpoint.
    fn add_links(&mut self) {
        for attachment in &self.attachments {
            let profile = LinkProfile {
                max_segments: self.max_segments,
                ..LinkProfile::judp([attachment.address])
            };
            self.endpoint.add_link(attachment.link, profile);
        }
    }
}

/// The network. See the [module](self).
pub struct Network<O = Mailbox> {
    start: Instant,
    now: Instant,
    /// Number of steps at the current instant.
    steps: u32,
    time: VirtualTime,
    wire: Wire,
    nodes: Vec<Node<O>>,
    /// The wall clock of each host; it survives a restart of the node.
    clocks: Vec<WallClock>,
    carried: u64,
    multicast: u64,
    segmented: u64,
    packed: u64,
    trace: Trace,
}

impl<O: Owner> Network<O> {
    /// A network without nodes. The seed determines every loss and delay.
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    pub fn new(seed: u64, conditions: Conditions) -> Self {
        let now = Instant::now();
        Self {
            start: now,
            now,
            steps: 0,
            time: VirtualTime::default(),
            wire: Wire::new(seed, conditions),
            nodes: Vec::new(),
            clocks: Vec::new(),
            carried: 0,
            multicast: 0,
            segmented: 0,
            packed: 0,
            trace: Trace::new(now),
        }
    }

    /// Puts a node on the wire, at 10.0.0.n:3794.
    pub fn join(&mut self, endpoint: Endpoint, owner: O) -> Host {
        self.join_with(endpoint, |_clock| owner)
    }

    /// Puts a node on the wire whose owner uses the wall clock of its host.
    pub fn join_with(&mut self, endpoint: Endpoint, owner: impl FnOnce(WallClock) -> O) -> Host {
        let clock = self.time.clock();
        let owner = owner(clock.clone());
        self.clocks.push(clock);
        self.join_networks(&[0], endpoint, owner)
    }

    /// Puts a node on several networks, with a link on each, at 10.network.0.n:3794.
    pub fn join_networks(&mut self, networks: &[u8], endpoint: Endpoint, owner: O) -> Host {
        let host = self.nodes.len();
        if self.clocks.len() == host {
            self.clocks.push(self.time.clock());
        }
        let attachment = |(link, &network): (usize, &u8)| Attachment {
            link: LinkId(link as u16),
            network,
            address: SocketAddr::from(([10, network, 0, host as u8 + 1], judp::PORT)),
        };
        self.nodes.push(Node {
            endpoint: OwnedEndpoint::new(endpoint),
            owner,
            attachments: networks.iter().enumerate().map(attachment).collect(),
            max_segments: 1,
            is_read: true,
            process: Process::Running,
        });
        self.nodes[host].add_links();
        Host(host)
    }

    /// Replaces a node with a new one at the same address, as after a crash and a restart.
    pub fn restart(&mut self, host: Host, endpoint: Endpoint, owner: O) {
        let node = &mut self.nodes[host.0];
        node.endpoint = OwnedEndpoint::new(endpoint);
        node.owner = owner;
        node.is_read = true;
        node.process = Process::Running;
        node.add_links();
    }

    /// Gives a node other addresses, as a DHCP server may.
    pub fn readdress(&mut self, host: Host) {
        let node = &mut self.nodes[host.0];
        for attachment in &mut node.attachments {
            let std::net::IpAddr::V4(ip) = attachment.address.ip() else {
                continue;
            };
            let [ten, network, generation, number] = ip.octets();
            let octets = [ten, network, generation.wrapping_add(1), number];
            attachment.address.set_ip(octets.into());
        }
        node.add_links();
    }

    /// Limits the number of datagrams per transmit of a node's links.
    pub fn set_max_segments(&mut self, host: Host, max_segments: usize) {
        let node = &mut self.nodes[host.0];
        node.max_segments = max_segments;
        node.add_links();
    }

    /// Sets whether the owner of a node takes its events. Waiting events are taken later.
    pub fn set_read(&mut self, host: Host, is_read: bool) {
        self.nodes[host.0].is_read = is_read;
        self.settle(host.0);
    }

    /// Sends a datagram from a host outside the simulation's nodes to a node's first link.
    pub fn inject(&mut self, from: SocketAddr, to: Host, datagram: &Bytes) {
        let what = format_args!("{from} sends {} octets to {to:?}", datagram.len());
        self.trace.note(self.now, what);
        self.wire
            .launch(self.now, (None, from), (to.0, WIRE), datagram);
    }

    /// Kills a node: it no longer receives or sends.
    pub fn kill(&mut self, host: Host) {
        self.nodes[host.0].process = Process::Dead;
    }

    /// Suspends a running node, as SIGSTOP does: it neither processes nor sends, and datagrams wait
    /// in its socket until the buffer is full.
    pub fn suspend(&mut self, host: Host) {
        let process = &mut self.nodes[host.0].process;
        if let Process::Running = process {
            *process = Process::Suspended(Backlog::default());
        }
    }

    /// Resumes a suspended node, as SIGCONT does: it reads everything in its socket before it
    /// checks its timers, which is the more dangerous order.
    pub fn resume(&mut self, host: Host) {
        let process = &mut self.nodes[host.0].process;
        let Process::Suspended(backlog) = process else {
            return;
        };
        let backlog = std::mem::take(backlog);
        *process = Process::Running;
        for flight in backlog.flights {
            self.arrive(flight);
        }
        self.wake(host.0);
    }

    /// The wall clock of a host.
    pub fn clock(&self, host: Host) -> WallClock {
        self.clocks[host.0].clone()
    }

    /// Steps the wall clock of a host by `nanoseconds`, backward if negative. Virtual time, which
    /// timers use, is unaffected.
    pub fn step_clock(&mut self, host: Host, nanoseconds: i64) {
        self.clocks[host.0].step(nanoseconds);
    }

    /// Cuts or restores the wire between two nodes, in both directions.
    pub fn set_cut(&mut self, one: Host, other: Host, cut: bool) {
        self.set_cut_one_way(one, other, cut);
        self.set_cut_one_way(other, one, cut);
    }

    /// Cuts or restores the wire in one direction.
    pub fn set_cut_one_way(&mut self, from: Host, to: Host, cut: bool) {
        self.wire.set_cut(from.0, to.0, cut);
    }

    /// Changes the conditions of the wire from now on.
    pub fn set_conditions(&mut self, conditions: Conditions) {
        self.wire.conditions = conditions;
    }

    /// The virtual time.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// A node's endpoint.
    pub fn endpoint(&mut self, host: Host) -> &mut OwnedEndpoint {
        &mut self.nodes[host.0].endpoint
    }

    /// A node's owner.
    pub fn owner(&mut self, host: Host) -> &mut O {
        &mut self.nodes[host.0].owner
    }

    /// The address of a node on its first network.
    pub fn address(&self, host: Host) -> SocketAddr {
        self.nodes[host.0].attachments[0].address
    }

    /// Number of datagrams put on the wire; a multicast counts once.
    pub fn carried(&self) -> u64 {
        self.carried
    }

    /// Number of datagrams sent to the group.
    pub fn multicast(&self) -> u64 {
        self.multicast
    }

    /// Number of transmits with several datagrams.
    pub fn segmented(&self) -> u64 {
        self.segmented
    }

    /// Number of datagrams with more than one message.
    pub fn packed(&self) -> u64 {
        self.packed
    }

    /// Number of datagrams lost because a receiver's socket was full.
    pub fn overflowed(&self) -> u64 {
        self.wire.harm.overflowed
    }

    /// The wire's effects on datagrams so far.
    pub fn harm(&self) -> Harm {
        self.wire.harm
    }

    /// The trace of all events.
    pub fn trace(&mut self) -> &mut Trace {
        &mut self.trace
    }

    /// Sends a message from a node, and puts it on the wire.
    pub fn send(&mut self, host: Host, message: Outgoing) -> Result<MessageHandle, SendError> {
        let handle = self.nodes[host.0].endpoint.send(self.now, message);
        self.settle(host.0);
        handle
    }

    /// Runs `act` on a node's owner and endpoint, and puts the resulting datagrams on the wire.
    pub fn act<T>(
        &mut self,
        host: Host,
        act: impl FnOnce(Instant, &mut O, &mut OwnedEndpoint) -> T,
    ) -> T {
        let node = &mut self.nodes[host.0];
        let result = act(self.now, &mut node.owner, &mut node.endpoint);
        self.settle(host.0);
        result
    }

    /// Advances virtual time by `time`.
    pub fn run_for(&mut self, time: Duration) {
        let end = self.now + time;
        while self.next_time().is_some_and(|next| next <= end) {
            self.step();
        }
        self.set_now(end);
    }

    /// Runs until no event is left.
    ///
    /// # Panics
    /// After 100 000 steps: the nodes then keep each other busy forever.
    pub fn run_until_idle(&mut self) {
        for _step in 0..100_000 {
            if !self.step() {
                return;
            }
        }
        panic!("the network does not come to rest");
    }

    /// Advances to the next event, and processes it. False if none is left.
    ///
    /// # Panics
    /// If time does not advance.
    pub fn step(&mut self) -> bool {
        let Some(next) = self.next_time() else {
            return false;
        };
        self.set_now(self.now.max(next));
        while let Some(flight) = self.wire.receive(self.now) {
            self.arrive(flight);
        }
        for host in 0..self.nodes.len() {
            self.wake(host);
        }
        true
    }

    fn set_now(&mut self, now: Instant) {
        self.steps = if now > self.now { 0 } else { self.steps + 1 };
        assert!(self.steps < MOST_STEPS, "somebody wakes again and again");
        self.now = now;
        self.time.set(now.saturating_duration_since(self.start));
    }

    /// The time of the next event.
    pub fn next_time(&self) -> Option<Instant> {
        let alarms = self.nodes.iter().filter(|node| node.is_running());
        let alarms =
            alarms.flat_map(|node| [node.endpoint.poll_timeout(), node.owner.poll_timeout()]);
        alarms.chain([self.wire.next_time()]).flatten().min()
    }

    fn arrive(&mut self, flight: Flight) {
        let node = &mut self.nodes[flight.to];
        match &mut node.process {
            Process::Dead => return,
            Process::Suspended(backlog) => return self.wire.keep_for_later(flight, backlog),
            Process::Running => {}
        }
        let (to, from, length) = (flight.to, flight.from, flight.datagram.len());
        let what = format_args!("{to} gets {length} octets from {from}");
        self.trace.note(self.now, what);
        let path = Path {
            link: flight.link,
            peer: flight.from.into(),
        };
        node.endpoint
            .handle_datagram(self.now, path, flight.datagram);
        self.settle(to);
    }

    fn wake(&mut self, host: usize) {
        let (now, node) = (self.now, &mut self.nodes[host]);
        let due = |timeout: Option<Instant>| timeout.is_some_and(|timeout| timeout <= now);
        if !node.is_running()
            || !(due(node.endpoint.poll_timeout()) || due(node.owner.poll_timeout()))
        {
            return;
        }
        node.endpoint.handle_timeout(now);
        if due(node.owner.poll_timeout()) {
            node.owner.handle_timeout(now, &mut node.endpoint);
        }
        self.settle(host);
    }

    /// Passes events to the owner and datagrams to the wire until the node has no more output.
    fn settle(&mut self, host: usize) {
        loop {
            let node = &mut self.nodes[host];
            if let Some(transmit) = node.endpoint.poll_transmit(self.now) {
                self.carry_all(host, &transmit);
            } else if let Some(event) = next_event(node) {
                note_event(&mut self.trace, self.now, host, &event);
                node.owner.handle_event(self.now, &mut node.endpoint, event);
            } else {
                return;
            }
        }
    }

    /// Puts the datagrams of a transmit on the wire.
    fn carry_all(&mut self, from: usize, transmit: &Transmit) {
        let whole = transmit.payload.len();
        let length = transmit.segment.unwrap_or(whole).max(1);
        self.segmented += u64::from(length < whole);
        for start in (0..whole).step_by(length) {
            let end = whole.min(start + length);
            let datagram = transmit.payload.slice(start..end);
            self.carry(from, transmit.link, transmit.to, &datagram);
        }
    }

    /// Puts a datagram on the network of a link. The group includes all its nodes, even the sender.
    fn carry(&mut self, from: usize, link: LinkId, to: To, datagram: &Bytes) {
        if !self.nodes[from].is_running() {
            return;
        }
        self.carried += 1;
        self.multicast += u64::from(to == To::Group);
        self.packed += u64::from(holds_several(datagram));
        let (length, head) = (datagram.len(), &datagram[..datagram.len().min(17)]);
        let what = format_args!("{from} sends {length} octets to {to:?}: {head:02x?}");
        self.trace.note(self.now, what);
        let sender = self.nodes[from].attachments.iter();
        let Some(&sender) = sender.clone().find(|it| it.link == link) else {
            return;
        };
        for (host, node) in self.nodes.iter().enumerate() {
            for receiver in &node.attachments {
                let is_meant = match to {
                    To::Group => true,
                    To::Peer(peer) => peer == receiver.address.into(),
                };
                if is_meant && receiver.network == sender.network {
                    let from = (Some(from), sender.address);
                    let to = (host, receiver.link);
                    self.wire.launch(self.now, from, to, datagram);
                }
            }
        }
    }
}

/// The next event of a node whose owner takes events.
fn next_event<O>(node: &mut Node<O>) -> Option<Event> {
    if node.is_read {
        node.endpoint.poll_event()
    } else {
        None
    }
}

/// Whether a datagram holds more than one message.
fn holds_several(datagram: &Bytes) -> bool {
    judp::frames(datagram.clone()).is_ok_and(|frames| frames.count() > 1)
}

fn note_event(trace: &mut Trace, now: Instant, host: usize, event: &Event) {
    match event {
        Event::Received(Received {
            source,
            to,
            payload,
            ..
        }) => {
            let (length, code) = (payload.len(), &payload[..2]);
            let what = format_args!("{host} delivers {code:02x?}, {length} octets, {source}→{to}");
            trace.note(now, what);
        }
        Event::News(news) => trace.note(now, format_args!("{host} is told {news:?}")),
    }
}
