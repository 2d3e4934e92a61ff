//! Routes of peers: verification, refusals, and the budget for unverified addresses.

use super::*;

const ELSEWHERE: u8 = 66;

fn again(sequence: u16) -> Frame {
    Frame {
        sequence,
        ..from_peer(QUERY_HEARTBEAT)
    }
}

fn acknowledgement_of(query: &Frame) -> Frame {
    let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    Frame {
        flags,
        sequence: query.sequence,
        ..Frame::new(query.destination, query.source, Bytes::new())
    }
}

/// The challenge sent to a host.
fn challenge_to(sent: &[(To, Frame)], host: u8) -> &Frame {
    let is_it = |(to, frame): &&(To, Frame)| {
        *to == To::Peer(path(host).peer)
            && frame.flags.acknowledgement() == Acknowledgement::Request
    };
    &sent.iter().find(is_it).unwrap().1
}

/// The address to which the next message to [`PEER`] goes.
fn destination(rig: &mut Rig) -> To {
    rig.send(to_peer()).unwrap();
    rig.sent().pop().unwrap().0
}

fn at(host: u8) -> To {
    To::Peer(path(host).peer)
}

#[test]
fn a_peer_is_a_stranger_until_we_have_sent_it_something() {
    let mut rig = Rig::new();
    assert!(rig.endpoint.peers.is_stranger(PEER));
    rig.hear(&again(1));
    assert!(rig.endpoint.peers.is_stranger(PEER));
    rig.send(to_peer()).unwrap();
    assert!(!rig.endpoint.peers.is_stranger(PEER));
}

#[test]
fn a_connection_that_has_closed_takes_the_routes_through_it_along() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let source = id("42.1.2");
    rig.hear_from(ELSEWHERE, &Frame { source, ..again(1) });
    rig.endpoint.forget_path(path(PEER_HOST));
    let peers: Vec<_> = rig.endpoint.peers().map(|peer| peer.id).collect();
    assert_eq!(peers, [source]);
    assert_eq!(destination(&mut rig), To::Group);
}

#[test]
fn a_forged_sender_steals_nothing_from_a_peer_that_answers() {
    let mut rig = Rig::new();
    rig.meet_peer();
    for number in 1000..1100 {
        rig.hear_from(ELSEWHERE, &again(number));
        for (to, frame) in rig.sent() {
            // The forger has an address of its own, and answers too.
            let host = if to == at(ELSEWHERE) {
                ELSEWHERE
            } else {
                PEER_HOST
            };
            rig.hear_from(host, &acknowledgement_of(&frame));
        }
        assert_eq!(destination(&mut rig), at(PEER_HOST));
        rig.pass(Duration::from_millis(100));
    }
    let moved = |event: &Event| matches!(event, Event::PeerMoved { .. });
    let conflict = Event::PeerConflict {
        id: PEER,
        path: path(PEER_HOST),
        other: path(ELSEWHERE),
    };
    let events = rig.events();
    assert!(!events.iter().any(moved) && events.contains(&conflict));
    assert!(rig.count(Counter::ChallengesSent) < 20, "at a bounded rate");
}

#[test]
fn only_where_a_peer_has_proven_to_be_can_it_acknowledge() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let message = Outgoing {
        acknowledge: true,
        ..to_peer()
    };
    rig.send(message).unwrap();
    let (_, sent) = rig.sent().pop().unwrap();
    let acknowledged = |rig: &mut Rig| {
        let is_it = |event: &Event| matches!(event, Event::Acknowledged { .. });
        rig.events().iter().any(is_it)
    };
    rig.hear_from(ELSEWHERE, &acknowledgement_of(&sent));
    assert!(!acknowledged(&mut rig));
    rig.hear_from(PEER_HOST, &acknowledgement_of(&sent));
    assert!(acknowledged(&mut rig));
}

#[test]
fn a_peer_with_another_address_is_followed_within_a_second() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let begin = rig.now;
    while destination(&mut rig) == at(PEER_HOST) {
        rig.hear_from(ELSEWHERE, &again((rig.now - begin).as_millis() as u16));
        for (to, frame) in rig.sent() {
            if to == at(ELSEWHERE) {
                rig.hear_from(ELSEWHERE, &acknowledgement_of(&frame));
            }
        }
        rig.pass(Duration::from_millis(50));
    }
    assert_eq!(destination(&mut rig), at(ELSEWHERE));
    assert!(
        rig.now - begin <= Duration::from_secs(1),
        "{:?}",
        rig.now - begin
    );
    let route = rig.endpoint.peers().next().unwrap().route;
    assert_eq!(route, RouteState::Verified);
}

#[test]
fn a_process_with_another_port_is_followed_at_once_and_left_if_the_old_one_answers() {
    for is_forged in [false, true] {
        let mut rig = Rig::new();
        rig.meet_peer();
        let port = Path {
            peer: SocketAddr::from(([10, 0, 0, PEER_HOST], 40_000)).into(),
            ..path(PEER_HOST)
        };
        let datagram = judp::encode(&again(1)).unwrap();
        rig.hear_datagram(port, datagram);
        let sent = rig.sent();
        let (there, here) = (To::Peer(port.peer), at(PEER_HOST));
        let heard = if is_forged { here } else { there };
        let query = &sent.iter().find(|(to, _)| *to == heard).unwrap().1;
        let answer = judp::encode(&acknowledgement_of(query)).unwrap();
        let from = if is_forged { path(PEER_HOST) } else { port };
        rig.hear_datagram(from, answer);
        assert_eq!(destination(&mut rig), heard, "forged: {is_forged}");
        rig.pass(Duration::from_secs(5));
        assert_eq!(destination(&mut rig), heard);
    }
}

#[test]
fn processes_that_run_one_after_the_other_with_one_id_are_each_followed_at_once() {
    let mut rig = Rig::new();
    rig.meet_peer();
    for number in 40_000..40_010 {
        let port = Path {
            peer: SocketAddr::from(([10, 0, 0, PEER_HOST], number)).into(),
            ..path(PEER_HOST)
        };
        let datagram = judp::encode(&again(1)).unwrap();
        rig.hear_datagram(port, datagram);
        let there = To::Peer(port.peer);
        let sent = rig.sent();
        let query = &sent.iter().find(|(to, _)| *to == there).unwrap().1;
        let answer = judp::encode(&acknowledgement_of(query)).unwrap();
        rig.hear_datagram(port, answer);
        assert_eq!(destination(&mut rig), there);
        rig.pass(Duration::from_millis(300));
    }
}

#[test]
fn a_peer_is_followed_to_a_new_port_after_its_old_one_has_not_answered_a_challenge() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.endpoint.challenge(rig.now, PEER);
    for _ in 0..4 {
        rig.pass(Duration::from_millis(300));
    }
    assert!(
        rig.endpoint.peers.challenge(PEER).is_none(),
        "the challenge has timed out"
    );
    rig.transmits();
    let port = Path {
        peer: SocketAddr::from(([10, 0, 0, PEER_HOST], 40_000)).into(),
        ..path(PEER_HOST)
    };
    rig.hear_datagram(port, judp::encode(&again(1)).unwrap());
    assert_eq!(destination(&mut rig), To::Peer(port.peer));
}

#[test]
fn a_forged_sender_gets_nothing_for_a_peer_that_was_not_asked_yet() {
    let mut rig = Rig::new();
    rig.hear(&again(1));
    assert_eq!(rig.sent(), [], "nobody doubts it yet");
    rig.hear_from(ELSEWHERE, &again(1000));
    let challenges = rig.sent();
    assert_eq!(destination(&mut rig), at(PEER_HOST));
    let query = challenge_to(&challenges, PEER_HOST);
    rig.hear(&acknowledgement_of(query));
    assert_eq!(destination(&mut rig), at(PEER_HOST));
    let route = rig.endpoint.peers().next().unwrap().route;
    assert_eq!(route, RouteState::Verified);
}

#[test]
fn who_starts_many_challenges_keeps_nobody_else_from_being_challenged() {
    let mut rig = Rig::new();
    let invented = |number: u16| JausId::new(1000 + number / 200, 1, (number % 200 + 1) as u8);
    for source in (0..500).map(invented) {
        rig.hear_from(ELSEWHERE, &Frame { source, ..again(1) });
        rig.hear_from(ELSEWHERE + 1, &Frame { source, ..again(2) });
    }
    assert_eq!(rig.count(Counter::ChallengesSent), 64, "two for each");
    rig.transmits();
    rig.hear(&again(1));
    rig.hear_from(PEER_HOST + 1, &again(2));
    assert!(rig.endpoint.peers.challenge(PEER).is_some());
    // Unanswered challenges end soon, and their places are free again.
    rig.pass(Duration::from_secs(2));
    rig.pass(Duration::from_secs(2));
    let source = invented(499);
    rig.hear_from(ELSEWHERE, &Frame { source, ..again(3) });
    rig.hear_from(ELSEWHERE + 1, &Frame { source, ..again(4) });
    assert!(rig.endpoint.peers.challenge(source).is_some());
}

#[test]
fn an_acknowledgement_that_nobody_waits_for_teaches_nothing_and_moves_nobody() {
    let mut rig = Rig::new();
    rig.hear(&acknowledgement_of(&Frame::new(US, PEER, Bytes::new())));
    assert_eq!(rig.endpoint.peers().count(), 0);
    rig.meet_peer();
    for sequence in 0..100 {
        let query = Frame {
            sequence,
            ..Frame::new(US, PEER, Bytes::new())
        };
        rig.hear_from(ELSEWHERE, &acknowledgement_of(&query));
    }
    assert_eq!(rig.count(Counter::UnawaitedAcknowledgement), 101);
    assert!(rig.is_silent());
    assert_eq!(rig.endpoint.peers().next().unwrap().path, path(PEER_HOST));
}

#[test]
fn the_acknowledgement_of_a_call_teaches_the_address_once() {
    let mut rig = Rig::new();
    rig.send(to_peer()).unwrap();
    let (to, call) = rig.sent().pop().unwrap();
    assert_eq!(to, To::Group);
    rig.hear(&acknowledgement_of(&call));
    assert_eq!(destination(&mut rig), at(PEER_HOST));
    rig.hear_from(ELSEWHERE, &acknowledgement_of(&call));
    assert_eq!(rig.count(Counter::UnawaitedAcknowledgement), 1);
}

#[test]
fn an_address_that_acknowledges_nothing_gets_a_burst_and_then_a_trickle() {
    let mut rig = Rig::new();
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    let mut octets = 0;
    for second in 0..=10 {
        for _event in 0..1000 {
            rig.send(to_peer()).unwrap();
            octets += rig
                .transmits()
                .iter()
                .map(|it| it.payload.len())
                .sum::<usize>();
            rig.pass(Duration::from_millis(1));
        }
        assert!(
            octets <= 4096 + 1024 * (second + 1),
            "{octets} after {second} s"
        );
    }
    assert!(octets > 4096 + 9 * 1024, "{octets}");
    assert!(rig.count(Counter::UnverifiedBudget) > 0);
}

#[test]
fn all_unproven_addresses_together_get_no_more_than_their_share() {
    let mut rig = Rig::new();
    let mut octets = 0;
    for peer in 0..100_u8 {
        let (source, host) = (JausId::new(300, 1, peer + 1), peer + 100);
        rig.hear_from(host, &Frame { source, ..again(1) });
        for _event in 0..200 {
            rig.send(Outgoing {
                destination: source,
                ..to_peer()
            })
            .unwrap();
        }
        octets += rig
            .transmits()
            .iter()
            .map(|it| it.payload.len())
            .sum::<usize>();
    }
    assert!((60_000..=65_536).contains(&octets), "{octets}");
}

#[test]
fn a_peer_that_acknowledges_is_asked_in_time_and_gets_all() {
    let mut rig = Rig::new();
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    let mut reports = 0;
    for _event in 0..2000 {
        rig.send(to_peer()).unwrap();
        for (_, frame) in rig.sent() {
            if frame.flags.acknowledgement() == Acknowledgement::Request {
                rig.hear(&acknowledgement_of(&frame));
            } else {
                reports += 1;
            }
        }
        rig.pass(Duration::from_millis(1));
    }
    assert_eq!((reports, rig.count(Counter::UnverifiedBudget)), (2000, 0));
    assert_eq!(rig.count(Counter::ChallengesSent), 1);
}

#[test]
fn a_large_message_to_an_unproven_address_waits_for_the_first_acknowledgement() {
    let mut rig = Rig::new();
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    rig.send(Outgoing::new(US, PEER, vec![1; 100_000].into()))
        .unwrap();
    let sent = rig.sent();
    assert_eq!(sent.len(), 1, "a challenge");
    rig.hear(&acknowledgement_of(&sent[0].1));
    assert!(rig.sent().len() >= Config::default().initial_window);
    assert_eq!(rig.count(Counter::UnverifiedBudget), 0);
}

#[test]
fn a_configured_id_is_refused_from_elsewhere_and_never_moved() {
    for pin in [PEER, PEER.whole_subsystem()] {
        let mut rig = Rig::with(Config {
            static_peers: vec![StaticPeer {
                id: pin,
                path: path(PEER_HOST),
                gets_broadcasts: false,
            }],
            ..Config::default()
        });
        rig.hear_from(ELSEWHERE, &again(1));
        assert!(rig.is_silent(), "{pin}");
        assert_eq!(rig.count(Counter::PinnedElsewhere), 1);
        rig.hear(&again(2));
        assert_eq!(rig.received().len(), 1);
        rig.hear_from(ELSEWHERE, &again(3));
        assert_eq!(destination(&mut rig), at(PEER_HOST));
        assert_eq!(
            (rig.received().len(), rig.count(Counter::ChallengesSent)),
            (0, 0)
        );
        let route = rig.endpoint.peers().next().unwrap().route;
        assert_eq!(route, RouteState::Verified);
    }
}

#[test]
fn one_address_cannot_lock_newcomers_of_another_out() {
    let mut rig = Rig::new();
    let numbers = 0..Limits::default().max_peers as u16;
    let invented = |number: u16| JausId::new(1000 + number / 200, 1, (number % 200 + 1) as u8);
    for source in numbers.map(invented) {
        rig.hear_from(ELSEWHERE, &Frame { source, ..again(1) });
        // A reply, as to any query: it makes the source a peer that we have spoken to.
        rig.send(Outgoing {
            destination: source,
            ..to_peer()
        })
        .unwrap();
        rig.transmits();
    }
    rig.received();
    rig.hear(&again(1));
    assert_eq!(rig.received().len(), 1);
    assert_eq!(rig.count(Counter::PeersFull), 0);
    assert!(rig.endpoint.peers().any(|peer| peer.id == PEER));
    // The other address does not evict it later either.
    for number in 2000..3000 {
        let source = invented(number);
        rig.hear_from(ELSEWHERE, &Frame { source, ..again(1) });
        rig.pass(Duration::from_millis(20));
    }
    assert!(rig.endpoint.peers().any(|peer| peer.id == PEER));
}

/// A registration that identifies JAUS++ with certainty.
const REGISTRATION: &[u8] = b"\x00\x0B\x01\x1Curn:jaus:jss:jpp:extras:Name\x01\x00";

#[test]
fn a_forged_sign_does_not_change_how_messages_are_cut() {
    let codes_to = |is_proven: bool, forged_from: u8| {
        let mut rig = Rig::new();
        rig.hear(&again(900));
        if is_proven {
            rig.vouch_for(PEER);
        }
        let sign = Frame {
            sequence: 901,
            ..from_peer(REGISTRATION)
        };
        rig.hear_from(forged_from, &sign);
        // The challenges stay unanswered.
        rig.pass(Duration::from_secs(5));
        rig.transmits();
        rig.hear(&again(902));
        let payload = [&[0x01, 0x4B][..], &[7; 2000]].concat();
        rig.send(Outgoing {
            payload: payload.into(),
            ..to_peer()
        })
        .unwrap();
        rig.transmits();
        for _try in 0..4 {
            rig.pass(Duration::from_millis(300));
        }
        rig.endpoint.peers.repeats_code(PEER) == Some(true)
    };
    assert!(codes_to(true, PEER_HOST), "the peer itself");
    assert!(!codes_to(true, ELSEWHERE), "somebody else");
    assert!(!codes_to(false, PEER_HOST), "nobody knows who");
}

#[test]
fn what_was_seen_of_a_peer_ends_when_its_numbers_begin_anew() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.hear(&Frame {
        sequence: 901,
        ..from_peer(REGISTRATION)
    });
    let profile = |rig: &Rig| rig.endpoint.peers().next().unwrap().profile;
    assert_eq!(profile(&rig), crate::peer::Implementation::JausPlusPlus);
    rig.hear(&again(1));
    assert_eq!(profile(&rig), crate::peer::Implementation::Standard);
}

#[test]
fn a_peer_that_was_silent_while_a_message_was_given_up_is_called_for_again() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.pass(Duration::from_secs(1));
    rig.send(Outgoing {
        acknowledge: true,
        ..to_peer()
    })
    .unwrap();
    while let Some(timeout) = rig.endpoint.poll_timeout() {
        rig.pass(timeout - rig.now);
        rig.transmits();
    }
    assert_eq!(destination(&mut rig), To::Group);
    rig.hear_from(ELSEWHERE, &again(1));
    assert_eq!(destination(&mut rig), at(ELSEWHERE));
}

#[test]
fn the_address_that_keeps_most_fragments_loses_them_first() {
    let mut rig = Rig::with(Config {
        max_reassembly: 100_000,
        ..Config::default()
    });
    let first = |source: JausId, sequence| Frame {
        source,
        sequence,
        flags: Flags::default().with_data(crate::wire::DataControl::First),
        payload: vec![2; 1000].into(),
        ..from_peer(b"")
    };
    rig.hear(&first(PEER, 1));
    for number in 0..1000 {
        let source = JausId::new(1000, 1, (number % 250 + 1) as u8);
        rig.hear_from(ELSEWHERE, &first(source, number * 3));
        rig.now += Duration::from_millis(1);
    }
    assert!(rig.endpoint.unfinished() <= 100_000);
    let last = Frame {
        flags: Flags::default().with_data(crate::wire::DataControl::Last),
        ..again(2)
    };
    rig.received();
    rig.hear(&last);
    assert_eq!(rig.received().len(), 1, "though it is the oldest");
}

#[test]
fn a_challenge_has_a_number_that_depends_on_the_key_and_was_used_long_ago() {
    let number = |challenge_key| {
        let mut rig = Rig::with(Config {
            challenge_key,
            first_sequence: 5,
            ..Config::default()
        });
        rig.meet_peer();
        rig.hear_from(ELSEWHERE, &again(1));
        let sent = rig.sent();
        let [known, rival] = [PEER_HOST, ELSEWHERE].map(|host| challenge_to(&sent, host).sequence);
        assert_ne!(known, rival);
        known
    };
    let mut ago: Vec<_> = (1..=50)
        .map(|key| 6_u16.wrapping_sub(number(key)))
        .collect();
    ago.sort_unstable();
    ago.dedup();
    assert!(ago.len() > 40 && ago[0] < 18_000 && ago[ago.len() - 1] > 31_000);
    assert!(ago.iter().all(|ago| (1 << 14..1 << 15).contains(ago)));
}

#[test]
fn a_challenge_is_acknowledged_and_not_delivered_even_if_the_receiver_is_busy() {
    let mut rig = Rig::new();
    rig.inbox.full.push(US);
    rig.hear(&Frame {
        flags: Flags::new(Priority::SafetyCritical).with_acknowledgement(Acknowledgement::Request),
        ..again(7)
    });
    let sent = rig.sent();
    assert!(sent.len() == 1 && sent[0].1.is_acknowledgement());
    assert_eq!(rig.received(), []);
    rig.inbox.full.clear();
    // The services query a client's heartbeat in this way, and a node must not answer for it.
    let flags = Flags::new(Priority::High).with_acknowledgement(Acknowledgement::Request);
    rig.hear(&Frame { flags, ..again(8) });
    assert_eq!(rig.received().len(), 1, "any other query is");
}
