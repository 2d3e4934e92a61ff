//! Answers to the discovery queries of other stacks, octet by octet.
//!
//! The judging tool's requests are those of the competitions (body after the code, as in AS5710);
//! JAUS++'s are those of its `jaus_challenge_2010` and test client.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::Received;
use jaus::messages::core::{
    QueryServiceList, RegisterServices, ReportServiceList, ReportServices, query_service_list,
    register_services,
};
use jaus::wire::Broadcast;

use crate::discovery::world::{Place, World, stack};

const OWN: JausId = JausId::new(101, 1, 33);
const ASKER: JausId = JausId::new(42, 1, 1);

/// A component named "rover" and a client that queries it; the component's own queries are ignored.
fn asked(to: JausId, query: &[u8]) -> Vec<Received> {
    let mut world = World::new();
    world.start(stack(OWN, "rover", Vec::new()));
    let asker = world.puppet(ASKER);
    answers(&mut world, asker, to, query)
}

/// The received reports. Codes of queries begin with 0 or 2, those of reports with 4.
fn answers(world: &mut World, asker: Place, to: JausId, query: &[u8]) -> Vec<Received> {
    world.run(Duration::from_secs(1));
    world.received(asker);
    world.say_octets(asker, to, Bytes::copy_from_slice(query));
    world.run(Duration::from_millis(50));
    let received = world.received(asker).into_iter();
    received
        .filter(|message| message.payload[1] & 0xF0 == 0x40)
        .collect()
}

#[track_caller]
fn only(answers: &[Received]) -> &[u8] {
    let [answer] = answers else {
        panic!("one answer wanted: {answers:?}")
    };
    assert_eq!((answer.source, answer.destination), (OWN, ASKER));
    assert_eq!(answer.broadcast, Broadcast::None, "answers are unicast");
    &answer.payload
}

#[test]
fn every_level_is_identified_with_its_own_kind() {
    // Report Identification: level, kind (little-endian), length, name.
    for (level, kind) in [(1, 10001_u16), (2, 10001), (3, 40001), (4, 60001)] {
        for to in [
            OWN,
            JausId::EVERYONE,
            JausId::new(101, 1, 255),
            JausId::new(101, 255, 255),
        ] {
            let answers = asked(to, &[0x00, 0x2B, level]);
            let mut expected = vec![0x00, 0x4B, level];
            expected.extend(kind.to_le_bytes());
            expected.extend(b"\x05rover");
            assert_eq!(only(&answers), expected, "level {level} asked of {to}");
        }
    }
}

#[test]
fn a_level_that_does_not_exist_is_not_answered() {
    for level in [0, 5, 255] {
        assert_eq!(asked(OWN, &[0x00, 0x2B, level]), []);
    }
}

#[test]
fn the_configuration_of_subsystem_and_node_lists_the_component() {
    for level in [2, 3] {
        for to in [OWN, JausId::new(101, 1, 255)] {
            let answers = asked(to, &[0x01, 0x2B, level]);
            assert_eq!(
                only(&answers),
                [0x01, 0x4B, 1, 1, 1, 33, 0],
                "level {level} of {to}"
            );
        }
    }
}

#[test]
fn the_subsystem_list_names_the_component_to_ask() {
    let answers = asked(JausId::new(101, 1, 255), &[0x02, 0x2B]);
    let octets = only(&answers);
    assert_eq!(octets[..2], [0x02, 0x4B]);
    // The component's own subsystem: 101 in two octets, node 1, component 33.
    assert!(
        octets[3..].chunks(4).any(|entry| entry == [101, 0, 1, 33]),
        "{octets:?}"
    );
}

#[test]
fn services_are_listed_for_explicit_numbers_for_the_wildcard_and_for_an_empty_list() {
    let explicit: &[u8] = &[0x03, 0x2B, 1, 1, 1, 33];
    let judge: &[u8] = &[0x03, 0x2B, 1, 255, 1, 255];
    let everything: &[u8] = &[0x03, 0x2B, 0];
    for query in [explicit, judge, everything] {
        for to in [OWN, JausId::EVERYONE, JausId::new(101, 1, 255)] {
            let answers = asked(to, query);
            let report = ReportServices::decode(&Bytes::copy_from_slice(only(&answers))).unwrap();
            let [node] = &report.node_list[..] else {
                panic!("one node: {report:?}")
            };
            let [component] = &node.component_list[..] else {
                panic!("one component: {report:?}")
            };
            assert_eq!(node.node_rec.node_id, 1);
            assert_eq!(component.component_rec.component_id, 33);
            let services = component.service_list.iter();
            let uris: Vec<_> = services.map(|service| service.uri.to_string()).collect();
            for name in ["Transport", "Discovery", "Liveness"] {
                assert!(
                    uris.contains(&format!("urn:jaus:jss:core:{name}")),
                    "{uris:?}"
                );
            }
        }
    }
}

#[test]
fn services_of_somebody_else_are_not_invented() {
    let other: &[u8] = &[0x03, 0x2B, 1, 1, 1, 99];
    let answers = asked(OWN, other);
    assert_eq!(
        only(&answers),
        [0x03, 0x4B, 0],
        "asked alone: nothing is known"
    );
    assert_eq!(
        asked(JausId::EVERYONE, other),
        [],
        "asked with others: let them speak"
    );
}

#[test]
fn a_heartbeat_is_answered_alone_and_together() {
    for to in [OWN, JausId::new(101, 1, 255), JausId::EVERYONE] {
        assert_eq!(only(&asked(to, &[0x02, 0x22])), [0x02, 0x42]);
    }
}

#[test]
fn a_query_that_is_cut_short_or_too_long_is_not_answered() {
    for query in [
        &[0x00, 0x2B][..],
        &[0x00, 0x2B, 2, 0],
        &[0x03, 0x2B, 1, 1],
        &[0x01, 0x2B],
    ] {
        assert_eq!(asked(OWN, query), [], "{query:?}");
    }
}

#[test]
fn asked_alone_a_component_speaks_for_its_subsystem_and_together_for_itself() {
    let mut world = World::new();
    let sibling = JausId::new(101, 2, 7);
    world.start(stack(OWN, "rover", Vec::new()));
    world.start(stack(sibling, "rover", Vec::new()));
    let asker = world.puppet(ASKER);
    let listed = |answers: &[Received]| -> Vec<_> {
        let mut listed = Vec::new();
        for answer in answers {
            for node in ReportServices::decode(&answer.payload).unwrap().node_list {
                for component in node.component_list {
                    listed.push((node.node_rec.node_id, component.component_rec.component_id));
                }
            }
        }
        listed.sort_unstable();
        listed
    };
    world.run(Duration::from_secs(2));
    let alone = answers(&mut world, asker, OWN, &[0x03, 0x2B, 1, 255, 1, 255]);
    assert_eq!((alone.len(), listed(&alone)), (1, vec![(1, 33), (2, 7)]));
    let everybody = JausId::new(101, 255, 255);
    let together = answers(&mut world, asker, everybody, &[0x03, 0x2B, 1, 255, 1, 255]);
    assert_eq!(
        (together.len(), listed(&together)),
        (2, vec![(1, 33), (2, 7)])
    );
}

#[test]
fn a_long_list_of_services_is_cut_into_reports_of_one_packet() {
    let mut world = World::new();
    world.start(stack(OWN, "rover", Vec::new()));
    for node in 2..=12 {
        world.start(stack(
            JausId::new(101, node, 1),
            "part of the rover",
            Vec::new(),
        ));
    }
    let asker = world.puppet(ASKER);
    world.run(Duration::from_secs(60));
    let reports = answers(&mut world, asker, OWN, &[0x03, 0x2B, 0]);
    assert!(reports.len() > 1);
    assert!(reports.iter().all(|report| report.payload.len() <= 1400));
    let nodes = reports.iter().flat_map(|report| {
        ReportServices::decode(&report.payload)
            .unwrap()
            .node_list
            .into_iter()
    });
    let mut nodes: Vec<_> = nodes.map(|node| node.node_rec.node_id).collect();
    nodes.sort_unstable();
    assert_eq!(nodes, (1..=12).collect::<Vec<_>>(), "each once");
    let last = JausId::new(101, 12, 1);
    let reports = answers(&mut world, asker, last, &[0x03, 0x2B, 0]);
    let report = ReportServices::decode(&reports[0].payload).unwrap();
    let first = report.node_list[0].node_rec.node_id;
    assert_eq!(first, 12, "whom it asked comes first");
}

#[test]
fn the_service_list_of_1_1_is_filtered_by_text() {
    let component = query_service_list::ComponentRec {
        component_id: 255.into(),
        search_filter: Some("Liveness".into()),
    };
    let node = query_service_list::NodeSeq {
        node_rec: query_service_list::NodeRec {
            node_id: 255.into(),
        },
        component_list: vec![component],
    };
    let subsystem = query_service_list::SubsystemSeq {
        subsystem_rec: query_service_list::SubsystemRec {
            subsystem_id: 65535.into(),
        },
        node_list: vec![node],
    };
    let query = QueryServiceList {
        subsystem_list: vec![subsystem],
    }
    .encode()
    .unwrap();
    let answers = asked(OWN, &query);
    let report = ReportServiceList::decode(&Bytes::copy_from_slice(only(&answers))).unwrap();
    let services = &report.subsystem_list[0].node_list[0].component_list[0].service_list;
    let uris: Vec<_> = services
        .iter()
        .map(|service| service.uri.to_string())
        .collect();
    assert_eq!(uris, ["urn:jaus:jss:core:Liveness"; 2]);
}

/// JAUS++ registers its services with every component that identifies itself, and expects no
/// answer.
#[test]
fn registered_services_are_known_without_asking() {
    let mut world = World::new();
    let own = world.start(stack(OWN, "rover", Vec::new()));
    let asker = world.puppet(ASKER);
    let service = register_services::ServiceRec {
        uri: "urn:jaus:jss:jpp:extras:Example".into(),
        major_version_number: 1,
        minor_version_number: 0,
    };
    world.say(
        asker,
        OWN,
        &RegisterServices {
            service_list: vec![service],
        },
    );
    world.run(Duration::from_millis(50));
    let directory = world.stack(own).directory();
    assert!(
        directory
            .component(ASKER)
            .unwrap()
            .offers("urn:jaus:jss:jpp:extras:Example")
    );
}
