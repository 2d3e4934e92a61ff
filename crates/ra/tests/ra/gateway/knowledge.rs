//! Knowledge stores on both sides, and messages larger than one datagram.

use std::time::Duration;

use bytes::{BufMut, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::service::{Event, Kind, Question};
use jaus_ra::gateway::Settings;
use jaus_ra::{Message, RaId};
use jaus_vehicle::ground::WorldStore;
use jaus_vehicle::messages::ground::{QueryVksBounds, ReportVksBounds};
use jaus_vehicle::motion::Frame;
use jaus_vehicle::world;
use redb::backends::InMemoryBackend;

use crate::gateway::world::{COMMANDER, World, stack, subsystem};

const JAUS_STORE: JausId = JausId::new(101, 1, 9);
const RA_STORE: RaId = RaId::new(101, 1, 61, 9);
const OPERATOR: RaId = RaId::new(30, 1, 32, 1);

/// Create VKS Objects with this number of points, with confirmation requested.
fn create(points: u16) -> Bytes {
    let mut data = BytesMut::new();
    data.put_slice(&[0, 1, 77]);
    data.put_u16_le(points);
    for point in 0..points {
        // A point without a class, on a line to the north-east.
        data.put_slice(&[0, 0, 1, 0]);
        data.put_u32_le(0x9000_0000 + u32::from(point));
        data.put_u32_le(0x8000_0000 + u32::from(point));
    }
    data.freeze()
}

#[test]
fn an_ra_client_fills_a_jaus_store_and_reads_it_in_messages_of_many_datagrams() {
    let mut world = World::new(Settings::default());
    let ra = world.add_ra(subsystem(30, "OCU", &[(32, 1, "Commander")]), None);
    let objects = world::World::on(InMemoryBackend::new()).unwrap();
    let store = WorldStore::new(objects, Frame::at(52.5, 13.4), |error| panic!("{error}"));
    let store = store.vector_knowledge_store();
    let services: Vec<Box<dyn jaus::service::Service>> = vec![Box::new(store)];
    world.add_jaus(stack(JAUS_STORE, Kind::Vehicle, "Store", services));
    world.run(Duration::from_secs(10));

    let points: u16 = 2000;
    let create = create(points);
    assert!(create.len() > 20_000);
    world.ra_says(ra, &Message::new(OPERATOR, RA_STORE, 0x0A20, create));
    world.run(Duration::from_secs(5));
    let told = world.ra_heard(ra, 0x4A20);
    assert_eq!(told.len(), 1);
    let count = u16::from_le_bytes([told[0].data[1], told[0].data[2]]);
    assert_eq!((told[0].data[0], count), (77, points));
    assert_eq!(told[0].source, RA_STORE);

    // All objects with their data.
    let query = Bytes::from_static(&[0, 1, 78]);
    world.ra_says(ra, &Message::new(OPERATOR, RA_STORE, 0x2A23, query));
    world.run(Duration::from_secs(5));
    let told = world.ra_heard(ra, 0x4A23);
    let octets: usize = told.iter().map(|it| it.data.len()).sum();
    assert!(octets > 20_000, "{told:?}");
}

#[test]
fn a_jaus_client_uses_an_ra_store() {
    let mut world = World::new(Settings::default());
    let ra = world.add_ra(subsystem(20, "Sim", &[(61, 1, "Store")]), None);
    let operator = world.add_operator();
    world.run(Duration::from_secs(10));
    let (ra_store, store) = (RaId::new(20, 1, 61, 1), JausId::new(20, 1, 61));

    // The operator sends a large message; the answer reaches the operator.
    let mut payload = BytesMut::from(&[0x20, 0x0A][..]);
    payload.put_slice(&create(1000));
    let stack = &mut world.jaus[operator].stack;
    stack.send_octets(store, payload.freeze());
    world.settle();
    let heard = world.ra_heard(ra, 0x0A20);
    assert_eq!(heard[0].data, create(1000));
    assert_eq!(
        (heard[0].source, heard[0].destination),
        (COMMANDER, ra_store)
    );
    let mut answer = BytesMut::from(&[77, 2, 0][..]);
    answer.put_slice(&[1, 0, 0, 0, 2, 0, 0, 0]);
    world.ra_says(ra, &heard[0].answer(0x4A20, answer.freeze()));
    let told = |world: &World| {
        let events = world.jaus[operator].events.iter();
        let told = events.filter_map(|event| match event {
            Event::Message(message) => Some((message.source, message.payload.clone())),
            _ => None,
        });
        told.last()
    };
    let (from, payload) = told(&world).unwrap();
    assert_eq!((from, &payload[..2]), (store, &[0x20, 0x4A][..]));

    // A query by the operator.
    let query = QueryVksBounds {
        request_id: 5,
        feature_class_id: 65535,
    };
    let stack = &mut world.jaus[operator].stack;
    let patience = jaus::service::Patience::default();
    let payload = query.encode().unwrap();
    let (now, code) = (world.now, ReportVksBounds::CODE);
    let inquiry = stack.ask(now, store, Question::new(payload, code), patience);
    world.settle();
    let heard = world.ra_heard(ra, 0x2A22);
    let bounds = Bytes::from_static(&[
        5, 0xFF, 0xFF, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0,
    ]);
    world.ra_says(ra, &heard[0].answer(0x4A22, bounds));
    let answered = world.jaus[operator]
        .events
        .iter()
        .any(|event| matches!(event, Event::Answer(it, Ok(_)) if *it == inquiry));
    assert!(answered);
}
