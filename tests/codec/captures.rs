//! Recorded traffic of other JAUS stacks, decoded with the wire formats, and replayed to an
//! endpoint in place of one party.

use std::fs::File;
use std::net::{IpAddr, SocketAddr};
use std::path::Path as FilePath;
use std::time::{Duration, Instant};

use Counter::{AcknowledgementsSent, MessagesDelivered, MessagesReceived};
use bytes::Bytes;
use jaus::endpoint::{
    Config, Counter, Endpoint, LinkId, LinkProfile, Path, Received, To, Transmit,
};
use jaus::wire::{Version, judp};
use jaus_test_kit::evidence;
use jaus_view::{Capture, Network};

/// A captured datagram.
struct Recorded {
    /// Since 1970.
    time: Duration,
    source: SocketAddr,
    destination: SocketAddr,
    payload: Bytes,
}

/// The JAUS datagrams of a capture.
fn recorded(file: &FilePath) -> Vec<Recorded> {
    let mut capture = Capture::new(File::open(file).expect("a readable file")).expect("a capture");
    let mut network = Network::new([judp::PORT]);
    let mut datagrams = Vec::new();
    while let Some(frame) = capture.next_frame() {
        let frame = frame.expect("a whole capture");
        let time = frame.time.map_or(Duration::ZERO, |time| {
            Duration::new(time.seconds().unsigned_abs(), time.subsec_nanos())
        });
        let found = network.handle_frame(&frame).into_iter();
        for datagram in found.filter(|it| !it.by_tcp) {
            let payload = Bytes::copy_from_slice(&datagram.payload);
            let (source, destination) = (datagram.source, datagram.destination);
            datagrams.push(Recorded {
                time,
                source,
                destination,
                payload,
            });
        }
    }
    datagrams
}

/// Contents of a capture: datagrams, messages by header version (AS5669A, AS5669, RA), datagrams
/// with stale octets, and undecodable datagrams.
#[derive(Debug, Default, PartialEq, Eq)]
struct Contents {
    datagrams: usize,
    messages: [usize; 3],
    stale: usize,
    unreadable: usize,
}

fn contents(datagrams: &[Recorded]) -> Contents {
    let mut contents = Contents {
        datagrams: datagrams.len(),
        ..Contents::default()
    };
    for datagram in datagrams {
        let Ok(mut frames) = judp::frames(datagram.payload.clone()) else {
            contents.unreadable += 1;
            continue;
        };
        for frame in &mut frames {
            match frame.map(|frame| frame.version) {
                Ok(Version::As5669a) => contents.messages[0] += 1,
                Ok(Version::As5669) => contents.messages[1] += 1,
                Ok(Version::Ra) => contents.messages[2] += 1,
                Err(_) => contents.unreadable += 1,
            }
        }
        contents.stale += usize::from(frames.remaining() > 0);
    }
    contents
}

/// Each file of UDP traffic. Those of TCP and of OpenJAUS's internal traffic have nothing on the
/// JAUS port.
#[test]
fn every_recorded_datagram_is_read() {
    let expected = [
        ("SAE_Management_PacketCapture.pcap", 22, [22, 0, 0], 0),
        (
            "igvc2015/interface_test_1_13pts.pcapng",
            3657,
            [3657, 0, 0],
            0,
        ),
        (
            "igvc2015/qualification-practive-2015.pcap.pcapng",
            91,
            [91, 0, 0],
            0,
        ),
        ("jauspp/01-vehsim-client.pcap", 450, [450, 0, 0], 390),
        ("jauspp/02-rawvehicle-client.pcap", 283, [283, 0, 0], 62),
        ("jauspp/05-jcopc-challenge2010.pcap", 270, [270, 0, 0], 231),
        ("jauspp/06-jtcp.pcap", 5, [5, 0, 0], 0),
        ("jauspp/07-cop-challenge2010.pcap", 71, [71, 0, 0], 29),
        ("junior/01-discovery-then-unicast.pcap", 17, [17, 0, 0], 0),
        ("junior/02-acked-small.pcap", 2, [2, 0, 0], 0),
        ("junior/03-acked-100KB.pcap", 52, [52, 0, 0], 0),
        ("junior/04-unacked-100KB-bigbuf.pcap", 27, [27, 0, 0], 0),
        (
            "junior/05-unacked-100KB-default-loss.pcap",
            27,
            [27, 0, 0],
            0,
        ),
        ("junior/06-global-broadcast.pcap", 2, [2, 0, 0], 0),
        ("junior/07-subsystem-wildcard.pcap", 1, [1, 0, 0], 0),
        ("junior/08-ack-timeout-no-peer.pcap", 4, [4, 0, 0], 0),
        ("junior/09-as5669-v1-msgid.pcap", 2, [0, 2, 0], 0),
        ("junior/10-opc-JAUS01.0.pcap", 2, [0, 0, 2], 0),
        ("junior/11-priority0-bug.pcap", 3, [3, 0, 0], 0),
        ("junior/12-priority15.pcap", 2, [2, 0, 0], 0),
        ("junior/13-jtcp.pcap", 0, [0, 0, 0], 0),
        ("junior/14-jtcp-64KB.pcap", 0, [0, 0, 0], 0),
        ("openjaus33/openjaus33-judp-wire.pcap", 48, [0, 48, 0], 0),
        ("openjaus33/openjaus33-opc-lo.pcap", 0, [0, 0, 0], 0),
        ("openjaus33/openjaus33-opc-wire.pcap", 163, [0, 0, 163], 0),
        ("openjaus33/openjaus33-peer-wire.pcap", 48, [0, 0, 48], 0),
    ];
    for (file, datagrams, messages, stale) in expected {
        let Some(path) = evidence::capture(file) else {
            continue;
        };
        let found = contents(&recorded(&path));
        assert_eq!(
            found,
            Contents {
                datagrams,
                messages,
                stale,
                unreadable: 0
            },
            "{file}"
        );
    }
}

/// An endpoint in place of a recorded party, after it has received all messages to that party.
struct Replay {
    endpoint: Endpoint,
    received: Vec<Received>,
    transmits: Vec<Transmit>,
}

impl Replay {
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn new(file: &FilePath, address: &str, ids: &[&str]) -> Self {
        let address: IpAddr = address.parse().expect("an address");
        let mut endpoint = Endpoint::new(Config::default());
        let own = SocketAddr::new(address, judp::PORT);
        endpoint.add_link(LinkId(0), LinkProfile::judp([own]));
        for id in ids {
            endpoint
                .attach(id.parse().expect("an id"))
                .expect("an id of one component");
        }
        let mut replay = Self {
            endpoint,
            received: Vec::new(),
            transmits: Vec::new(),
        };
        let (datagrams, start) = (recorded(file), Instant::now());
        let began = datagrams
            .first()
            .map_or(Duration::ZERO, |datagram| datagram.time);
        let reaches_us = |datagram: &&Recorded| {
            let to = datagram.destination.ip();
            datagram.source.ip() != address && (to == address || to.is_multicast())
        };
        for datagram in datagrams.iter().filter(reaches_us) {
            replay.hear(start + (datagram.time - began), datagram);
        }
        replay
    }

    fn hear(&mut self, now: Instant, datagram: &Recorded) {
        self.endpoint.handle_timeout(now);
        let path = Path {
            link: LinkId(0),
            peer: datagram.source.into(),
        };
        self.endpoint
            .handle_datagram(now, path, datagram.payload.clone(), &mut self.received);
        self.transmits
            .extend(std::iter::from_fn(|| self.endpoint.poll_transmit(now)));
    }

    /// The nonzero counters, except those that every replay has.
    fn notable(&self) -> Vec<(Counter, u64)> {
        const ORDINARY: [Counter; 2] = [Counter::DatagramsReceived, Counter::DatagramsSent];
        let counters = self.endpoint.counters().iter();
        counters
            .filter(|&(counter, number)| number > 0 && !ORDINARY.contains(&counter))
            .collect()
    }

    fn peers(&self) -> Vec<String> {
        self.endpoint
            .peers()
            .map(|peer| format!("{} {} {}", peer.id, peer.path.peer, peer.version))
            .collect()
    }
}

/// The endpoint replaces Junior's node B, 2.1.1. Checks received, acknowledged and dropped
/// messages.
#[test]
fn what_junior_sends_is_taken_as_junior_takes_it() {
    let captures = evidence::captures();
    let plain = |received, delivered, acknowledged| {
        let counters = [
            (MessagesReceived, received),
            (MessagesDelivered, delivered),
            (AcknowledgementsSent, acknowledged),
        ];
        counters
            .into_iter()
            .filter(|&(_, number)| number > 0)
            .collect::<Vec<_>>()
    };
    let and = |mut counters: Vec<_>, more| {
        counters.push(more);
        counters
    };
    for (file, version, expected) in [
        ("01-discovery-then-unicast", "judp2", plain(8, 8, 1)),
        ("02-acked-small", "judp2", plain(1, 1, 1)),
        ("03-acked-100KB", "judp2", plain(26, 2, 26)),
        ("04-unacked-100KB-bigbuf", "judp2", plain(26, 2, 1)),
        ("05-unacked-100KB-default-loss", "judp2", plain(26, 2, 1)),
        ("06-global-broadcast", "judp2", plain(2, 2, 0)),
        ("07-subsystem-wildcard", "judp2", plain(1, 1, 0)),
        (
            "08-ack-timeout-no-peer",
            "judp2",
            and(plain(4, 1, 4), (Counter::Duplicate, 3)),
        ),
        ("09-as5669-v1-msgid", "judp1", plain(1, 1, 1)),
        ("10-opc-JAUS01.0", "ra", plain(1, 1, 1)),
        (
            "11-priority0-bug",
            "judp2",
            and(plain(2, 1, 1), (Counter::PriorityFault, 1)),
        ),
        ("12-priority15", "judp2", plain(1, 1, 1)),
    ] {
        let replay = Replay::new(
            &captures.join(format!("junior/{file}.pcap")),
            "10.77.0.2",
            &["2.1.1"],
        );
        assert_eq!(replay.notable(), expected, "{file}");
        assert_eq!(
            replay.peers(),
            [format!("1.1.1 10.77.0.1:3794 {version}")],
            "{file}"
        );
        for received in &replay.received {
            assert!(
                [0x4B01, 0x2B00].contains(&code(received)),
                "{file}: the code comes first"
            );
        }
        let sender: SocketAddr = "10.77.0.1:3794".parse().expect("an address");
        let acknowledgements = replay.transmits.iter();
        for to in acknowledgements.map(|transmit| transmit.to) {
            assert_eq!(to, To::Peer(sender.into()), "{file}");
        }
    }
}

fn code(received: &Received) -> u16 {
    let octets = received.payload[..2].try_into().expect("a message code");
    u16::from_le_bytes(octets)
}

#[test]
fn a_large_message_of_junior_is_put_together() {
    let captures = evidence::captures();
    for file in [
        "03-acked-100KB",
        "04-unacked-100KB-bigbuf",
        "05-unacked-100KB-default-loss",
    ] {
        let replay = Replay::new(
            &captures.join(format!("junior/{file}.pcap")),
            "10.77.0.2",
            &["2.1.1"],
        );
        let lengths: Vec<_> = replay
            .received
            .iter()
            .map(|received| received.payload.len())
            .collect();
        assert_eq!(lengths, [8, 100_000], "{file}");
        assert!(
            replay.received[1].payload[2..]
                .iter()
                .all(|&octet| octet == b'x'),
            "{file}"
        );
    }
}

/// Our acknowledgements equal those of Junior's node B, octet by octet.
#[test]
fn our_acknowledgements_are_those_that_junior_sends() {
    let captures = evidence::captures();
    for file in [
        "01-discovery-then-unicast",
        "02-acked-small",
        "03-acked-100KB",
        "09-as5669-v1-msgid",
        "10-opc-JAUS01.0",
    ] {
        let path = captures.join(format!("junior/{file}.pcap"));
        let replay = Replay::new(&path, "10.77.0.2", &["2.1.1"]);
        let ours: Vec<_> = replay
            .transmits
            .into_iter()
            .map(|transmit| transmit.payload)
            .collect();
        let b: IpAddr = "10.77.0.2".parse().expect("an address");
        let is_acknowledgement = |datagram: &Recorded| {
            let frame = judp::frames(datagram.payload.clone())
                .ok()
                .and_then(|mut frames| frames.next()?.ok());
            datagram.source.ip() == b && frame.is_some_and(|frame| frame.is_acknowledgement())
        };
        let theirs = recorded(&path).into_iter().filter(is_acknowledgement);
        assert_eq!(
            ours,
            theirs.map(|datagram| datagram.payload).collect::<Vec<_>>(),
            "{file}"
        );
    }
}

/// Stale octets behind most of its messages neither lose nor fabricate a message.
#[test]
fn what_jauspp_sends_is_delivered_and_nothing_else() {
    let captures = evidence::captures();
    for (file, address, ids, received, delivered, stale, peers) in [
        (
            "01-vehsim-client",
            "10.99.0.1",
            &["152.1.1", "152.1.2"][..],
            199,
            202,
            34_845,
            1,
        ),
        (
            "01-vehsim-client",
            "10.99.0.2",
            &["1000.1.7"],
            251,
            251,
            129_864,
            2,
        ),
        (
            "02-rawvehicle-client",
            "10.99.0.2",
            &["77.1.1"],
            68,
            68,
            12_584,
            1,
        ),
        (
            "05-jcopc-challenge2010",
            "10.99.0.1",
            &["152.1.1"],
            137,
            137,
            23_600,
            1,
        ),
        (
            "07-cop-challenge2010",
            "10.99.0.1",
            &["152.1.1"],
            38,
            38,
            0,
            1,
        ),
    ] {
        let replay = Replay::new(&captures.join(format!("jauspp/{file}.pcap")), address, ids);
        let expected = [
            (MessagesReceived, received),
            (MessagesDelivered, delivered),
            (Counter::StaleOctets, stale),
        ];
        let expected: Vec<_> = expected
            .into_iter()
            .filter(|&(_, number)| number > 0)
            .collect();
        assert_eq!(replay.notable(), expected, "{file}");
        assert_eq!(replay.peers().len(), peers, "{file}: {:?}", replay.peers());
        assert!(
            replay.transmits.is_empty(),
            "{file}: it never asks for acknowledgements"
        );
    }
}

/// The heartbeats go to 255.255.1.1 in the older notation, which decodes as component 1 of node 1
/// of every subsystem.
#[test]
fn openjaus_is_heard_through_both_older_headers() {
    let captures = evidence::captures();
    for (file, version, received, delivered) in [
        ("judp-wire", Version::As5669, 23, 7),
        ("opc-wire", Version::Ra, 81, 28),
        ("peer-wire", Version::Ra, 22, 8),
    ] {
        let path = captures.join(format!("openjaus33/openjaus33-{file}.pcap"));
        let replay = Replay::new(&path, "10.77.0.1", &["1.1.1"]);
        let expected = [
            (MessagesReceived, received),
            (MessagesDelivered, delivered),
            (Counter::NotForUs, received - delivered),
        ];
        assert_eq!(replay.notable(), expected, "{file}");
        assert!(
            replay
                .received
                .iter()
                .all(|received| code(received) == 0x4202),
            "{file}: heartbeats"
        );
        assert!(
            replay.endpoint.peers().all(|peer| peer.version == version),
            "{file}"
        );
    }
}

/// The tool counts sequence numbers per destination, so that the same numbers recur.
#[test]
fn nothing_that_the_judging_tool_asks_is_lost() {
    let Some(captures) = evidence::outside("captures/igvc2015") else {
        return;
    };
    let judges = ["42.1.1", "42.2.1", "42.2.2", "42.2.3", "42.2.4"];
    for (file, asked) in [
        ("interface_test_1_13pts.pcapng", 71),
        ("qualification-practive-2015.pcap.pcapng", 81),
    ] {
        let path = captures.join(file);
        let replay = Replay::new(&path, "192.168.1.105", &["105.1.1"]);
        assert_eq!(
            replay.notable(),
            [(MessagesReceived, asked), (MessagesDelivered, asked)],
            "{file}"
        );
        let expected = judges.map(|judge| format!("{judge} 192.168.1.42:3794 judp2"));
        assert_eq!(replay.peers(), expected, "{file}");
    }
    let path = captures.join("interface_test_1_13pts.pcapng");
    let replay = Replay::new(&path, "192.168.1.42", &judges);
    assert_eq!(
        replay.notable(),
        [(MessagesReceived, 3586), (MessagesDelivered, 3586)],
        "the team's answers"
    );
}
