//! Attached ids: attaching, echoes and id conflicts.

use super::*;

#[test]
fn only_an_id_of_one_component_can_be_attached_and_only_once() {
    let mut endpoint = Endpoint::new(Config {
        max_components: 2,
        ..Config::default()
    });
    for wrong in [
        "0.1.1",
        "101.0.1",
        "101.1.0",
        "65535.1.1",
        "101.255.1",
        "101.1.255",
    ] {
        assert_eq!(
            endpoint.attach(id(wrong)),
            Err(AttachError::NotOneComponent(id(wrong)))
        );
    }
    endpoint.attach(US).unwrap();
    assert_eq!(
        endpoint.attach(US).unwrap_err().to_string(),
        "101.1.1 is attached already: give each component its own id"
    );
    endpoint.attach(SIBLING).unwrap();
    assert_eq!(
        endpoint.attach(PEER).unwrap_err().to_string(),
        "the limit of 2 attached components is reached"
    );
    endpoint.detach(US);
    assert_eq!(endpoint.attach(PEER), Ok(()));
    assert_eq!(endpoint.components().collect::<Vec<_>>(), [PEER, SIBLING]);
}

/// Sends a broadcast and returns the datagram.
fn broadcast(rig: &mut Rig) -> Bytes {
    rig.send(Outgoing::new(
        US,
        JausId::EVERYONE,
        Bytes::from_static(QUERY_IDENTIFICATION),
    ))
    .unwrap();
    rig.transmits().remove(0).payload
}

#[test]
fn our_own_multicast_coming_back_is_dropped() {
    let mut rig = Rig::new();
    let datagram = broadcast(&mut rig);
    rig.hear_octets(OUR_HOST, datagram.clone());
    rig.hear_octets(OUR_HOST, datagram);
    assert_eq!(
        (rig.events(), rig.received(), rig.count(Counter::OwnEcho)),
        (vec![], vec![], 2)
    );
}

#[test]
fn our_own_multicast_is_known_when_its_sender_has_gone() {
    let mut rig = Rig::new();
    rig.endpoint.attach(SIBLING).unwrap();
    let datagram = broadcast(&mut rig);
    rig.endpoint.detach(US);
    let _ = (rig.events(), rig.received());
    rig.hear_octets(OUR_HOST, datagram);
    assert_eq!(
        (rig.events(), rig.received(), rig.count(Counter::OwnEcho)),
        (vec![], vec![], 1)
    );
}

#[test]
fn the_fragments_of_our_own_multicast_are_known_too() {
    let mut rig = Rig::new();
    rig.send(Outgoing::new(US, JausId::EVERYONE, vec![7; 3000].into()))
        .unwrap();
    let sent = rig.transmits();
    rig.endpoint.detach(US);
    assert_eq!(sent.len(), 3);
    for transmit in sent {
        rig.hear_octets(OUR_HOST, transmit.payload);
    }
    assert_eq!(rig.count(Counter::OwnEcho), 3);
}

#[test]
fn our_words_from_somebody_elses_address_are_an_id_conflict() {
    let mut rig = Rig::new();
    let datagram = broadcast(&mut rig);
    rig.hear_octets(PEER_HOST, datagram);
    assert_eq!(
        rig.events(),
        [Event::IdConflict {
            id: US,
            path: path(PEER_HOST)
        }]
    );
    assert_eq!(rig.count(Counter::IdConflict), 1);
}

#[test]
fn two_nodes_on_one_host_are_told_apart_by_what_they_say() {
    let mut rig = Rig::new();
    broadcast(&mut rig);
    rig.hear_from(
        OUR_HOST,
        &Frame {
            source: US,
            ..from_peer(QUERY_HEARTBEAT)
        },
    );
    assert_eq!(
        rig.events(),
        [Event::IdConflict {
            id: US,
            path: path(OUR_HOST)
        }]
    );
}

#[test]
fn without_addresses_of_our_own_the_content_tells_an_echo() {
    let mut rig = Rig::new();
    rig.endpoint.add_link(WIRE, LinkProfile::judp([]));
    let datagram = broadcast(&mut rig);
    rig.hear_octets(PEER_HOST, datagram);
    assert_eq!(
        (rig.events(), rig.received(), rig.count(Counter::OwnEcho)),
        (vec![], vec![], 1)
    );
}

#[test]
fn an_id_conflict_is_told_once_in_a_while_and_counted_each_time() {
    let mut rig = Rig::new();
    let conflict = Frame {
        source: US,
        ..from_peer(QUERY_HEARTBEAT)
    };
    for sequence in 0..10 {
        rig.hear(&Frame {
            sequence,
            ..conflict.clone()
        });
    }
    assert_eq!(
        (rig.events().len(), rig.count(Counter::IdConflict)),
        (1, 10)
    );
    rig.pass(Config::default().conflict_interval);
    rig.hear(&conflict);
    assert_eq!(rig.events().len(), 1);
}

#[test]
fn an_id_that_becomes_ours_is_no_peer_any_more() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.endpoint.attach(PEER).unwrap();
    assert_eq!(rig.endpoint.peers().count(), 0);
    rig.send(to_peer()).unwrap();
    assert_eq!(rig.received()[0].to, PEER);
}
