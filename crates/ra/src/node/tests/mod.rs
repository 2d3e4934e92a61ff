//! Nodes on a simulated network, with virtual time.

mod anything;
mod hostile;
mod meeting;
mod openjaus;
mod unicast;

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::*;
use crate::carrier::{Dialect, To};
use crate::{Counter, RaId};

#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
fn start() -> Instant {
    Instant::now()
}

fn address(host: u8) -> SocketAddr {
    SocketAddr::from(([10, 77, 0, host], 3794))
}

fn component(component: u8, name: &str) -> RaComponentEntry {
    let command = |code, presence| Command { code, presence };
    RaComponentEntry {
        component,
        instance: 1,
        name: name.into(),
        services: vec![RaServiceEntry {
            kind: component.into(),
            inputs: vec![command(0x2402, 0)],
            outputs: vec![command(0x4402, 0x7F), command(0x4404, 0)],
        }],
    }
}

fn vehicle(id: u8) -> RaSubsystemEntry {
    RaSubsystemEntry {
        id,
        name: format!("Vehicle {id}"),
        nodes: vec![RaNodeEntry {
            id: 1,
            name: "Main".into(),
            components: vec![component(33, "Driver"), component(38, "Pose")],
        }],
    }
}

/// A node with its address and events.
struct Host {
    node: RaNode,
    address: SocketAddr,
    events: Vec<Event>,
}

/// Hosts on a network.
struct World {
    now: Instant,
    hosts: Vec<Host>,
    /// Whether multicasts are delivered.
    multicast: bool,
    /// Loses every n-th datagram; 0 loses none.
    loses: u32,
    sent: u32,
}

impl World {
    fn new(hosts: u8) -> Self {
        Self::with(hosts, &Settings::default())
    }

    fn with(hosts: u8, settings: &Settings) -> Self {
        let host = |number| Host {
            node: RaNode::new(settings.clone()),
            address: address(number),
            events: Vec::new(),
        };
        Self {
            now: start(),
            hosts: (1..=hosts).map(host).collect(),
            multicast: true,
            loses: 0,
            sent: 0,
        }
    }

    /// Hosts with one vehicle each: subsystems 10, 20, …
    fn of_vehicles(hosts: u8) -> Self {
        let mut world = Self::new(hosts);
        for number in 0..hosts {
            let node = &mut world.hosts[usize::from(number)].node;
            node.announce(world.now, vehicle(10 * (number + 1)))
                .unwrap();
        }
        world
    }

    /// Delivers datagrams until none is left.
    fn exchange(&mut self) {
        let mut waiting = VecDeque::new();
        loop {
            for (from, host) in self.hosts.iter_mut().enumerate() {
                while let Some(transmit) = host.node.poll_transmit() {
                    waiting.push_back((from, transmit));
                }
            }
            let Some((from, transmit)) = waiting.pop_front() else {
                break;
            };
            self.sent += 1;
            if self.loses > 0 && self.sent.is_multiple_of(self.loses) {
                continue;
            }
            let source = self.hosts[from].address;
            for (to, host) in self.hosts.iter_mut().enumerate() {
                let meant = match transmit.to {
                    To::Group => self.multicast,
                    To::Address(address) => address == host.address,
                };
                if to != from && meant {
                    let datagram = transmit.datagram.clone();
                    host.node.handle_datagram(self.now, source, datagram);
                }
            }
        }
        for host in &mut self.hosts {
            host.events
                .extend(std::iter::from_fn(|| host.node.poll_event()));
        }
    }

    fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        self.exchange();
        loop {
            let next = self
                .hosts
                .iter()
                .filter_map(|host| host.node.poll_timeout());
            let Some(next) = next.min().filter(|&next| next <= end) else {
                break;
            };
            assert!(
                next > self.now || self.sent < 1_000_000,
                "time stands still"
            );
            self.now = self.now.max(next);
            for host in &mut self.hosts {
                host.node.handle_timeout(self.now);
            }
            self.exchange();
        }
        self.now = end;
    }

    fn seconds(&mut self, seconds: u64) {
        self.pass(Duration::from_secs(seconds));
    }

    fn events(&mut self, host: usize) -> Vec<Event> {
        std::mem::take(&mut self.hosts[host].events)
    }
}

/// One node, and its messages to a scripted peer.
struct Rig {
    now: Instant,
    node: RaNode,
}

impl Rig {
    fn new(settings: Settings) -> Self {
        let now = start();
        let mut node = RaNode::new(settings);
        node.announce(now, vehicle(30)).unwrap();
        let mut rig = Self { now, node };
        assert_eq!(rig.sent().len(), 1, "a heartbeat");
        rig
    }

    /// Delivers a message of the peer.
    fn hear(&mut self, host: u8, source: RaId, destination: RaId, code: u16, data: &[u8]) {
        let datagram = datagram(&Message::new(
            source,
            destination,
            code,
            Bytes::copy_from_slice(data),
        ));
        self.node.handle_datagram(self.now, address(host), datagram);
    }

    fn sent(&mut self) -> Vec<Message> {
        let sent = std::iter::from_fn(|| self.node.poll_transmit());
        sent.map(|transmit| message(&transmit.datagram)).collect()
    }

    fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.node.poll_event()).collect()
    }

    fn count(&self, counter: Counter) -> u64 {
        self.node.counters().get(counter)
    }
}

/// A small message as a "JAUS01.0" datagram.
fn datagram(message: &Message) -> Bytes {
    let mut octets = b"JAUS01.0\x06\x02".to_vec();
    octets.extend_from_slice(&message.code.to_le_bytes());
    for id in [message.destination, message.source] {
        octets.extend_from_slice(&[id.instance, id.component, id.node, id.subsystem]);
    }
    octets.extend_from_slice(&(message.data.len() as u16).to_le_bytes());
    octets.extend_from_slice(&[0, 0]);
    octets.extend_from_slice(&message.data);
    octets.into()
}

fn message(datagram: &Bytes) -> Message {
    let id = |at: usize| {
        let field = |offset| datagram[at + offset];
        RaId::new(field(3), field(2), field(1), field(0))
    };
    let code = u16::from_le_bytes([datagram[10], datagram[11]]);
    Message::new(id(16), id(12), code, datagram.slice(24..))
}
