//! How challenges are decided, and how often they begin.

use super::*;

#[test]
fn at_most_256_challenges_are_in_progress() {
    let mut rig = Rig::new();
    for number in 0..256_u16 {
        let host = path(100 + (number / 30) as u8, 3794);
        let id = JausId::new(1000 + number, 1, 1);
        rig.hear_frame(&frame(id, 1), host);
        assert!(rig.peers.may_challenge(rig.now, id, host), "{number}");
        let incumbent = (probe(host, 7, false), false);
        rig.peers.begin_challenge(rig.now, id, US, incumbent, None);
    }
    rig.hear_frame(&frame(PEER, 1), here());
    assert!(!rig.peers.may_challenge(rig.now, PEER, here()));
}

#[test]
fn a_path_that_did_not_answer_is_left_alone_for_ten_seconds() {
    let mut rig = Rig::new();
    rig.hear_frame(&frame(PEER, 1), here());
    let begin = rig.now;
    rig.challenge(probe(here(), 7, false), None);
    assert!(
        !rig.peers.may_challenge(rig.now, PEER, here()),
        "in progress"
    );
    let decision = rig.run_out();
    assert_eq!(rig.now - begin, 3 * Duration::from_millis(300));
    assert_eq!((decision.to, decision.refused), (here(), None));
    assert_eq!(rig.peer().peer.route, RouteState::Unverified);
    assert!(rig.peers.may_challenge(rig.now, PEER, far()));
    for (pause, expected) in [(9_999, false), (1, true)] {
        rig.now += pause * MILLISECOND;
        assert_eq!(rig.peers.may_challenge(rig.now, PEER, here()), expected);
    }
}

#[test]
fn a_conflict_is_settled_for_two_seconds() {
    let mut rig = Rig::new();
    rig.hear_frame(&frame(PEER, 1), here());
    rig.peers.verify(PEER, here());
    rig.challenge(probe(here(), 7, false), Some(probe(far(), 8, false)));
    let decision = rig.run_out();
    assert_eq!((decision.to, decision.refused), (here(), Some(far())));
    for (pause, is_over) in [(1_999, false), (1, true)] {
        rig.now += pause * MILLISECOND;
        assert_eq!(rig.peers.may_challenge(rig.now, PEER, far()), is_over);
        let heard = rig.hear_frame(&frame(PEER, 2), far());
        assert_eq!(heard != Heard::Known, is_over);
    }
}

#[test]
fn while_both_paths_may_answer_only_the_known_one_is_verified_at_once() {
    let (stays, undecided) = (Some(Some(here())), Some(None));
    for (first, second, route) in [
        ((here(), 7), (far(), 8), RouteState::Verified),
        ((far(), 8), (here(), 7), RouteState::Unverified),
    ] {
        let mut rig = Rig::new();
        rig.hear_frame(&frame(PEER, 1), here());
        rig.challenge(probe(here(), 7, false), Some(probe(far(), 8, false)));
        assert_eq!(rig.answer(first.0, first.1), undecided);
        assert_eq!(rig.peer().peer.route, route);
        assert_eq!(rig.answer(second.0, second.1), stays);
        assert_eq!(rig.peer().peer.route, RouteState::Verified);
    }
}

#[test]
fn a_verified_move_is_followed_by_the_next_at_once() {
    let mut rig = Rig::new();
    rig.hear_frame(&frame(PEER, 1), here());
    rig.challenge(probe(here(), 7, false), Some(probe(near(), 8, false)));
    assert_eq!(rig.answer(near(), 8), Some(Some(near())));
    assert_eq!(rig.peer().peer.route, RouteState::Verified);
    assert!(rig.peers.may_challenge(rig.now, PEER, here()));
}

#[test]
fn what_is_heard_of_the_incumbent_keeps_an_unverified_peer_where_it_was() {
    let third = path(1, 50_000);
    for (heard_on, expected) in [
        (None, near()),
        (Some(here()), here()),
        (Some(third), near()),
    ] {
        let mut rig = Rig::new();
        rig.hear_frame(&frame(PEER, 1), here());
        rig.challenge(probe(here(), 7, false), Some(probe(near(), 8, false)));
        rig.peers.set_route(PEER, near(), RouteState::Unverified);
        if let Some(path) = heard_on {
            assert_eq!(rig.hear_frame(&frame(PEER, 2), path), Heard::Known);
        }
        assert_eq!(rig.run_out().to, expected, "{heard_on:?}");
    }
}

#[test]
fn the_last_four_other_paths_that_answered_count_as_its_own() {
    let mut rig = Rig::new();
    rig.hear_frame(&frame(PEER, 1), here());
    for host in 11..=16 {
        rig.challenge(
            probe(here(), 7, false),
            Some(probe(path(host, 1), 8, false)),
        );
        assert_eq!(rig.answer(path(host, 1), 9), None, "a wrong number");
        for _time in 0..2 {
            assert_eq!(
                rig.answer(path(host, 1), 8),
                Some(None),
                "the other may too"
            );
        }
        assert_eq!(rig.answer(here(), 7), Some(Some(here())));
        rig.now += 2 * SECOND;
        rig.hear_frame(&frame(PEER, host.into()), here());
    }
    let is_known = |&host: &u8| !rig.peers.is_proven_elsewhere(PEER, path(host, 1));
    let known: Vec<_> = (10..20).filter(is_known).collect();
    assert_eq!(known, [13, 14, 15, 16]);
}

/// A challenge in its last try.
fn challenge(incumbent: bool, rival: Option<bool>) -> Challenge {
    let mut rig = Rig::new();
    rig.hear_frame(&frame(PEER, 1), here());
    let rival = rival.map(|answered| probe(far(), 8, answered));
    rig.challenge(probe(here(), 7, incumbent), rival);
    let tries = 3;
    Challenge {
        tries,
        ..rig.peer().challenge.unwrap()
    }
}

#[test]
fn an_answer_decides_if_the_other_path_need_not_be_waited_for() {
    let moves = Some(Finding::Moves { verified: true });
    for (incumbent, rival, later, at_once) in [
        (true, None, Some(Finding::Stays), Some(Finding::Stays)),
        (false, None, None, None),
        (true, Some(true), Some(Finding::Stays), Some(Finding::Stays)),
        (true, Some(false), None, Some(Finding::Stays)),
        (false, Some(true), None, moves),
        (false, Some(false), None, None),
    ] {
        for (is_at_once, expected) in [(false, later), (true, at_once)] {
            let challenge = Challenge {
                at_once: is_at_once,
                ..challenge(incumbent, rival)
            };
            let row = (incumbent, rival, is_at_once);
            assert_eq!(challenge.early_finding(), expected, "{row:?}");
        }
    }
}

#[test]
fn the_first_answer_decides_between_ports_of_a_host_or_after_a_long_silence() {
    for (silence, rival, expected) in [
        (Duration::ZERO, near(), true),
        (Duration::ZERO, far(), false),
        (10 * SECOND - MILLISECOND, far(), false),
        (10 * SECOND, far(), true),
    ] {
        let mut rig = Rig::new();
        rig.hear_frame(&frame(PEER, 1), here());
        rig.now += silence;
        rig.challenge(probe(here(), 7, false), Some(probe(rival, 8, false)));
        assert_eq!(rig.peer().challenge.unwrap().at_once, expected);
    }
}

#[test]
fn the_last_timeout_decides_by_what_was_heard() {
    let moves = |verified| Finding::Moves { verified };
    // Whether the incumbent answered, was heard and was verified; whether the rival answered.
    for (answered, heard, verified, rival, expected) in [
        (true, false, false, Some(true), Finding::Stays),
        (true, false, false, None, Finding::Stays),
        (false, true, false, Some(true), Finding::Unanswered),
        (false, false, true, Some(true), moves(true)),
        (false, false, false, Some(false), moves(false)),
        (false, false, true, Some(false), Finding::Unanswered),
        (false, false, false, None, Finding::Unanswered),
    ] {
        let mut last = Challenge {
            incumbent_heard: heard,
            was_verified: verified,
            ..challenge(answered, rival)
        };
        let row = (answered, heard, verified, rival);
        assert_eq!(last.handle_timeout(last.due), Some(expected), "{row:?}");
        last.tries = 2;
        let now = last.due;
        assert_eq!(last.handle_timeout(now), None, "one more try");
        assert_eq!((last.tries, last.due), (3, now + route::TRY_INTERVAL));
    }
}

#[test]
fn only_the_component_that_challenged_is_answered_on_the_path_of_the_query() {
    for (local, number, from, expected) in [
        (US, 7, here(), true),
        (JausId::new(101, 1, 2), 7, here(), false),
        (US, 8, here(), false),
        (US, 7, far(), false),
        (US, 8, far(), true),
    ] {
        let mut challenge = challenge(false, Some(false));
        assert_eq!(challenge.handle_answer(local, number, from), expected);
        let answered = challenge.probes().filter(|it| it.answered);
        assert_eq!(answered.count(), usize::from(expected));
    }
}

#[test]
fn a_challenge_is_a_query_of_the_heartbeat_at_its_own_priority_for_one_component() {
    let challenge = Frame {
        flags: CHALLENGE_FLAGS,
        ..Frame::new(PEER, US, Bytes::from_static(CHALLENGE))
    };
    let other_query = Bytes::from_static(b"\x00\x2B");
    for (frame, expected) in [
        (challenge.clone(), true),
        (
            Frame {
                flags: Flags::default(),
                ..challenge.clone()
            },
            false,
        ),
        (
            Frame {
                payload: other_query,
                ..challenge.clone()
            },
            false,
        ),
        (
            Frame {
                destination: JausId::EVERYONE,
                ..challenge
            },
            false,
        ),
    ] {
        assert_eq!(is_challenge(&frame), expected);
        assert_eq!(has_own_number(&frame), !expected);
    }
}
