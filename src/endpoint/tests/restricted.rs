//! Components of processes whose user may not send everything.

use super::*;
use crate::rights::Rules;

const REQUEST_CONTROL: &[u8] = b"\x0D\x00\x64";
const SET_EMERGENCY: &[u8] = b"\x06\x00\x01\x00";

/// A rig whose component [`US`] has these rights, and has a sibling.
fn restricted(rules: &str) -> Rig {
    let mut rig = Rig::new();
    rig.endpoint.attach(SIBLING).unwrap();
    rig.meet_peer();
    rig.endpoint.restrict(US, rules.parse::<Rules>().unwrap());
    rig
}

fn message(to: JausId, payload: &'static [u8]) -> Outgoing {
    Outgoing::new(US, to, Bytes::from_static(payload))
}

#[test]
fn a_component_that_may_observe_commands_neither_its_siblings_nor_peers() {
    let mut rig = restricted("observe");
    for to in [SIBLING, PEER, JausId::EVERYONE] {
        rig.send(message(to, QUERY_HEARTBEAT)).unwrap();
        let refused = rig.send(message(to, b"\x04\x00")).unwrap_err();
        assert!(matches!(refused, SendError::NotAllowed(_)), "{refused:?}");
    }
    let queries = rig.sent().len() + rig.received().len();
    assert_eq!(queries, 4, "one for each, and two for everyone");
    assert_eq!(rig.count(Counter::NotGranted), 3);
    rig.send(message(SIBLING, SET_EMERGENCY)).unwrap();
    assert_eq!(rig.received().len(), 1, "who may look may stop");
}

#[test]
fn its_refused_request_for_control_is_answered() {
    let mut rig = restricted("control=99");
    rig.send(message(SIBLING, REQUEST_CONTROL)).unwrap_err();
    let answers = rig.received();
    let [answer] = &answers[..] else {
        panic!("{answers:?}")
    };
    assert_eq!((answer.source, answer.to), (SIBLING, US));
    assert_eq!(answer.payload[..], b"\x0F\x00\x02"[..]);
}

#[test]
fn its_stop_for_all_goes_to_those_that_it_may_reach() {
    let mut rig = restricted("observe with=101.1.2");
    rig.send(message(JausId::EVERYONE, SET_EMERGENCY)).unwrap();
    let received: Vec<_> = rig.received().iter().map(|it| it.to).collect();
    assert_eq!((received, rig.sent().len()), (vec![SIBLING], 0));
}

#[test]
fn the_next_component_with_its_id_is_not_restricted() {
    let mut rig = restricted("observe");
    rig.endpoint.detach(US);
    rig.endpoint.attach(US).unwrap();
    rig.send(message(SIBLING, REQUEST_CONTROL)).unwrap();
}
