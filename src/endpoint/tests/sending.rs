//! Destinations of messages: local components, known addresses, the group.

use super::*;

#[test]
fn a_message_to_an_unknown_id_goes_to_the_group_until_the_answer_teaches_the_address() {
    let mut rig = Rig::new();
    rig.send(to_peer()).unwrap();
    let sent = rig.sent();
    let (to, frame) = &sent[0];
    assert_eq!((sent.len(), *to), (1, To::Group));
    assert_eq!((frame.source, frame.destination), (US, PEER));
    assert_eq!(frame.flags.broadcast(), Some(Broadcast::Global));
    assert_eq!(frame.flags.acknowledgement(), Acknowledgement::Request);

    let answer = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    rig.hear(&Frame {
        flags: answer,
        payload: Bytes::new(),
        sequence: frame.sequence,
        ..from_peer(b"")
    });
    let learned = Event::PeerLearned {
        id: PEER,
        path: path(PEER_HOST),
        version: Version::As5669a,
    };
    assert_eq!(rig.events(), [learned]);

    rig.send(to_peer()).unwrap();
    let sent = rig.sent();
    assert_eq!((sent.len(), sent[0].0), (1, To::Peer(path(PEER_HOST).peer)));
    assert_eq!(sent[0].1.flags, Flags::default());
}

#[test]
fn a_call_of_an_unknown_id_is_not_repeated() {
    let mut rig = Rig::new();
    rig.send(to_peer()).unwrap();
    assert_eq!(
        (rig.transmits().len(), rig.endpoint.poll_timeout()),
        (1, None)
    );
    assert_eq!(rig.endpoint.flow(PEER), None);
}

#[test]
fn a_message_goes_to_the_group_of_every_link() {
    let mut rig = Rig::new();
    rig.endpoint.add_link(LinkId(7), LinkProfile::judp([]));
    rig.send(Outgoing::new(
        US,
        JausId::EVERYONE,
        Bytes::from_static(QUERY_IDENTIFICATION),
    ))
    .unwrap();
    let links: Vec<_> = rig
        .transmits()
        .iter()
        .map(|transmit| (transmit.link, transmit.to))
        .collect();
    assert_eq!(links, [(WIRE, To::Group), (LinkId(7), To::Group)]);
}

#[test]
fn a_peer_that_moves_and_answers_no_challenge_is_answered_where_it_is_after_the_last() {
    let mut rig = Rig::new();
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    rig.events();
    rig.hear_from(9, &from_peer(QUERY_IDENTIFICATION));
    for _try in 0..3 {
        assert!(!rig.events().contains(&moved()));
        rig.pass(Duration::from_millis(300));
    }
    assert!(rig.events().contains(&moved()));
    rig.send(to_peer()).unwrap();
    assert_eq!(rig.sent().pop().unwrap().0, To::Peer(path(9).peer));
}

fn moved() -> Event {
    Event::PeerMoved {
        id: PEER,
        from: path(PEER_HOST),
        to: path(9),
    }
}

#[test]
fn a_destination_with_wildcards_goes_to_siblings_and_to_the_group_but_not_to_the_sender() {
    let mut rig = Rig::new();
    rig.endpoint.attach(SIBLING).unwrap();
    rig.send(Outgoing::new(
        US,
        id("101.1.255"),
        Bytes::from_static(QUERY_IDENTIFICATION),
    ))
    .unwrap();
    let received = rig.received();
    assert_eq!(
        (received.len(), received[0].to, received[0].path),
        (1, SIBLING, None)
    );
    assert_eq!(received[0].broadcast, Broadcast::Global);
    let sent = rig.sent();
    assert_eq!((sent.len(), sent[0].0), (1, To::Group));
    assert_eq!(
        sent[0].1.flags,
        Flags::default().with_broadcast(Broadcast::Global)
    );
}

#[test]
fn a_local_broadcast_reaches_only_siblings_of_the_same_subsystem() {
    let mut rig = Rig::new();
    rig.endpoint.attach(SIBLING).unwrap();
    rig.endpoint.attach(id("102.1.1")).unwrap();
    let message = Outgoing {
        broadcast: Broadcast::Local,
        ..Outgoing::new(
            US,
            JausId::EVERYONE,
            Bytes::from_static(QUERY_IDENTIFICATION),
        )
    };
    rig.send(message.clone()).unwrap();
    let reached: Vec<_> = rig.received().iter().map(|received| received.to).collect();
    assert_eq!(reached, [SIBLING]);
    assert_eq!(rig.sent()[0].1.flags.broadcast(), Some(Broadcast::Local));
    let elsewhere = Outgoing {
        destination: id("102.255.255"),
        ..message
    };
    let error = rig.send(elsewhere).unwrap_err();
    assert_eq!(
        error.to_string(),
        "a local broadcast stays in the sender's subsystem and cannot go to 102.255.255"
    );
}

#[test]
fn siblings_talk_without_a_link() {
    let mut endpoint = Endpoint::new(Config::default());
    let now = Rig::new().now;
    endpoint.attach(US).unwrap();
    endpoint.attach(SIBLING).unwrap();
    let message = Outgoing {
        acknowledge: true,
        priority: Priority::High,
        ..Outgoing::new(US, SIBLING, Bytes::from_static(QUERY_HEARTBEAT))
    };
    let mut received = Vec::new();
    let handle = endpoint.send(now, message, &mut received).unwrap();
    assert_eq!(
        endpoint.poll_event(),
        Some(Event::Acknowledged {
            message: handle,
            by: SIBLING
        })
    );
    assert_eq!(
        (received[0].source, received[0].to, received[0].priority),
        (US, SIBLING, Priority::High)
    );
    assert_eq!(endpoint.poll_transmit(now), None);
    let stranger = Outgoing::new(US, PEER, Bytes::from_static(QUERY_HEARTBEAT));
    let sent = endpoint.send(now, stranger, &mut received);
    assert_eq!(sent, Err(SendError::NoLink(PEER)));
}

#[test]
fn a_message_to_oneself_is_delivered() {
    let mut rig = Rig::new();
    rig.send(Outgoing::new(US, US, Bytes::from_static(QUERY_HEARTBEAT)))
        .unwrap();
    assert_eq!(rig.received()[0].to, US);
    assert_eq!(rig.transmits(), []);
}

#[test]
fn a_peer_with_an_older_header_is_answered_with_it() {
    let mut rig = Rig::new();
    rig.hear(&Frame {
        version: Version::As5669,
        ..from_peer(QUERY_HEARTBEAT)
    });
    rig.send(to_peer()).unwrap();
    let (_, frame) = &rig.sent()[0];
    assert_eq!(
        (frame.version, frame.code()),
        (Version::As5669, Some(0x2B00))
    );
}

#[test]
fn a_static_peer_is_reached_where_it_is_configured_to_be() {
    let known = StaticPeer {
        id: PEER,
        path: path(50),
        gets_broadcasts: false,
    };
    let gateway = StaticPeer {
        id: id("65535.255.255"),
        path: path(60),
        gets_broadcasts: true,
    };
    let mut rig = Rig::with(Config {
        static_peers: vec![gateway, known],
        ..Config::default()
    });
    rig.meet_peer();
    let mut reached = |destination| {
        rig.send(Outgoing::new(
            US,
            destination,
            Bytes::from_static(QUERY_HEARTBEAT),
        ))
        .unwrap();
        rig.transmits()
            .iter()
            .map(|transmit| transmit.to)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        reached(PEER),
        [To::Peer(path(50).peer)],
        "not where it was heard"
    );
    assert_eq!(
        reached(id("7.1.1")),
        [To::Peer(path(60).peer)],
        "the pattern is for everyone else"
    );
    assert_eq!(
        reached(JausId::EVERYONE),
        [To::Group, To::Peer(path(60).peer)]
    );
}

#[test]
fn replaced_static_peers_are_those_that_are_reached() {
    let at = |host| StaticPeer {
        id: PEER,
        path: path(host),
        gets_broadcasts: true,
    };
    let mut rig = Rig::with(Config {
        static_peers: vec![at(50)],
        ..Config::default()
    });
    rig.endpoint.set_static_peers(vec![at(51)]);
    rig.send(to_peer()).unwrap();
    assert_eq!(rig.sent()[0].0, To::Peer(path(51).peer));
    rig.endpoint.set_static_peers(Vec::new());
    rig.send(to_peer()).unwrap();
    assert_eq!(rig.sent()[0].0, To::Group);
}

#[test]
fn a_static_peer_gets_only_the_broadcasts_that_match_it() {
    let known = StaticPeer {
        id: PEER,
        path: path(50),
        gets_broadcasts: true,
    };
    let mut rig = Rig::with(Config {
        static_peers: vec![known],
        ..Config::default()
    });
    for (destination, copies) in [
        ("42.255.255", 1),
        ("65535.1.255", 1),
        ("42.2.255", 0),
        ("43.255.255", 0),
    ] {
        rig.send(Outgoing::new(
            US,
            id(destination),
            Bytes::from_static(QUERY_HEARTBEAT),
        ))
        .unwrap();
        assert_eq!(rig.transmits().len(), 1 + copies, "{destination}");
    }
}

#[test]
fn a_message_that_cannot_be_sent_is_told_why() {
    let mut rig = Rig::new();
    let error = |rig: &mut Rig, message| rig.send(message).unwrap_err().to_string();
    let message = to_peer();
    assert_eq!(
        error(
            &mut rig,
            Outgoing {
                source: SIBLING,
                ..message.clone()
            }
        ),
        "101.1.2 is not attached here, so it cannot send"
    );
    assert_eq!(
        error(
            &mut rig,
            Outgoing {
                destination: id("42.0.1"),
                ..message.clone()
            }
        ),
        "42.0.1 is not a valid destination: subsystem, node and component start at 1"
    );
    assert_eq!(
        error(
            &mut rig,
            Outgoing {
                payload: Bytes::from_static(b"\x00"),
                ..message
            }
        ),
        "a message starts with two code octets, but this one has 1 octets"
    );
    assert_eq!(
        error(
            &mut rig,
            Outgoing {
                destination: JausId::EVERYONE,
                acknowledge: true,
                ..message.clone()
            }
        ),
        "65535.255.255 is not a single component, and only messages to one component can be \
         acknowledged"
    );
    assert_eq!(
        error(
            &mut rig,
            Outgoing {
                payload: vec![0; (16 << 20) + 1].into(),
                ..message
            }
        ),
        "the message has 16777217 octets, but the limit for this receiver is 16777216"
    );
    assert_eq!(
        (rig.transmits(), rig.count(Counter::MessagesSent)),
        (vec![], 0)
    );
}

#[test]
fn the_most_urgent_datagram_is_sent_first() {
    let mut rig = Rig::new();
    rig.meet_peer();
    for priority in [
        Priority::Standard,
        Priority::Low,
        Priority::SafetyCritical,
        Priority::High,
    ] {
        rig.send(Outgoing {
            priority,
            ..to_peer()
        })
        .unwrap();
    }
    let order: Vec<_> = rig
        .sent()
        .iter()
        .map(|(_, frame)| frame.flags.priority())
        .collect();
    assert_eq!(
        order,
        [
            Priority::SafetyCritical,
            Priority::High,
            Priority::Standard,
            Priority::Low
        ]
    );
}

#[test]
fn sequence_numbers_follow_each_other_and_leave_out_zero() {
    let mut rig = Rig::with(Config {
        first_sequence: 65_533,
        ..Config::default()
    });
    rig.meet_peer();
    for _message in 0..4 {
        rig.send(to_peer()).unwrap();
    }
    let numbers: Vec<_> = rig.sent().iter().map(|(_, frame)| frame.sequence).collect();
    assert_eq!(numbers, [65_534, 65_535, 1, 2]);
}
