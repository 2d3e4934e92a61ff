//! Recorded traffic of OpenJAUS 3.3.1 node managers, with our node in place of one of them: our
//! answers equal those of the replaced node.

#![expect(clippy::expect_used, reason = "helpers of tests")]

use std::fs::File;
use std::net::{IpAddr, Ipv4Addr};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::wire::judp;
use jaus_ra::node::{Event, RaComponentEntry, RaNode, RaNodeEntry, RaSubsystemEntry, Settings};
use jaus_ra::{Counter, RaId};
use jaus_test_kit::evidence;
use jaus_view::{Capture, Network};

const A: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 77, 0, 1));
const B: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 77, 0, 2));

/// A recorded datagram.
struct Datagram {
    /// Time since 1970-01-01.
    time: Duration,
    from: IpAddr,
    octets: Bytes,
}

fn recorded(file: &str) -> Vec<Datagram> {
    let file = evidence::captures().join("openjaus33").join(file);
    let mut capture = Capture::new(File::open(file).expect("a readable file")).expect("a capture");
    let mut network = Network::new([judp::PORT]);
    let mut datagrams = Vec::new();
    while let Some(frame) = capture.next_frame() {
        let frame = frame.expect("a whole capture");
        let time = frame.time.expect("a time");
        let time = Duration::new(time.seconds().unsigned_abs(), time.subsec_nanos());
        datagrams.extend(
            network
                .handle_frame(&frame)
                .into_iter()
                .map(|datagram| Datagram {
                    time,
                    from: datagram.source.ip(),
                    octets: Bytes::copy_from_slice(&datagram.payload),
                }),
        );
    }
    datagrams
}

/// The message in a datagram: framing, source, destination, code and data.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Said {
    framing: u8,
    source: RaId,
    destination: RaId,
    code: u16,
    data: Bytes,
}

impl Said {
    fn read(datagram: &Bytes) -> Self {
        let frame = judp::frames(datagram.clone())
            .expect("a framing")
            .next()
            .expect("a message")
            .expect("a whole message");
        Self {
            framing: datagram[0],
            source: frame.source.into(),
            destination: frame.destination.into(),
            code: frame.code().expect("a code"),
            data: frame.payload.slice(2..),
        }
    }

    /// Whether both answer the same question.
    fn answers_as(&self, other: &Self) -> bool {
        let same_field = self.code != 0x4B00 || self.data[0] == other.data[0];
        let who = |said: &Self| (said.source, said.destination, said.code);
        same_field && who(self) == who(other)
    }

    /// The data without legitimate differences: OpenJAUS sets meaningless bits in the
    /// confirmation's presence vector, and each side describes its own services.
    fn comparable(&self) -> Bytes {
        match self.code {
            0x01F3 => self.data.slice(1..),
            0x4B03 => Bytes::new(),
            _ => self.data.clone(),
        }
    }
}

/// A subsystem of one node, as described by its node manager.
fn subsystem(id: u8, names: [&str; 4], others: &[(u8, &str)]) -> RaSubsystemEntry {
    let [name, node, manager, communicator] = names;
    let both = [(1, manager), (35, communicator)];
    let components = both
        .iter()
        .chain(others)
        .map(|&(component, name)| RaComponentEntry {
            component,
            instance: 1,
            name: name.into(),
            services: Vec::new(),
        });
    RaSubsystemEntry {
        id,
        name: name.into(),
        nodes: vec![RaNodeEntry {
            id: 1,
            name: node.into(),
            components: components.collect(),
        }],
    }
}

/// Result of a replay.
struct Replay {
    node: RaNode,
    events: Vec<Event>,
    /// The answers of the replaced node, and all messages of ours.
    expected: Vec<Said>,
    said: Vec<Said>,
}

#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
fn replay(file: &str, replaced: IpAddr, ours: RaSubsystemEntry) -> Replay {
    let recorded = recorded(file);
    let (start, first) = (Instant::now(), recorded[0].time);
    let mut node = RaNode::new(Settings::default());
    node.announce(start, ours).expect("a valid subsystem");
    let mut replay = Replay {
        node,
        events: Vec::new(),
        expected: Vec::new(),
        said: Vec::new(),
    };
    for datagram in &recorded {
        let now = start + (datagram.time - first);
        while let Some(due) = replay.node.poll_timeout().filter(|&due| due <= now) {
            replay.node.handle_timeout(due);
            replay.drain();
        }
        if datagram.from == replaced {
            let said = Said::read(&datagram.octets);
            let answers = [0x4B00, 0x4B01, 0x4B03, 0x01F3];
            replay
                .expected
                .extend(answers.contains(&said.code).then_some(said));
        } else {
            let from = (datagram.from, judp::PORT).into();
            let octets = datagram.octets.clone();
            replay.node.handle_datagram(now, from, octets);
        }
        replay.drain();
    }
    replay
}

impl Replay {
    fn drain(&mut self) {
        while let Some(transmit) = self.node.poll_transmit() {
            self.said.push(Said::read(&transmit.datagram));
        }
        self.events
            .extend(std::iter::from_fn(|| self.node.poll_event()));
    }

    /// Checks that our node gave each answer of the replaced one.
    fn check_answers(&self) {
        assert!(!self.expected.is_empty());
        for expected in &self.expected {
            let mut same = self.said.iter().filter(|said| said.answers_as(expected));
            let ours = same.next().map(|said| (said.framing, said.comparable()));
            let theirs = (expected.framing, expected.comparable());
            assert_eq!(ours, Some(theirs), "{expected:?}");
        }
        for counter in [Counter::Malformed, Counter::AnswerRate, Counter::NotForUs] {
            assert_eq!(self.node.counters().get(counter), 0, "{counter}");
        }
    }

    fn appeared(&self) -> &RaSubsystemEntry {
        let mut appeared = self.events.iter().filter_map(|event| match event {
            Event::Appeared(subsystem) => Some(subsystem),
            _ => None,
        });
        appeared.next().expect("it appeared")
    }
}

const MANAGERS: [&str; 2] = ["OpenJAUS Node Manager", "OpenJAUS Communicator"];

#[test]
fn in_place_of_the_second_node_manager_ours_answers_as_it_did_in_both_framings() {
    for file in ["openjaus33-opc-wire.pcap", "openjaus33-judp-wire.pcap"] {
        let [manager, communicator] = MANAGERS;
        let ours = subsystem(20, ["OJ_b", "OJNode_b", manager, communicator], &[]);
        let replay = replay(file, B, ours);
        replay.check_answers();
        let other = replay.appeared();
        assert_eq!((other.id, other.name.as_str()), (10, "OJ_a"));
        let names = other
            .components()
            .map(|(_, component)| component.name.as_str());
        assert_eq!(names.collect::<Vec<_>>(), MANAGERS);
        let services = other.components().map(|(_, component)| &component.services);
        assert!(services.flatten().any(|service| !service.inputs.is_empty()));
    }
}

#[test]
fn in_place_of_the_first_one_ours_answers_the_storm_of_questions() {
    let [manager, communicator] = MANAGERS;
    let others = [
        (33, "pd"),
        (38, "gpos"),
        (42, "vss"),
        (45, "Waypoint Driver"),
    ];
    let ours = subsystem(10, ["OJ_a", "OJNode_a", manager, communicator], &others);
    let mut replay = replay("openjaus33-opc-wire.pcap", A, ours);
    // In the recording the vehicle joined later; our subsystem was complete from the start.
    replay.expected.retain(|said| said.code != 0x4B01);
    replay.check_answers();
    assert_eq!(replay.appeared().name, "OJ_b");
}

#[test]
fn in_place_of_the_probe_ours_is_listed_as_it_was() {
    let names = [
        "RUST_BRIDGE",
        "RustNode",
        "Rust Node Manager",
        "Rust Communicator",
    ];
    let ours = subsystem(30, names, &[(33, "Rust PD"), (61, "Rust VKS")]);
    let replay = replay("openjaus33-peer-wire.pcap", B, ours);
    replay.check_answers();
    let asked = replay
        .said
        .iter()
        .filter(|said| said.code >> 12 == 2)
        .count();
    assert!(asked > 0, "and it asked as well");
}

#[test]
fn components_that_come_and_go_are_seen_to() {
    let [manager, communicator] = MANAGERS;
    let ours = subsystem(20, ["OJ_b", "OJNode_b", manager, communicator], &[]);
    let replay = replay("openjaus33-opc-wire.pcap", B, ours);
    let most = replay.events.iter().filter_map(|event| match event {
        Event::Changed(subsystem) => Some(subsystem),
        _ => None,
    });
    let most = most.max_by_key(|subsystem| subsystem.components().count());
    let names = most.expect("changes").components();
    let names: Vec<_> = names
        .map(|(_, component)| component.name.as_str())
        .collect();
    let [_, _, driver, pose, velocity, waypoints] = names[..] else {
        panic!("{names:?}")
    };
    let expected = ["pd", "gpos", "vss", "Waypoint Driver"];
    assert_eq!([driver, pose, velocity, waypoints], expected);
    let last = replay.node.subsystems().next().expect("still there");
    assert_eq!(last.components().count(), 2, "the vehicle has ended");
}
