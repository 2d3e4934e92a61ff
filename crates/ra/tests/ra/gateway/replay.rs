//! Recorded traffic of OpenJAUS 3.3.1, with the gateway in place of one peer: every request gets a
//! usable answer.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use bytes::{Buf, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::service::{AccessControl, Kind, Service, Stack};
use jaus::wire::judp;
use jaus_ra::RaId;
use jaus_ra::gateway::{Counter, Settings};
use jaus_test_kit::evidence;
use jaus_vehicle::ground::WorldStore;
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Pilot, SkidSteer, SkidSteerConfig};
use jaus_vehicle::world;
use jaus_view::{Capture, Network};
use redb::backends::InMemoryBackend;

use crate::gateway::world::{World, address, stack};

/// A recorded datagram: time, source, destination and content.
struct Datagram {
    time: Duration,
    from: SocketAddr,
    to: SocketAddr,
    octets: Bytes,
}

fn recorded(file: &str, port: u16) -> Vec<Datagram> {
    let file = evidence::captures().join("openjaus33").join(file);
    let mut capture = Capture::new(File::open(file).unwrap()).unwrap();
    let mut network = Network::new([port]);
    let mut datagrams = Vec::new();
    while let Some(frame) = capture.next_frame() {
        let frame = frame.unwrap();
        let time = frame.time.unwrap();
        let time = Duration::new(time.seconds().unsigned_abs(), time.subsec_nanos());
        datagrams.extend(
            network
                .handle_frame(&frame)
                .into_iter()
                .map(|datagram| Datagram {
                    time,
                    from: datagram.source,
                    to: datagram.destination,
                    octets: Bytes::copy_from_slice(&datagram.payload),
                }),
        );
    }
    datagrams
}

/// The message in a datagram: source, destination, code and data.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Said {
    source: RaId,
    destination: RaId,
    code: u16,
    data: Bytes,
}

fn read(datagram: &Bytes) -> Said {
    let mut frames = judp::frames(datagram.clone()).unwrap();
    let frame = frames.next().unwrap().unwrap();
    Said {
        source: frame.source.into(),
        destination: frame.destination.into(),
        code: frame.code().unwrap(),
        data: frame.payload.slice(2..),
    }
}

/// A JAUS vehicle that obeys the client in control.
fn vehicle(id: JausId) -> Stack {
    let rover = SkidSteer::new(SkidSteerConfig::default());
    let vehicle = Vehicle::new(Pilot::new(rover, Frame::at(52.5, 13.4)));
    let services: Vec<Box<dyn Service>> = vec![
        Box::new(vehicle.primitive_driver()),
        Box::new(vehicle.global_pose_sensor()),
        Box::new(vehicle.velocity_state_sensor()),
    ];
    stack(id, Kind::Vehicle, "Rover", services).access_control(AccessControl::new())
}

/// Delivers the datagrams to the gateway at their recorded times.
fn replay(world: &mut World, datagrams: &[(Duration, Bytes)]) {
    let (Some((first, _)), start) = (datagrams.first(), world.now) else {
        panic!("nothing was recorded");
    };
    for (time, octets) in datagrams {
        let due = start + (*time - *first);
        world.run(due.saturating_duration_since(world.now));
        let now = world.now;
        world
            .gateway
            .handle_datagram(now, address(10), octets.clone());
        world.settle();
    }
    world.run(Duration::from_secs(1));
}

#[test]
fn in_place_of_a_node_manager_every_question_of_the_other_is_answered() {
    for file in ["openjaus33-opc-wire.pcap", "openjaus33-judp-wire.pcap"] {
        let recorded = recorded(file, judp::PORT);
        let a: IpAddr = [10, 77, 0, 1].into();
        let of_a = recorded.into_iter().filter(|it| it.from.ip() == a);
        let of_a: Vec<_> = of_a.map(|it| (it.time, it.octets)).collect();
        let mut world = World::new(Settings::default());
        world.add_jaus(vehicle(JausId::new(20, 1, 7)));
        world.run(Duration::from_secs(5));
        replay(&mut world, &of_a);
        let answers: Vec<Said> = world.sent.iter().map(read).collect();
        let mut asked = 0;
        for question in of_a.iter().map(|(_, octets)| read(octets)) {
            let answer = match question.code {
                0x01F0 => 0x01F3,
                0x2000..=0x2FFF => question.code + 0x2000,
                _ => continue,
            };
            if question.destination.subsystem != 20 {
                continue;
            }
            asked += 1;
            let answered = answers.iter().any(|it| {
                it.code == answer
                    && it.source == question.destination
                    && it.destination == question.source
            });
            assert!(answered, "{file}: {question:?}");
        }
        assert!(asked >= 5, "{file}: {asked}");
        assert!(world.attached().contains(&"10.1.35".to_owned()), "{file}");
    }
}

/// The services in a Report Services: types, each with the codes that it accepts.
fn services(mut data: Bytes) -> Vec<(u16, Vec<u16>)> {
    let commands = |data: &mut Bytes| {
        let code = |data: &mut Bytes| (data.get_u16_le(), data.get_u32_le()).0;
        (0..data.get_u8()).map(|_| code(data)).collect::<Vec<_>>()
    };
    let listed = (0..data.get_u8()).map(|_| {
        let service = (data.get_u16_le(), commands(&mut data));
        commands(&mut data);
        service
    });
    listed.collect()
}

/// Whether a message answers the question in a form that OpenJAUS can list.
fn is_of_use(question: &Said, answer: &Said) -> bool {
    let (asked, data) = (&question.data, &answer.data);
    let back = (question.destination, question.source) == (answer.source, answer.destination);
    back && match (question.code, answer.code) {
        // The same kind of name, and not empty.
        (0x2B00, 0x4B00) => data.len() == 84 && data[0] == asked[0] && data[4] != 0,
        (0x2B01, 0x4B01) => lists_all_components(data),
        (0x2B03, 0x4B03) => lists_what_belongs_to(question.destination.component, data),
        // The event is confirmed.
        (0x01F0, 0x01F3) => data[2..4] == asked[2..4] && data.last() == Some(&0),
        _ => false,
    }
}

/// One node with its manager, its communicator and both parts of the component.
fn lists_all_components(configuration: &Bytes) -> bool {
    let (nodes, listed) = configuration.split_at(3);
    let listed: BTreeSet<&[u8]> = listed.chunks(2).collect();
    let parts: [&[u8]; 4] = [&[1, 1], &[33, 1], &[35, 1], &[61, 1]];
    nodes == [1, 1, 4] && listed == BTreeSet::from(parts)
}

fn lists_what_belongs_to(part: u8, report: &Bytes) -> bool {
    let listed = services(report.clone());
    let has = |kind: u16, code: u16| listed.iter().any(|it| it.0 == kind && it.1.contains(&code));
    match part {
        33 => has(0, 0x000D) && has(33, 0x0405),
        61 => has(0, 0x000D) && has(61, 0x2A23),
        _ => has(0, 0x2B00),
    }
}

#[test]
fn what_openjaus_asks_a_newcomer_is_answered_so_that_it_can_list_all_of_it() {
    let recorded = recorded("openjaus33-peer-wire.pcap", judp::PORT);
    let openjaus: IpAddr = [10, 77, 0, 1].into();
    let of_it = recorded.into_iter().filter(|it| it.from.ip() == openjaus);
    let of_it: Vec<_> = of_it.map(|it| (it.time, it.octets)).collect();
    let mut world = World::new(Settings::default());
    // Like the newcomer in the recording: a primitive driver and a knowledge store.
    let driver = Vehicle::new(Pilot::new(
        SkidSteer::new(SkidSteerConfig::default()),
        Frame::at(52.5, 13.4),
    ));
    let objects = world::World::on(InMemoryBackend::new()).unwrap();
    let store = WorldStore::new(objects, Frame::at(52.5, 13.4), |error| panic!("{error}"));
    let offers: Vec<Box<dyn Service>> = vec![
        Box::new(driver.primitive_driver()),
        Box::new(store.vector_knowledge_store()),
    ];
    world.add_jaus(stack(JausId::new(30, 1, 1), Kind::Vehicle, "Rover", offers));
    world.run(Duration::from_secs(5));
    replay(&mut world, &of_it);

    let said: Vec<Said> = world.sent.iter().map(read).collect();
    let questions = of_it.iter().map(|(_, octets)| read(octets));
    let questions = questions.filter(|it| it.code == 0x01F0 || (0x2000..0x3000).contains(&it.code));
    let mut asked = 0;
    for question in questions {
        asked += 1;
        assert!(
            said.iter().any(|it| is_of_use(&question, it)),
            "{question:?}"
        );
    }
    assert_eq!(asked, 12);
    // Its answers suffice to expose its components.
    assert_eq!(world.attached(), ["10.1.1", "10.1.35", "250.1.1"]);
}

/// A message between components of one host, readdressed as if it came over the network to our
/// vehicle.
fn to_our_vehicle(octets: &Bytes) -> Option<(Said, Bytes)> {
    let mut framed = BytesMut::from(&b"JAUS01.0"[..]);
    framed.extend_from_slice(octets);
    let said = read(&framed.clone().freeze());
    let client = RaId::new(10, 1, 45, 1);
    let meant = said.source == client && [33, 38, 42].contains(&said.destination.component);
    // The destination's instance, component, node and subsystem follow the eight octets of the
    // framing and four of the header.
    framed[12] = 7;
    framed[15] = 101;
    meant.then(|| (said, framed.freeze()))
}

#[test]
fn in_place_of_its_vehicle_openjaus_waypoint_driver_is_told_and_obeyed() {
    const TO_NODE_MANAGER: u16 = 24629;
    let recorded = recorded("openjaus33-opc-lo.pcap", TO_NODE_MANAGER);
    let to_manager = |it: &&Datagram| it.to.port() == TO_NODE_MANAGER;
    let mut asked: BTreeMap<u16, usize> = BTreeMap::new();
    let mut datagrams = Vec::new();
    for datagram in recorded.iter().filter(to_manager) {
        if let Some((said, octets)) = to_our_vehicle(&datagram.octets) {
            *asked.entry(said.code).or_default() += 1;
            datagrams.push((datagram.time, octets));
        }
    }
    let mut world = World::new(Settings::default());
    let rover = world.add_jaus(vehicle(JausId::new(101, 1, 7)));
    world.run(Duration::from_secs(5));
    replay(&mut world, &datagrams);
    let said: Vec<Said> = world.sent.iter().map(read).collect();
    let of_code = |code: u16| said.iter().filter(move |it| it.code == code);

    // The three reports and the status to which it connects.
    for report in [0x4402_u16, 0x4404, 0x4405] {
        let confirmed = of_code(0x0009)
            .filter(|it| it.data[..2] == report.to_le_bytes())
            .any(|it| it.data[5] == 0);
        assert!(confirmed, "{report:04X}h");
        assert!(of_code(report).count() > 100, "{report:04X}h");
    }
    // Control first, then its efforts.
    let accepted = of_code(0x000F).any(|it| it.data[..] == [0]);
    assert_eq!(accepted, asked.contains_key(&0x000D));
    let efforts = asked.get(&0x0405).copied().unwrap_or_default();
    assert!(efforts > 100, "{asked:?}");
    assert!(world.count(Counter::CommandsFromRa) as usize >= efforts);
    assert_eq!(
        world.count(Counter::NotConverted),
        0,
        "{:?}",
        world.gateway.counters()
    );
    assert!(world.jaus[rover].stack.standing().exclusive);
}
