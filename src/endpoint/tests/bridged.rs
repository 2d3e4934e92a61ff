//! Ids of the other side of a bridge that components of this side have, too.

use super::*;
use crate::rights::Acceptance;

const BRIDGE: LinkId = LinkId(8);

fn abroad() -> Path {
    Path {
        link: BRIDGE,
        peer: Remote::Session(SessionId(1)),
    }
}

fn numbered(sequence: u16) -> Frame {
    Frame {
        sequence,
        ..from_peer(QUERY_HEARTBEAT)
    }
}

/// A rig with a plain link and a bridge whose other side has these rights; the peer is there, and has answered.
fn with_bridge(accept: Acceptance) -> Rig {
    let mut rig = Rig::with(Config {
        routing: Routing {
            forward: true,
            ..Routing::default()
        },
        ..Config::default()
    });
    let profile = LinkProfile {
        bridged: Some(accept),
        ..LinkProfile::default()
    };
    rig.endpoint.add_link(BRIDGE, profile);
    hear_abroad(&mut rig, 1);
    rig.vouch_for(PEER);
    rig.received();
    rig.events();
    rig.transmits();
    rig
}

fn hear_abroad(rig: &mut Rig, sequence: u16) {
    rig.hear_datagram(abroad(), judp::encode(&numbered(sequence)).unwrap());
}

#[test]
fn a_bridged_id_that_may_only_look_goes_to_the_component_of_this_side_at_once() {
    let mut rig = with_bridge(Acceptance::default());
    rig.hear(&numbered(500));
    assert_eq!(rig.received().len(), 1);
    let moved = Event::PeerMoved {
        id: PEER,
        from: abroad(),
        to: path(PEER_HOST),
    };
    assert!(rig.events().contains(&moved));
    assert_eq!(rig.endpoint.route(PEER).unwrap().0, path(PEER_HOST));
    for sequence in 2..50 {
        hear_abroad(&mut rig, sequence);
    }
    assert!(rig.received().is_empty());
    assert_eq!(rig.count(Counter::ReservedId), 48);
    rig.send(to_peer()).unwrap();
    assert!(rig.transmits().iter().all(|it| it.link == WIRE));
    rig.pass(ID_HELD);
    hear_abroad(&mut rig, 50);
    assert_eq!(rig.received().len(), 1, "the component is gone");
}

#[test]
fn a_broadcast_by_which_a_component_appears_is_passed_on_though_the_other_side_has_its_id() {
    let mut rig = with_bridge(Acceptance::default());
    rig.hear(&Frame {
        destination: JausId::EVERYONE,
        ..numbered(500)
    });
    assert!(rig.transmits().iter().any(|it| it.link == BRIDGE));
}

#[test]
fn a_copy_of_a_bridged_message_from_another_bridge_shows_no_component() {
    let mut rig = with_bridge(Acceptance::default());
    rig.hear(&numbered(1));
    assert_eq!(rig.endpoint.route(PEER).unwrap().0, abroad());
    hear_abroad(&mut rig, 2);
    assert_eq!(rig.received().len(), 1);
}

#[test]
fn an_id_with_rights_on_the_other_side_stays_there() {
    let accept = Acceptance::new(["42 control=127".parse().unwrap()]);
    let mut rig = with_bridge(accept);
    rig.hear(&numbered(500));
    assert_eq!(rig.endpoint.route(PEER).unwrap().0, abroad());
    hear_abroad(&mut rig, 2);
    assert_eq!(rig.count(Counter::ReservedId), 0);
}
