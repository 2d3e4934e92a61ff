//! Roles of the node processes. They print the lines that the tests wait for.

use std::future::poll_fn;
use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::component::{Change, Component, Kind};
use jaus::endpoint::{LinkId, Outgoing, To, Transmit};
use jaus::link::udp::{self, Broadcasts, UdpLink};
use jaus::link::{Interface, Interfaces, Ip, Slab};
use jaus::node::{Config, Node};
use jaus::wire::Priority;

use jaus_test_kit::hosts::SETTINGS;

/// The default settings, with the changes given in the environment.
fn config(subsystem: u16) -> Config {
    let mut config = Config::new(subsystem, 1);
    let settings = std::env::var(SETTINGS).unwrap_or_default();
    for setting in settings.split_whitespace() {
        match setting.split_once('=').unwrap() {
            ("ip", "6") => config.ip = Ip::V6,
            ("ip", "both") => config.ip = Ip::Both,
            ("group", group) => config.group = group.parse().unwrap(),
            ("group6", group) => config.group6 = group.parse().unwrap(),
            ("broadcast", "on") => config.broadcast = Broadcasts::On,
            ("broadcast", "off") => config.broadcast = Broadcasts::Off,
            ("port", port) => config.port = port.parse().unwrap(),
            ("peer", peer) => config.peers.push(peer.parse().unwrap()),
            _ => panic!("no setting: {setting}"),
        }
    }
    config
}

/// Number of messages in the flood.
pub(crate) const FLOOD: usize = 2000;

/// Echoes every message until killed.
pub(crate) async fn echo() {
    let node = Node::start(config(101)).unwrap();
    let mut port = node.attach(33).unwrap();
    println!("\nlistening on {}", node.links()[0].local);
    while let Some(message) = port.recv().await {
        println!("heard {} at {}", message.source, message.path.unwrap().peer);
        port.send(Outgoing::new(port.id(), message.source, message.payload))
            .unwrap();
    }
}

/// Prints the addresses of its links at every change.
pub(crate) async fn follow() {
    let node = Node::start(config(101)).unwrap();
    let mut known = String::new();
    loop {
        let locals: Vec<_> = node
            .links()
            .iter()
            .map(|link| link.local.to_string())
            .collect();
        let now = locals.join(" ");
        if now != known {
            println!("\nlinks at {now}");
            known = now;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// Broadcasts a query until it is answered.
pub(crate) async fn call() {
    let node = Node::start(config(102)).unwrap();
    let mut port = node.attach(1).unwrap();
    let query_identification = Bytes::from_static(&[0x00, 0x2B, 0x02]);
    let answer = loop {
        let query = Outgoing::new(port.id(), JausId::EVERYONE, query_identification.clone());
        port.send(query).unwrap();
        if let Ok(answer) = tokio::time::timeout(Duration::from_millis(200), port.recv()).await {
            break answer.unwrap();
        }
    };
    println!(
        "\nanswered by {} at {}",
        answer.source,
        answer.path.unwrap().peer
    );
    node.shutdown().await;
}

/// Counts received messages, and prints when the urgent one arrives.
pub(crate) async fn sink() {
    let node = Node::start(config(101)).unwrap();
    let mut port = node.attach(33).unwrap();
    println!("\nlistening on {}", node.links()[0].local);
    let mut usual = 0;
    let mut urgent = false;
    while usual < FLOOD || !urgent {
        let message = port.recv().await.unwrap();
        if message.priority == Priority::SafetyCritical {
            urgent = true;
            println!("urgent message after {usual}");
        } else {
            usual += 1;
        }
    }
    println!("all {usual}");
    std::future::pending::<()>().await;
}

/// Sends far more than the network can carry, then an urgent message.
pub(crate) async fn flood() {
    let node = Node::start(config(102)).unwrap();
    let port = node.attach(1).unwrap();
    let picture = Bytes::from(vec![0; 1400]);
    let usual = Outgoing::new(port.id(), JausId::EVERYONE, picture);
    let set_emergency = Bytes::from_static(&[0x06, 0x00, 0x01]);
    let urgent = Outgoing {
        priority: Priority::SafetyCritical,
        ..Outgoing::new(port.id(), JausId::EVERYONE, set_emergency)
    };
    for _ in 0..FLOOD {
        port.send(usual.clone()).unwrap();
    }
    port.send(urgent).unwrap();
    std::future::pending::<()>().await;
}

/// Number of messages that an announcer sends.
pub(crate) const ANNOUNCEMENTS: u8 = 10;

/// Prints the number of every announcement received.
pub(crate) async fn listen() {
    let node = Node::start(config(101)).unwrap();
    let mut port = node.attach(33).unwrap();
    println!("\nlistening on {} links", node.links().len());
    while let Some(message) = port.recv().await {
        println!("heard {}", message.payload[2]);
    }
}

/// Broadcasts consecutive numbers.
pub(crate) async fn announce() {
    let node = Node::start(config(102)).unwrap();
    let port = node.attach(1).unwrap();
    for number in 0..ANNOUNCEMENTS {
        let payload = Bytes::copy_from_slice(&[0x02, 0x42, number]);
        port.send(Outgoing::new(port.id(), JausId::EVERYONE, payload))
            .unwrap();
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    std::future::pending::<()>().await;
}

/// A vehicle that offers the core services. Runs until killed.
pub(crate) async fn vehicle() {
    let node = Node::start(config(101)).unwrap();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .attach(&node, 33)
        .unwrap();
    print_changes(&rover).await;
}

/// An operator that looks for vehicles. Runs until killed.
pub(crate) async fn operator() {
    let node = Node::start(config(102)).unwrap();
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator")
        .attach(&node, 1)
        .unwrap();
    print_changes(&operator).await;
}

/// Prints each subsystem that is found, once its services are known, and each that is lost.
async fn print_changes(component: &Component) {
    let mut changes = component.watch();
    println!("\nstarted");
    while let Some(change) = changes.next().await {
        match change {
            Change::Services(id) if id != component.id() => {
                println!("found {id} with its services");
            }
            Change::Lost(id, _) => println!("lost {id}"),
            _ => {}
        }
    }
}

/// Octets per datagram of the batch: more than fit a frame.
const LENGTH: usize = 3000;
/// Number of datagrams in the batch.
pub(crate) const DATAGRAMS: usize = 20;

/// Sends a batch of datagrams that do not fit a frame, from which the link learns its segment
/// limit, and then a batch of datagrams that fit.
pub(crate) async fn send_batches() {
    let mut link = UdpLink::open(&cable(), &udp::Settings::default()).unwrap();
    let mut transmit = Transmit {
        link: LinkId(0),
        to: To::Peer(SocketAddr::from(([10, 213, 77, 1], 3794)).into()),
        priority: Priority::Standard,
        payload: vec![7; DATAGRAMS * LENGTH].into(),
        segment: Some(LENGTH),
    };
    println!("\nstarted");
    link.transmit(&transmit);
    transmit.segment = Some(LENGTH / 3);
    link.transmit(&transmit);
    poll_fn(|cx| link.poll_flush(cx)).await;
    println!(
        "sent {} with {} errors",
        link.counters().sent,
        link.counters().send_errors
    );
    std::future::pending::<()>().await;
}

/// Counts the datagrams of both batches.
pub(crate) async fn receive_batches() {
    let mut link = UdpLink::open(&cable(), &udp::Settings::default()).unwrap();
    println!("\nlistening on {}", link.local());
    let mut slab = Slab::default();
    for (count, length) in [(DATAGRAMS, LENGTH), (3 * DATAGRAMS, LENGTH / 3)] {
        for _ in 0..count {
            let (_, datagram) = poll_fn(|cx| link.poll_recv(cx, &mut slab)).await;
            assert_eq!(datagram.len(), length);
        }
        println!("arrived {count}");
    }
    std::future::pending::<()>().await;
}

fn cable() -> Interface {
    let cable = Interfaces::Only(vec!["jaus0".into()]);
    cable.choose(Ip::V4).unwrap().remove(0)
}
