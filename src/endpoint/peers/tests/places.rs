//! Which peer is evicted from the full table.

use super::*;

#[test]
fn an_address_that_holds_two_more_than_the_newcomers_makes_room() {
    let mut rig = Rig::bounded(100);
    let peers = [1, 2, 3].map(|component| JausId::new(42, 1, component));
    for (id, host) in peers.into_iter().zip([2, 1, 1]) {
        rig.add(id, host, Standing::Heard);
        rig.now += SECOND;
    }
    let next = |rig: &mut Rig, host| rig.peers.next_to_go(rig.now, path(host, 3794).into());
    assert_eq!(next(&mut rig, 3), Some(peers[1]), "the oldest of two");
    assert_eq!(next(&mut rig, 2), Some(peers[0]), "the oldest of all");
    rig.hear_frame(&frame(peers[1], 2), path(1, 3794));
    assert_eq!(next(&mut rig, 3), Some(peers[2]), "the other is active");
}

#[test]
fn a_quarter_of_the_table_is_the_most_that_an_address_keeps_against_others() {
    for (limit, expected) in [(12, None), (11, Some(1))] {
        let mut rig = Rig::bounded(limit);
        let peers = [1, 2, 3].map(|component| JausId::new(42, 1, component));
        for id in peers {
            rig.add(id, 1, Standing::Answered);
            rig.now += SECOND;
        }
        let next = rig.peers.next_to_go(rig.now, far().into());
        assert_eq!(next.map(JausId::component), expected, "of {limit}");
    }
    for (limit, expected) in [(12, 9), (11, 1)] {
        let mut rig = Rig::bounded(limit);
        rig.add(JausId::new(42, 1, 9), 2, Standing::Heard);
        for component in [1, 2, 3] {
            rig.now += SECOND;
            rig.add(JausId::new(42, 1, component), 1, Standing::Heard);
        }
        let next = rig.peers.next_to_go(rig.now, here().into()).unwrap();
        assert_eq!(next.component(), expected, "of {limit}");
    }
}

#[test]
fn those_that_only_sent_go_first_and_those_that_answered_after_a_minute() {
    let mut rig = Rig::bounded(100);
    let standings = [Standing::Answered, Standing::SpokenTo, Standing::Heard];
    for (host, standing) in (1..).zip(standings) {
        rig.add(JausId::new(42, 1, host), host, standing);
    }
    for expected in [3, 2] {
        let next = rig.peers.next_to_go(rig.now, path(9, 3794).into()).unwrap();
        assert_eq!(next.component(), expected);
        rig.peers.remove(next);
    }
    let answered = JausId::new(42, 1, 1);
    for (pause, expected) in [(59_999, None), (1, Some(answered))] {
        rig.now += pause * MILLISECOND;
        let next = rig.peers.next_to_go(rig.now, path(9, 3794).into());
        assert_eq!(next, expected);
    }
}

#[test]
fn there_is_room_for_a_known_peer_or_if_one_can_be_evicted() {
    let mut rig = Rig::bounded(1);
    let room = |rig: &mut Rig, id| rig.peers.has_room_for(rig.now, id, far());
    let other = JausId::new(42, 1, 2);
    assert!(room(&mut rig, PEER));
    rig.add(PEER, 1, Standing::SpokenTo);
    assert!(room(&mut rig, PEER) && room(&mut rig, other));
    let mut rig = Rig::bounded(4);
    (1..=4).for_each(|host| rig.add(JausId::new(42, 1, host), host, Standing::Answered));
    assert!(room(&mut rig, PEER) && !room(&mut rig, JausId::new(43, 1, 1)));
}
