//! Ids of the peers of a secure link, claimed on other links.

use super::*;

const SECURE: LinkId = LinkId(7);

fn by_session() -> Path {
    Path {
        link: SECURE,
        peer: Remote::Session(SessionId(1)),
    }
}

/// A rig with a plain link and a secure one, whose peer may use all ids of 42.
fn reserved(access: Access) -> Rig {
    let mut rig = Rig::with(Config {
        access,
        ..Config::default()
    });
    rig.endpoint.add_link(SECURE, LinkProfile::judp(None));
    rig.endpoint.reserve(SECURE, vec![id("42.255.255")]);
    rig
}

fn numbered(sequence: u16) -> Frame {
    Frame {
        sequence,
        ..from_peer(QUERY_HEARTBEAT)
    }
}

#[test]
fn an_id_of_a_peer_of_the_secure_link_is_believed_by_its_sessions_alone() {
    let mut rig = reserved(Access::default());
    rig.hear(&numbered(1));
    assert!(rig.is_silent());
    assert_eq!(rig.count(Counter::ReservedId), 1);
    let datagram = judp::encode(&numbered(2)).unwrap();
    rig.hear_datagram(by_session(), datagram);
    assert_eq!(rig.received().len(), 1);
    rig.hear(&Frame {
        sequence: 3,
        ..Frame::new(id("43.1.1"), US, Bytes::from_static(QUERY_HEARTBEAT))
    });
    assert_eq!(rig.received().len(), 1, "others are not concerned");
}

#[test]
fn a_relay_passes_no_forged_message_on() {
    let mut rig = Rig::with(Config {
        routing: Routing {
            forward: true,
            ..Routing::default()
        },
        ..Config::default()
    });
    rig.endpoint.add_link(SECURE, LinkProfile::judp(None));
    rig.endpoint.reserve(SECURE, vec![id("42.255.255")]);
    for destination in [id("102.1.1"), JausId::EVERYONE] {
        rig.hear(&Frame {
            destination,
            ..numbered(1)
        });
    }
    assert!(rig.received().is_empty() && rig.transmits().is_empty());
}

#[test]
fn a_route_from_before_the_reservation_is_forgotten() {
    let mut rig = Rig::new();
    rig.meet_peer();
    assert!(rig.endpoint.route(PEER).is_some());
    rig.endpoint.add_link(SECURE, LinkProfile::judp(None));
    rig.endpoint.reserve(SECURE, vec![PEER]);
    assert_eq!(rig.endpoint.route(PEER), None);
    rig.endpoint.remove_link(SECURE);
    rig.hear(&numbered(1));
    assert_eq!(rig.received().len(), 1);
}

#[test]
fn an_id_that_is_bound_to_a_network_is_believed_from_there() {
    let mut rig = reserved(Access {
        bind: vec!["42.1.1@10.0.0.0/24".parse().unwrap()],
        ..Access::default()
    });
    rig.hear(&numbered(1));
    assert_eq!(rig.received().len(), 1);
}
