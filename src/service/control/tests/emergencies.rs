//! Emergencies: who sets and clears them, what they keep from happening, and floods of forged ones.

use super::super::management::MOST_EMERGENCIES;
use super::*;
use crate::endpoint::{LinkId, Path, Remote, SessionId as PeerSession};
use crate::service::code_of;
use crate::service::control::CLEAR_ALL;

const CLEAR_OF_ALL: ClearEmergency = ClearEmergency {
    emergency_code: clear_emergency::EmergencyCode(CLEAR_ALL),
};

#[test]
fn anybody_can_set_an_emergency_and_only_the_same_client_clears_it() {
    let mut rig = Rig::ready();
    rig.hear(THIRD, &STOP);
    assert_eq!(rig.state(), State::Emergency);
    for client in [FIRST, SECOND] {
        rig.hear(client, &CLEAR);
        assert_eq!(rig.state(), State::Emergency);
    }
    rig.hear(THIRD, &CLEAR);
    assert_eq!(
        rig.state(),
        State::Standby,
        "it does not move off by itself"
    );
    assert_eq!(rig.controller(), Some((FIRST, 100)), "control is kept");
}

/// JAUS++ sends Set Emergency when it means Clear Emergency.
#[test]
fn an_emergency_that_is_set_again_stays_and_is_cleared_at_once() {
    let mut rig = Rig::ready();
    for _again in 0..3 {
        rig.hear(FIRST, &STOP);
        assert_eq!(rig.state(), State::Emergency);
    }
    assert_eq!(
        rig.controller().map(|(id, _)| id),
        Some(FIRST),
        "control stays"
    );
    rig.hear(FIRST, &CLEAR);
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn a_late_request_to_clear_does_not_end_an_emergency_that_its_client_has_set_since() {
    let mut rig = Rig::ready();
    let hear = |rig: &mut Rig, stops: bool, number: u16| {
        rig.number = Some(number);
        _ = match stops {
            true => rig.hear(THIRD, &STOP),
            false => rig.hear(THIRD, &CLEAR),
        };
        rig.number = None;
        rig.state()
    };
    hear(&mut rig, true, 65_530);
    assert_eq!(hear(&mut rig, true, 2), State::Emergency);
    assert_eq!(hear(&mut rig, false, 1), State::Emergency, "sent before");
    assert_eq!(hear(&mut rig, true, 0), State::Emergency, "a late copy");
    assert_eq!(hear(&mut rig, false, 1), State::Emergency, "still before");
    assert_eq!(hear(&mut rig, false, 3), State::Standby);
    // A client that counts anew, and one that does not count.
    hear(&mut rig, true, 20_000);
    assert_eq!(hear(&mut rig, false, 0), State::Standby);
    hear(&mut rig, true, 0);
    assert_eq!(hear(&mut rig, false, 0), State::Standby);
    hear(&mut rig, true, 9);
    rig.pass(Duration::from_secs(4));
    assert_eq!(
        hear(&mut rig, false, 8),
        State::Standby,
        "no network delays it so long"
    );
}

#[test]
fn an_emergency_ends_when_the_last_of_several_is_cleared() {
    let mut rig = Rig::ready();
    for client in [SECOND, THIRD, SECOND] {
        rig.hear(client, &STOP);
    }
    rig.hear(SECOND, &CLEAR);
    assert_eq!(rig.state(), State::Emergency);
    rig.hear(THIRD, &CLEAR);
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn the_application_can_end_the_emergencies_of_clients_that_are_gone() {
    let mut rig = Rig::ready();
    rig.hear(SECOND, &STOP);
    rig.hear(THIRD, &STOP);
    rig.stack.set_condition(rig.now, Condition::Safe);
    assert_eq!(rig.state(), State::Standby);
    rig.hear(SECOND, &STOP);
    rig.hear(THIRD, &CLEAR);
    assert_eq!(rig.state(), State::Emergency, "of another emergency");
    for state in [State::Initialize, State::Ready, State::Failure] {
        let mut rig = Rig::brought_to(state);
        rig.stack.set_condition(rig.now, Condition::Safe);
        assert_eq!(rig.state(), state, "there was none");
    }
}

#[test]
fn the_component_s_own_stop_ends_alone_and_no_client_clears_it() {
    let mut rig = Rig::ready();
    rig.stack.set_condition(rig.now, Condition::Stopped);
    assert_eq!(rig.state(), State::Emergency);
    let us = rig.stack.id();
    for client in [FIRST, us] {
        rig.hear(client, &CLEAR);
        rig.hear(client, &CLEAR_OF_ALL);
        assert_eq!(rig.state(), State::Emergency, "{client}");
    }
    rig.hear(THIRD, &STOP);
    rig.stack.set_condition(rig.now, Condition::StopReleased);
    assert_eq!(rig.state(), State::Emergency, "THIRD has set one");
    rig.hear(THIRD, &CLEAR);
    assert_eq!(rig.state(), State::Standby);

    rig.hear(THIRD, &STOP);
    rig.stack.set_condition(rig.now, Condition::Stopped);
    rig.hear(THIRD, &CLEAR);
    assert_eq!(rig.state(), State::Emergency, "the stop is not released");
    rig.stack.set_condition(rig.now, Condition::StopReleased);
    assert_eq!(rig.state(), State::Standby);
    rig.stack.set_condition(rig.now, Condition::StopReleased);
    assert_eq!(rig.state(), State::Standby, "there was none");
}

#[test]
fn the_emergencies_of_all_clients_are_cleared_by_a_checked_client_alone() {
    let on = |peer| {
        let link = LinkId(0);
        Some(Path { link, peer })
    };
    let plain = Remote::Socket(([10, 0, 0, 1], 3794).into());
    for (path, expected) in [
        (on(plain), State::Emergency),
        (on(Remote::Line), State::Emergency),
        (on(Remote::Session(PeerSession(7))), State::Standby),
        (None, State::Standby),
    ] {
        let mut rig = Rig::ready();
        rig.hear(THIRD, &STOP);
        rig.hear_on(path, SECOND, &CLEAR);
        assert_eq!(rig.state(), State::Emergency, "SECOND has set none");
        rig.hear_on(path, SECOND, &CLEAR_OF_ALL);
        assert_eq!(rig.state(), expected, "{path:?}");
    }
}

#[test]
fn a_command_in_place_of_a_subscription_s_query_does_nothing() {
    let mut rig = Rig::ready();
    rig.hear(THIRD, &STOP);
    let create = CreateEvent {
        query_message: CLEAR_OF_ALL.encode().unwrap(),
        ..CreateEvent::default()
    };
    let link = LinkId(0);
    let path = Path {
        link,
        peer: Remote::Line,
    };
    rig.hear_on(Some(path), SECOND, &create);
    assert_eq!(rig.state(), State::Emergency);
}

#[test]
fn in_an_emergency_control_neither_comes_nor_goes() {
    let mut rig = Rig::ready();
    rig.hear(THIRD, &STOP);
    let refused = confirmed(SECOND, Confirmation::NOT_AVAILABLE);
    assert_eq!(rig.request(SECOND, 255), [refused]);
    let kept = rejected(FIRST, Rejection::NOT_AVAILABLE);
    assert_eq!(rig.hear(FIRST, &ReleaseControl), [kept]);
    rig.hear(FIRST, &Resume);
    rig.hear(FIRST, &Reset);
    rig.hear(FIRST, &Shutdown);
    rig.hear(FIRST, &SetAuthority { authority_code: 5 });
    assert_eq!(rig.controller(), Some((FIRST, 100)));
    let status = ReportStatus {
        status: report_status::Status(5),
        reserved: 0,
    };
    assert_eq!(rig.hear(SECOND, &QueryStatus), [told(SECOND, &status)]);
}

#[test]
fn a_flood_of_emergencies_is_bounded_and_can_be_cleared() {
    let mut rig = Rig::managed();
    let client = |i: u16| JausId::new(1000 + i, 1, 1);
    for i in 0..1000 {
        rig.hear(client(i), &STOP);
    }
    for i in 0..1000 {
        assert_eq!(rig.state(), State::Emergency);
        rig.hear(client(i), &CLEAR);
    }
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn a_flood_of_forged_emergencies_hides_no_real_one_and_is_cleared_by_the_client_in_control() {
    let mut rig = lasting();
    for i in 0..5000 {
        let forged = JausId::new(1000 + i, 1, 1);
        rig.dead.push(forged);
        rig.hear(forged, &STOP);
    }
    rig.run(Duration::from_secs(5));
    rig.hear(THIRD, &STOP);
    rig.hear(FIRST, &CLEAR);
    assert_eq!(rig.state(), State::Emergency, "THIRD is alive");
    rig.hear(THIRD, &CLEAR);
    // There were more emergencies than the table holds; the client in control clears the rest.
    rig.hear(FIRST, &CLEAR);
    assert_eq!(rig.state(), State::Standby);
}

/// The number of setters that the table holds.
const MOST: u16 = MOST_EMERGENCIES as u16;

fn setter(i: u16) -> JausId {
    JausId::new(1000 + i, 1, 1)
}

#[test]
fn a_setter_that_finds_the_table_full_is_noted_until_the_client_in_control_clears_it() {
    let mut rig = lasting();
    for i in 0..=MOST {
        rig.hear(setter(i), &STOP);
    }
    rig.hear(FIRST, &CLEAR);
    for i in 0..MOST {
        rig.hear(setter(i), &CLEAR);
    }
    assert_eq!(rig.state(), State::Emergency, "one more has set it");
    rig.hear(FIRST, &CLEAR);
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn emergencies_beyond_the_table_are_cleared_by_a_client_that_takes_control_for_it() {
    let mut rig = Rig::managed();
    for i in 0..=MOST {
        rig.hear(setter(i), &STOP);
    }
    let refused = confirmed(FIRST, Confirmation::NOT_AVAILABLE);
    assert_eq!(rig.request(FIRST, 100), [refused], "the setters are alive");
    for i in 0..=MOST {
        rig.hear(setter(i), &CLEAR);
    }
    assert_eq!(rig.state(), State::Emergency, "one was not held");
    let granted = confirmed(FIRST, Confirmation::CONTROL_ACCEPTED);
    assert_eq!(rig.request(FIRST, 100), [granted]);
    rig.hear(FIRST, &CLEAR);
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn a_full_table_holds_again_a_setter_that_repeats_and_one_in_place_of_a_dead_one() {
    let mut rig = lasting();
    rig.dead.push(setter(0));
    rig.hear(setter(0), &STOP);
    rig.run(Duration::from_secs(5));
    for i in 1..=MOST {
        rig.hear(setter(i), &STOP);
    }
    rig.hear(setter(1), &STOP);
    for i in 1..=MOST {
        assert_eq!(rig.state(), State::Emergency);
        rig.hear(setter(i), &CLEAR);
    }
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn only_setters_of_emergencies_are_probed_among_clients_without_control() {
    type Send = fn(&mut Rig);
    let sends: [(Send, bool); 2] = [
        (|rig| _ = rig.hear(THIRD, &STOP), true),
        (|rig| _ = rig.hear(THIRD, &QueryStatus), false),
    ];
    for (send, probed) in sends {
        let mut rig = Rig::managed();
        send(&mut rig);
        rig.now += Duration::from_secs(5);
        rig.stack.handle_timeout(rig.now);
        let sent: Vec<_> = std::iter::from_fn(|| rig.stack.poll_transmit()).collect();
        let is_probe = |payload| code_of(payload) == Some(QueryHeartbeatPulse::CODE);
        assert_eq!(sent.iter().any(|it| is_probe(&it.payload)), probed);
    }
}
