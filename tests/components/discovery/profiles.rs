//! Discovery with peers that deviate from the standard.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::{Message, Text};
use jaus::endpoint::Received;
use jaus::messages::core::{
    QueryIdentification, QueryServices, RegisterServices, ReportIdentification, register_services,
};
use jaus::service::Change;

use crate::discovery::world::{Place, World, stack};

const OWN: JausId = JausId::new(101, 1, 33);
const PEER: JausId = JausId::new(152, 1, 1);

fn service(urn: &str) -> register_services::ServiceRec {
    register_services::ServiceRec {
        uri: Text::from(urn),
        major_version_number: 1,
        minor_version_number: 0,
    }
}

/// A component, and a peer that has queried its identification.
fn met() -> (World, Place, Place) {
    let mut world = World::new();
    let us = world.start(stack(OWN, "rover", Vec::new()));
    let peer = world.puppet(PEER);
    world.run(Duration::from_millis(100));
    let call = QueryIdentification {
        query_type: 2.into(),
    };
    world.say(peer, JausId::EVERYONE, &call);
    (world, us, peer)
}

/// JAUS++ answers a wildcard in Query Services with an empty list.
#[test]
fn services_are_asked_for_by_number_and_never_by_wildcard() {
    let (mut world, _, peer) = met();
    world.run(Duration::from_secs(20));
    let asked = world.received_as::<QueryServices>(peer);
    assert!(!asked.is_empty());
    for query in asked {
        let [node] = &query.node_list[..] else {
            panic!("one node: {query:?}")
        };
        let [component] = &node.component_list[..] else {
            panic!("one component: {query:?}")
        };
        assert_eq!((node.node_rec.node_id.0, component.component_id.0), (1, 1));
    }
}

/// JAUS++ registers with every component, every five seconds.
#[test]
fn a_registration_from_another_subsystem_is_learned_and_not_answered() {
    let (mut world, us, peer) = met();
    world.run(Duration::from_millis(200));
    world.received(peer);
    let registration = RegisterServices {
        service_list: vec![
            service("urn:jaus:jss:core:Events"),
            service("urn:jaus:jss:core:Time"),
        ],
    };
    for again in 0..3 {
        let datagrams = world.datagrams(us);
        world.say(peer, OWN, &registration);
        world.run(Duration::from_millis(20));
        assert_eq!(world.datagrams(us), datagrams, "nothing is answered");
        let news = world.changes(us).into_iter();
        let told = news.filter(|(_, change)| *change == Change::Services(PEER));
        assert_eq!(told.count(), usize::from(again == 0), "it is news once");
    }
    let directory = world.stack(us).directory();
    let known = directory.component(PEER).unwrap();
    assert_eq!(known.services.as_ref().map(|it| it.len()), Some(2));
}

/// JAUS++ sends no heartbeats: an answer to Query Identification is its sign of life. Multicasts
/// are omitted here, so only requested messages arrive.
#[test]
fn a_peer_that_only_answers_is_not_lost() {
    let (mut world, us, peer) = met();
    let mut asked = 0;
    for _tenth in 0..600 {
        world.run(Duration::from_millis(100));
        let to_it_alone = |it: &Received| it.destination == PEER;
        for question in world.received(peer).into_iter().filter(to_it_alone) {
            let Ok(query) = QueryIdentification::decode(&question.payload) else {
                continue;
            };
            asked += 1;
            let report = ReportIdentification {
                query_type: query.query_type.0.into(),
                r#type: 10_001.into(),
                identification: Text::from("Simulation"),
            };
            world.say(peer, OWN, &report);
        }
    }
    assert!((3..60).contains(&asked), "asked {asked} times in a minute");
    let lost = |(_, change): &(_, Change)| matches!(change, Change::Lost(..));
    assert!(!world.changes(us).iter().any(lost));
    assert!(world.stack(us).directory().component(PEER).is_some());
}

/// As recorded from the judging tool: messages for one component go to its whole node.
#[test]
fn a_question_to_a_whole_node_is_answered_by_unicast() {
    let (mut world, _, peer) = met();
    world.run(Duration::from_secs(1));
    world.received(peer);
    for (query, report) in [
        (&b"\x02\x22"[..], &b"\x02\x42"[..]),
        (b"\x00\x2B\x03", b"\x00\x4B\x03"),
        (b"\x03\x2B\x01\xFF\x01\xFF", b"\x03\x4B\x01\x01\x01\x21"),
    ] {
        world.say_octets(peer, OWN.whole_node(), Bytes::from_static(query));
        world.run(Duration::from_millis(20));
        let received = world.received(peer);
        let answers: Vec<_> = received
            .iter()
            .filter(|it| it.payload.starts_with(report))
            .collect();
        assert_eq!(answers.len(), 1, "{query:?}: {received:?}");
        assert_eq!((answers[0].source, answers[0].destination), (OWN, PEER));
    }
}
