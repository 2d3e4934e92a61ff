//! Captured discovery and heartbeat requests of the competitions' judging tool, octet by octet,
//! against a node with real sockets on the loopback interface.
//!
//! The capture is not part of the project; see `JAUS_SHARED` in CONTRIBUTING.

use std::fs::File;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::path::Path;
use std::time::{Duration, Instant};

use jaus::component::{Component, Kind};
use jaus::link::Group;
use jaus::node::{Config, Node};
use jaus_test_kit::evidence;
use jaus_test_kit::waiting::LIMIT;
use jaus_view::{Capture, JAUS_PORT, Network};

/// The subsystem of the judged vehicle, and that of ours.
const JUDGED: u16 = 105;
const OURS: u16 = 2105;

/// Offsets in a datagram with one AS5669A message: version, header, payload, sequence number.
const DESTINATION_SUBSYSTEM: std::ops::Range<usize> = 7..9;
const SOURCE: std::ops::Range<usize> = 9..13;
const CODE: std::ops::Range<usize> = 13..15;

fn code(datagram: &[u8]) -> u16 {
    u16::from_le_bytes([datagram[CODE.start], datagram[CODE.start + 1]])
}

/// The judge's requests in one capture, in order, without repetitions, with the judged vehicle's
/// subsystem replaced by ours.
fn requests(capture: &Path) -> Vec<Vec<u8>> {
    let judge = SocketAddr::from(([192, 168, 1, 42], JAUS_PORT));
    let mut capture = Capture::new(File::open(capture).unwrap()).unwrap();
    let mut network = Network::new([JAUS_PORT]);
    let mut requests: Vec<Vec<u8>> = Vec::new();
    while let Some(frame) = capture.next_frame() {
        let frame = frame.unwrap();
        let [datagram] = &network.handle_frame(&frame)[..] else {
            continue;
        };
        let mut octets = datagram.payload.to_vec();
        let wanted = [0x2B00, 0x2B01, 0x2B02, 0x2B03, 0x2202];
        if datagram.source.ip() != judge.ip()
            || octets.len() < CODE.end
            || octets[0] != 2
            || !wanted.contains(&code(&octets))
        {
            continue;
        }
        if octets[DESTINATION_SUBSYSTEM] == JUDGED.to_le_bytes() {
            octets[DESTINATION_SUBSYSTEM].copy_from_slice(&OURS.to_le_bytes());
        }
        let same = |other: &Vec<u8>| {
            let content = |datagram: &[u8]| datagram[..datagram.len() - 2].to_vec();
            content(other) == content(&octets)
        };
        if !requests.iter().any(same) {
            requests.push(octets);
        }
    }
    requests
}

/// A multicast group for one test, isolated from other tests.
fn own_group() -> SocketAddrV4 {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).unwrap();
    SocketAddrV4::new(
        Ipv4Addr::new(239, 255, 0, 1),
        socket.local_addr().unwrap().port(),
    )
}

/// Waits for the answer: from our component to the judge's, with the report's code.
fn wait_for_answer(judge: &UdpSocket, request: &[u8]) {
    let report = code(request) | 0x4000;
    let report = report & !0x2000;
    let mut buffer = [0; 4096];
    loop {
        let Ok(length) = judge.recv(&mut buffer) else {
            panic!("no answer to {request:02X?}")
        };
        let octets = &buffer[..length];
        let to_the_judge = octets.len() >= CODE.end && octets[5..9] == request[SOURCE];
        if to_the_judge && code(octets) == report {
            return;
        }
    }
}

/// Sends all recorded requests of the judge, and requires every answer.
fn judge(capture: &str, by_multicast: bool) {
    let Some(capture) = evidence::capture(&format!("igvc2015/{capture}")) else {
        return;
    };
    let requests = requests(&capture);
    assert!(!requests.is_empty(), "{} has requests", capture.display());
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .unwrap();
    let _entered = runtime.enter();
    let group = own_group();
    let node = Node::start(Config::loopback(OURS, 1).group(Group::At(group))).unwrap();
    let vehicle = Component::builder(Kind::Vehicle, "Rover")
        .attach(&node, 1)
        .unwrap();
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let loopback = socket2::SockRef::from(&socket);
    loopback.set_multicast_if_v4(&Ipv4Addr::LOCALHOST).unwrap();
    socket.set_read_timeout(Some(LIMIT)).unwrap();
    let to = if by_multicast {
        SocketAddr::V4(group)
    } else {
        node.links()[0].local
    };

    let mut slowest = Duration::ZERO;
    for request in &requests {
        let asked = Instant::now();
        socket.send_to(request, to).unwrap();
        wait_for_answer(&socket, request);
        slowest = slowest.max(asked.elapsed());
    }
    println!(
        "{} requests, the slowest answer took {slowest:?}",
        requests.len()
    );
    drop(vehicle);
}

#[test]
fn requests_of_the_scored_run_are_answered_over_multicast() {
    judge("interface_test_1_13pts.pcapng", true);
}

#[test]
fn requests_of_the_scored_run_are_answered_over_unicast() {
    judge("interface_test_1_13pts.pcapng", false);
}

#[test]
fn requests_of_the_qualification_are_answered_over_multicast() {
    judge("qualification-practive-2015.pcap.pcapng", true);
}

#[test]
fn requests_of_the_qualification_are_answered_over_unicast() {
    judge("qualification-practive-2015.pcap.pcapng", false);
}
