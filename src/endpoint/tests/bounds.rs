//! Bounds: peers and components cannot make an endpoint grow without limit; every drop is counted.

use super::*;

fn small() -> Config {
    Config {
        queue_limit: 4,
        limits: Limits {
            max_peers: 3,
            ..Limits::default()
        },
        max_recent: 8,
        max_unacknowledged: 2,
        max_paced: 3_000_000,
        ..Config::default()
    }
}

#[test]
fn a_full_table_of_peers_forgets_the_one_heard_longest_ago() {
    let mut rig = Rig::with(small());
    for component in [1, 2, 3, 1, 4] {
        let source = JausId::new(42, 1, component);
        rig.hear(&Frame {
            source,
            ..from_peer(QUERY_HEARTBEAT)
        });
        rig.pass(Duration::from_secs(1));
        let _ = rig.received();
    }
    let peers: Vec<_> = rig
        .endpoint
        .peers()
        .map(|peer| peer.id.to_string())
        .collect();
    assert_eq!(peers, ["42.1.1", "42.1.3", "42.1.4"]);
    assert_eq!(rig.count(Counter::PeersEvicted), 1);
}

#[test]
fn a_forgotten_peer_is_told_and_reached_through_the_group() {
    let mut rig = Rig::with(Config {
        limits: Limits {
            max_peers: 1,
            ..Limits::default()
        },
        ..Config::default()
    });
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    rig.events();
    rig.hear(&Frame {
        source: id("42.1.2"),
        ..from_peer(QUERY_HEARTBEAT)
    });
    assert_eq!(rig.events()[0], Event::PeerForgotten { id: PEER });
    rig.send(to_peer()).unwrap();
    assert_eq!(rig.sent()[0].0, To::Group);
}

#[test]
fn datagrams_that_nobody_polls_are_refused() {
    let mut rig = Rig::with(small());
    rig.meet_peer();
    for _message in 0..4 {
        rig.send(to_peer()).unwrap();
    }
    assert_eq!(
        rig.send(to_peer()).unwrap_err().to_string(),
        "the limit of 4 queued messages of this priority is reached"
    );
    assert_eq!(
        (rig.transmits().len(), rig.count(Counter::TransmitQueueFull)),
        (4, 1)
    );
    let large = |length| Outgoing {
        payload: vec![0; length].into(),
        ..to_peer()
    };
    rig.send(large(2_000_000)).unwrap();
    assert_eq!(
        rig.send(large(2_000_000)),
        Err(SendError::TooMuchQueued { limit: 3_000_000 })
    );
}

#[test]
fn news_that_nobody_polls_is_dropped_and_counted() {
    let mut rig = Rig::with(Config {
        limits: Limits {
            max_peers: 100,
            ..Limits::default()
        },
        ..small()
    });
    for component in 1..=10 {
        let source = JausId::new(42, 1, component);
        rig.hear(&Frame {
            source,
            ..from_peer(QUERY_HEARTBEAT)
        });
    }
    assert_eq!(
        (
            rig.endpoint.peers().count(),
            rig.count(Counter::NewsQueueFull)
        ),
        (10, 6)
    );
}

#[test]
fn only_so_many_messages_wait_for_acknowledgements() {
    let mut rig = Rig::with(small());
    rig.meet_peer();
    let message = Outgoing {
        acknowledge: true,
        ..to_peer()
    };
    rig.send(message.clone()).unwrap();
    rig.send(message.clone()).unwrap();
    assert_eq!(
        rig.send(message),
        Err(SendError::TooManyUnacknowledged { limit: 2 })
    );
}

#[test]
fn results_count_as_waiting_messages_until_they_are_polled_and_not_as_news() {
    let mut rig = Rig::with(Config {
        limits: Limits::default(),
        max_unacknowledged_octets: 1000,
        ..small()
    });
    rig.meet_peer();
    let message = |length| Outgoing {
        acknowledge: true,
        ..Outgoing::new(US, PEER, vec![7; length].into())
    };
    rig.send(message(600)).unwrap();
    let too_much = Err(SendError::TooMuchUnacknowledged { limit: 1000 });
    assert_eq!(rig.send(message(401)), too_much);
    rig.send(message(400)).unwrap();
    for (_, frame) in rig.sent() {
        let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
        rig.hear(&Frame {
            flags,
            sequence: frame.sequence,
            ..Frame::new(PEER, US, Bytes::new())
        });
    }
    let too_many = Err(SendError::TooManyUnacknowledged { limit: 2 });
    assert_eq!(rig.send(message(2)), too_many);
    for (component, dropped) in [(2, 0), (3, 0), (4, 0), (5, 0), (6, 1)] {
        let source = JausId::new(42, 1, component);
        rig.hear(&Frame {
            source,
            ..from_peer(QUERY_HEARTBEAT)
        });
        assert_eq!(rig.count(Counter::NewsQueueFull), dropped);
    }
    assert_eq!(rig.events().len(), 2 + 4);
    assert!(rig.send(message(1001)).is_ok(), "no other waits");
}

#[test]
fn counters_are_listed_by_name_and_only_if_something_happened() {
    let mut rig = Rig::new();
    assert_eq!(rig.endpoint.counters().to_string(), "");
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    assert_eq!(
        rig.endpoint.counters().to_string(),
        "         1  datagrams received\n         1  messages received\n         1  messages delivered\n"
    );
    assert_eq!(rig.endpoint.counters().iter().count(), Counter::ALL.len());
}

#[test]
fn a_broadcast_that_asks_for_an_acknowledgement_reaches_those_who_have_room() {
    let mut rig = Rig::new();
    rig.endpoint.attach(SIBLING).unwrap();
    rig.inbox.full.push(SIBLING);
    let ask = Flags::default().with_acknowledgement(Acknowledgement::Request);
    rig.hear(&Frame {
        flags: ask,
        destination: JausId::EVERYONE,
        ..from_peer(QUERY_HEARTBEAT)
    });
    assert!(rig.received().iter().any(|message| message.to == US));
    assert_eq!(rig.transmits(), []);
}

#[test]
fn an_acknowledged_message_to_a_sibling_without_room_is_refused() {
    let mut rig = Rig::new();
    rig.endpoint.attach(SIBLING).unwrap();
    rig.inbox.full.push(SIBLING);
    let message = Outgoing {
        acknowledge: true,
        ..Outgoing::new(US, SIBLING, Bytes::from_static(QUERY_HEARTBEAT))
    };
    let refused = rig.send(message.clone());
    assert_eq!(refused, Err(SendError::ReceiverFull(SIBLING)));
    assert!(rig.is_silent());
    rig.inbox.full.clear();
    assert!(rig.send(message).is_ok());
    assert_eq!(rig.received().len(), 1);
}

#[test]
fn without_pacing_destinations_are_forgotten_too() {
    let mut rig = Rig::with(Config {
        pacing: None,
        ..Config::default()
    });
    for number in 1..=200_u8 {
        let source = JausId::new(300, 1, number);
        rig.hear_from(
            number,
            &Frame {
                source,
                ..from_peer(QUERY_HEARTBEAT)
            },
        );
        rig.vouch_for(source);
        rig.send(Outgoing::new(US, source, vec![1; 5000].into()))
            .unwrap();
        assert_eq!(rig.transmits().len(), 4);
    }
    assert!(rig.endpoint.egress.queues.known.len() <= 128);
}

#[test]
fn each_priority_has_room_of_its_own_and_what_was_sent_takes_none() {
    let mut rig = Rig::with(small());
    rig.meet_peer();
    for _time in 0..2 {
        for priority in [Priority::Standard, Priority::High] {
            let message = Outgoing {
                priority,
                ..to_peer()
            };
            for _message in 0..4 {
                rig.send(message.clone()).unwrap();
            }
            let full = Err(SendError::QueueFull { limit: 4 });
            assert_eq!(rig.send(message), full);
        }
        assert_eq!(rig.transmits().len(), 8);
    }
}

#[test]
fn fragments_that_wait_have_room_for_the_longest_message_or_up_to_their_limit() {
    let mut rig = Rig::with(Config {
        payload_limit: 100,
        max_paced: 3000,
        ..Config::default()
    });
    rig.meet_peer();
    let message = |length| Outgoing {
        payload: vec![7; length].into(),
        ..to_peer()
    };
    let full = Err(SendError::TooMuchQueued { limit: 3000 });
    for lengths in [[2000, 1000], [1500, 1500]] {
        for length in lengths {
            rig.send(message(length)).unwrap();
        }
        assert_eq!(rig.send(message(101)), full);
        assert_eq!(rig.transmits().len(), 30);
    }
    rig.send(message(5000)).unwrap();
    assert_eq!(rig.send(message(101)), full);
}

#[test]
fn fragments_for_several_links_count_for_each() {
    let mut rig = Rig::with(Config {
        payload_limit: 100,
        max_paced: 6500,
        ..Config::default()
    });
    let second = LinkProfile::judp(path(OUR_HOST).peer.socket());
    rig.endpoint.add_link(LinkId(1), second);
    let message = Outgoing::new(US, JausId::EVERYONE, vec![7; 2000].into());
    rig.send(message.clone()).unwrap();
    assert_eq!(
        rig.send(message.clone()),
        Err(SendError::TooMuchQueued { limit: 6500 })
    );
    rig.endpoint.remove_link(LinkId(1));
    assert_eq!(rig.count(Counter::LinkGone), 20);
    rig.send(message).unwrap();
    assert_eq!(rig.transmits().len(), 2 * 20);
}

#[test]
fn the_longest_message_is_as_long_as_configured() {
    let mut rig = Rig::with(Config {
        max_message: 3000,
        ..Config::default()
    });
    rig.meet_peer();
    let message = |length| Outgoing::new(US, PEER, vec![7; length].into());
    assert!(rig.send(message(3000)).is_ok());
    let (length, limit) = (3001, 3000);
    assert_eq!(
        rig.send(message(3001)),
        Err(SendError::TooLong { length, limit })
    );
}

#[test]
fn a_new_destination_takes_the_place_of_the_one_idle_for_longest() {
    let mut rig = Rig::with(Config {
        max_flows: 2,
        ..Config::default()
    });
    let peers = [1, 2, 3].map(|component| JausId::new(42, 1, component));
    for (host, source) in (20..).zip(peers) {
        let heard = from_peer(QUERY_HEARTBEAT);
        rig.hear_from(host, &Frame { source, ..heard });
        rig.vouch_for(source);
    }
    let message = |destination| Outgoing {
        acknowledge: true,
        destination,
        ..to_peer()
    };
    let full = Err(SendError::TooManyDestinations { limit: 2 });
    let flows = |rig: &Rig| peers.map(|id| rig.endpoint.flow(id).map(|it| it.messages));
    rig.send(message(peers[0])).unwrap();
    rig.now += Duration::from_millis(1);
    rig.send(message(peers[1])).unwrap();
    assert_eq!(rig.send(message(peers[2])), full);
    assert!(rig.send(message(peers[0])).is_ok(), "it has a place");
    for (_, frame) in rig.sent().into_iter().rev() {
        rig.now += Duration::from_millis(1);
        let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
        let host = 19 + frame.destination.component();
        let answer = Frame {
            flags,
            sequence: frame.sequence,
            ..Frame::new(frame.destination, US, Bytes::new())
        };
        rig.hear_from(host, &answer);
    }
    assert_eq!(flows(&rig), [Some(0), Some(0), None]);
    rig.send(message(peers[2])).unwrap();
    assert_eq!(flows(&rig), [Some(0), None, Some(1)]);
    rig.send(message(peers[1])).unwrap();
    assert_eq!(flows(&rig), [None, Some(1), Some(1)]);
}

#[test]
fn of_a_detached_component_all_messages_end_and_those_of_others_stay() {
    let mut rig = Rig::with(small());
    rig.endpoint.attach(SIBLING).unwrap();
    rig.meet_peer();
    for source in [US, SIBLING] {
        let message = Outgoing {
            acknowledge: true,
            source,
            ..to_peer()
        };
        rig.send(message).unwrap();
    }
    rig.endpoint.detach(SIBLING);
    assert_eq!(rig.count(Counter::MessagesGivenUp), 1);
    assert_eq!(rig.endpoint.flow(PEER).unwrap().messages, 1);
    let message = Outgoing {
        acknowledge: true,
        ..to_peer()
    };
    assert!(rig.send(message.clone()).is_ok());
    let limit = 2;
    assert_eq!(
        rig.send(message),
        Err(SendError::TooManyUnacknowledged { limit })
    );
}
