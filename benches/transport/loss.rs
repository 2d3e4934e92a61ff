//! Acknowledged messages across a network that delays and loses datagrams: a relay in user space
//! between two nodes.

use std::net::{SocketAddr, UdpSocket};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use jaus::endpoint::Outgoing;
use jaus::link::Group;
use jaus::node::{Config, Node};
use jaus::random::Random;
use jaus_test_kit::figures::Figures;

use crate::Effort;
use crate::baseline::Flow;
use crate::child::Process;
use crate::one_way::{self, Manner};
use crate::placement::{Placement, Side};
use crate::report::{quotient, ratio, spread};
use crate::roles::{self, CODE, Role};
use crate::setting::Setting;

/// Payload lengths in octets.
const LENGTHS: [usize; 3] = [64, 64 << 10, 1 << 20];
/// Share of lost datagrams, in percent.
const LOSSES: [u8; 2] = [0, 5];
/// The aim: the least share of the rate without loss.
const AIM: f64 = 0.5;
/// Delay of each datagram.
const DELAY: Duration = Duration::from_millis(5);
/// With loss, the mean needs more time to settle than in the other measurements.
const SECONDS: f64 = 3.0;

pub(crate) fn measure(effort: Effort, figures: &mut Figures) {
    let time = Duration::from_secs_f64(effort.seconds * SECONDS);
    for length in LENGTHS {
        let mut rates = [const { Vec::new() }; LOSSES.len()];
        for run in 0..effort.runs {
            for (rates, percent) in rates.iter_mut().zip(LOSSES) {
                rates.push(flow(length, percent, run as u64, time).rate());
            }
        }
        figures.table(
            &format!("Acknowledged, {length} octets, round trip of 10 ms"),
            ["loss each way", "messages/s", "MB/s", "to no loss"],
        );
        for (all, percent) in rates.iter().zip(LOSSES) {
            let megabytes: Vec<_> = all.iter().map(|it| it * length as f64 / 1e6).collect();
            figures.row([
                &format!("{percent} %"),
                &spread(all, 1),
                &spread(&megabytes, 2),
                &ratio(all, &rates[0]),
            ]);
        }
        let is_met = quotient(&rates[1], &rates[0]) >= AIM;
        figures.aim("at least half of the rate without loss", [("", is_met)]);
    }
}

fn flow(length: usize, percent: u8, seed: u64, time: Duration) -> Flow {
    let anywhere = Placement::Free.of(Side::Theirs);
    let [ours, theirs] = Setting::OwnNodes.ids();
    let [here, there] = free_addresses();
    let network = Process::start(&Role::Network(here, there, percent, seed), &anywhere);
    let (near, far) = network.ready.split_once(' ').expect("two addresses");
    let peer = |address: &str, id| format!("{id}@{address}").parse().expect("a peer");
    let sink = Role::SinkAt(theirs, there, peer(far, ours));
    let _sink = Process::start(&sink, &anywhere);
    let mut message = vec![0; length];
    message[..2].copy_from_slice(&CODE);
    let message = Outgoing::new(ours, theirs, message.into());
    roles::runtime().block_on(async {
        let settings = settings(ours, here, peer(near, theirs));
        let node = Node::start(settings).expect("a node on loopback");
        let mut port = node.attach(ours.component()).expect("a free number");
        one_way::send(&mut port, &message, Manner::Acknowledged, time).await
    })
}

/// Settings of a node at an address that knows one peer only.
pub(crate) fn settings(
    id: jaus::address::JausId,
    at: SocketAddr,
    peer: jaus::node::PeerAddress,
) -> Config {
    Config::loopback(id.subsystem(), id.node())
        .port(at.port())
        .group(Group::Off)
        .peer(peer)
}

/// Free ports of loopback.
pub(crate) fn free_addresses<const N: usize>() -> [SocketAddr; N] {
    let sockets = [(); N].map(|()| UdpSocket::bind("127.0.0.1:0").expect("a free port"));
    sockets.map(|socket| socket.local_addr().expect("an address"))
}

/// A child: forwards datagrams between two addresses, with a delay and with loss.
pub(crate) fn network(here: SocketAddr, there: SocketAddr, percent: u8, seed: u64) {
    let socket = |peer: SocketAddr| {
        let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None);
        let socket = socket.expect("a socket");
        socket.set_recv_buffer_size(4 << 20).expect("a buffer");
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        socket.bind(&any.into()).expect("an address");
        socket.connect(&peer.into()).expect("the node's address");
        UdpSocket::from(socket)
    };
    let [near, far] = [socket(here), socket(there)];
    let [to_here, to_there] = [&near, &far].map(|it| it.try_clone().expect("the same socket"));
    let address = |socket: &UdpSocket| socket.local_addr().expect("an address");
    println!("{} {}", address(&near), address(&far));
    std::thread::spawn(move || pass_on(&near, to_there, percent, 2 * seed));
    pass_on(&far, to_here, percent, 2 * seed + 1);
}

fn pass_on(from: &UdpSocket, to: UdpSocket, percent: u8, seed: u64) {
    let (sender, waiting) = channel::<(Instant, Vec<u8>)>();
    std::thread::spawn(move || {
        for (due, datagram) in waiting {
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            // The node may not be there yet, or may be gone.
            let _ = to.send(&datagram);
        }
    });
    let (mut buffer, mut random) = ([0; 65_536], Random::new(seed));
    loop {
        // An error reports that an earlier datagram found no node.
        let Ok(length) = from.recv(&mut buffer) else {
            continue;
        };
        if random.number() % 100 >= u64::from(percent) {
            let datagram = buffer[..length].to_vec();
            if sender.send((Instant::now() + DELAY, datagram)).is_err() {
                return;
            }
        }
    }
}
