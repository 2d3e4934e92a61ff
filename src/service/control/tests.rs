//! Tests of each transition of Access Control and Management on a whole component, in virtual time.

mod emergencies;
mod held_up;
mod restarts;
mod stopping;

use std::time::Duration;

use super::{AccessControl, Condition, Control, Management};
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::confirm_control::ResponseCode as Confirmation;
use crate::messages::core::reject_control::ResponseCode as Rejection;
use crate::messages::core::*;
use crate::service::stack_rig::{Sent, StackRig as Rig};
use crate::service::{Stack, Standing as Now, State, Transport};

const FIRST: JausId = JausId::new(42, 2, 1);
const SECOND: JausId = JausId::new(42, 2, 2);
const THIRD: JausId = JausId::new(42, 2, 4);

impl Rig {
    fn with(settings: impl FnOnce(Stack) -> Stack) -> Self {
        Self::new(vec![Box::new(Transport)], settings)
    }

    fn managed() -> Self {
        Self::with(|stack| stack.management(Management::new()))
    }

    fn request(&mut self, client: JausId, authority_code: u8) -> Vec<Sent> {
        self.hear(client, &RequestControl { authority_code })
    }

    /// A ready component that `FIRST` controls.
    fn ready() -> Self {
        let mut rig = Self::managed();
        rig.request(FIRST, 100);
        rig.hear(FIRST, &Resume);
        assert_eq!(rig.state(), State::Ready);
        rig
    }

    /// A component in the given state: controlled by `FIRST` if the state allows control, with an
    /// emergency set by `THIRD` if the state is Emergency.
    fn brought_to(state: State) -> Self {
        let mut rig = Self::with(|stack| stack.management(Management::new().initializes()));
        if state != State::Initialize {
            rig.stack.set_condition(rig.now, Condition::Initialized);
            rig.request(FIRST, 100);
        }
        match state {
            State::Initialize | State::Standby => {}
            State::Ready => _ = rig.hear(FIRST, &Resume),
            State::Shutdown => _ = rig.hear(FIRST, &Shutdown),
            State::Failure => rig.stack.set_condition(rig.now, Condition::Failed),
            State::Emergency => _ = rig.hear(THIRD, &STOP),
        }
        rig.said();
        assert_eq!(rig.state(), state);
        rig
    }

    fn state(&self) -> State {
        self.stack.standing().state
    }

    fn controller(&self) -> Option<(JausId, u8)> {
        let controller = self.stack.standing().controller;
        controller.map(|controller| (controller.id, controller.authority))
    }
}

fn confirmed(to: JausId, response_code: Confirmation) -> Sent {
    told(to, &ConfirmControl { response_code })
}

fn rejected(to: JausId, response_code: Rejection) -> Sent {
    told(to, &RejectControl { response_code })
}

fn told<M: Message>(to: JausId, message: &M) -> Sent {
    (to, message.encode().unwrap())
}

const STOP: SetEmergency = SetEmergency {
    emergency_code: set_emergency::EmergencyCode(1),
};
const CLEAR: ClearEmergency = ClearEmergency {
    emergency_code: clear_emergency::EmergencyCode(1),
};

#[test]
fn control_goes_to_who_has_the_default_authority() {
    for (authority, answer, controller) in [
        (0, Confirmation::INSUFFICIENT_AUTHORITY, None),
        (1, Confirmation::CONTROL_ACCEPTED, Some((FIRST, 1))),
        (220, Confirmation::CONTROL_ACCEPTED, Some((FIRST, 220))),
    ] {
        let mut rig = Rig::managed();
        assert_eq!(rig.request(FIRST, authority), [confirmed(FIRST, answer)]);
        assert_eq!(rig.controller(), controller, "authority {authority}");
    }
}

#[test]
fn a_stronger_client_takes_control_over_and_the_former_is_told() {
    let mut rig = Rig::managed();
    rig.request(FIRST, 220);
    for weaker in [200, 220] {
        let refused = confirmed(SECOND, Confirmation::INSUFFICIENT_AUTHORITY);
        assert_eq!(rig.request(SECOND, weaker), [refused]);
    }
    let expected = [
        rejected(FIRST, Rejection::CONTROL_RELEASED),
        confirmed(SECOND, Confirmation::CONTROL_ACCEPTED),
    ];
    assert_eq!(rig.request(SECOND, 231), expected);
    assert_eq!(rig.controller(), Some((SECOND, 231)));
}

#[test]
fn the_client_in_control_may_change_its_authority_by_asking_again() {
    let mut rig = Rig::ready();
    let granted = confirmed(FIRST, Confirmation::CONTROL_ACCEPTED);
    assert_eq!(rig.request(FIRST, 50), [granted]);
    assert_eq!(rig.controller(), Some((FIRST, 50)));
    assert_eq!(rig.state(), State::Ready, "renewing stops nothing");
    let granted = confirmed(FIRST, Confirmation::CONTROL_ACCEPTED);
    assert_eq!(rig.request(FIRST, 1), [granted], "the default authority");
    let lost = rejected(FIRST, Rejection::CONTROL_RELEASED);
    assert_eq!(rig.request(FIRST, 0), [lost]);
    assert_eq!((rig.controller(), rig.state()), (None, State::Standby));
}

#[test]
fn authority_is_set_by_the_client_in_control_alone_and_only_downwards() {
    let mut rig = Rig::with(|stack| stack.access_control(AccessControl::new().authority(10)));
    rig.request(FIRST, 220);
    for (client, authority_code, expected) in [
        (SECOND, 200, 220),
        (FIRST, 221, 220),
        (FIRST, 219, 219),
        (FIRST, 9, 219),
        (FIRST, 10, 10),
    ] {
        assert_eq!(rig.hear(client, &SetAuthority { authority_code }), []);
        let report = ReportAuthority {
            authority_code: expected,
        };
        assert_eq!(rig.hear(SECOND, &QueryAuthority), [told(SECOND, &report)]);
    }
}

#[test]
fn queries_tell_who_controls_and_for_how_long() {
    let settings = AccessControl::new().authority(7).timeout(5);
    let mut rig = Rig::with(|stack| stack.access_control(settings));
    let nobody = ReportControl::default();
    assert_eq!(rig.hear(SECOND, &QueryControl), [told(SECOND, &nobody)]);
    let default = ReportAuthority { authority_code: 7 };
    assert_eq!(rig.hear(SECOND, &QueryAuthority), [told(SECOND, &default)]);
    rig.request(FIRST, 220);
    let first = ReportControl {
        subsystem_id: 42,
        node_id: 2,
        component_id: 1,
        authority_code: 220,
    };
    assert_eq!(rig.hear(SECOND, &QueryControl), [told(SECOND, &first)]);
    let timeout = ReportTimeout {
        timeout: report_timeout::Timeout(5),
    };
    assert_eq!(rig.hear(SECOND, &QueryTimeout), [told(SECOND, &timeout)]);
}

#[test]
fn release_is_answered_to_the_client_in_control_and_when_nobody_is() {
    let mut rig = Rig::ready();
    assert_eq!(rig.hear(SECOND, &ReleaseControl), []);
    let released = rejected(FIRST, Rejection::CONTROL_RELEASED);
    for _again in 0..2 {
        assert_eq!(
            rig.hear(FIRST, &ReleaseControl),
            std::slice::from_ref(&released)
        );
        assert_eq!((rig.controller(), rig.state()), (None, State::Standby));
    }
}

#[test]
fn control_that_is_not_renewed_times_out() {
    let settings = AccessControl::new().timeout(4);
    let mut rig = Rig::with(|stack| stack.management(Management::new().access_control(settings)));
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    assert_eq!(rig.pass(Duration::from_secs(4)), []);
    rig.request(FIRST, 100);
    assert_eq!(rig.pass(Duration::from_secs(4)), []);
    let lost = rejected(FIRST, Rejection::CONTROL_RELEASED);
    assert_eq!(rig.pass(Duration::from_secs(1)), [lost]);
    assert_eq!((rig.controller(), rig.state()), (None, State::Standby));
    assert_eq!(rig.pass(Duration::from_secs(60)), []);
}

#[test]
fn control_ends_at_its_timeout_without_any_other_reason_to_wake_up() {
    let access = AccessControl::new().timeout(3);
    assert!(Control::with_access_control(access).has_timeout());
    let mut rig = Rig::with(|stack| stack.access_control(access));
    rig.dead.push(FIRST);
    rig.request(FIRST, 1);
    let (to, lost) = rejected(FIRST, Rejection::CONTROL_RELEASED);
    let said = rig.run(Duration::from_secs(10));
    assert_eq!(said, [(Duration::from_millis(3750), to, lost)]);
    assert!(!Control::with_access_control(access.timeout(0)).has_timeout());
}

#[test]
fn by_default_control_ends_within_5_s_of_the_last_request() {
    let mut rig = Rig::ready();
    rig.run(Duration::from_millis(4990));
    assert_eq!(rig.state(), State::Ready);
    rig.run(Duration::from_millis(10));
    assert_eq!((rig.controller(), rig.state()), (None, State::Standby));
}

/// A component whose clients need not renew control.
fn lasting() -> Rig {
    let access = AccessControl::new().timeout(0);
    let mut rig = Rig::with(|stack| stack.management(Management::new().access_control(access)));
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    rig
}

#[test]
fn control_without_a_timeout_lasts_while_its_client_shows_life() {
    let mut rig = lasting();
    rig.run(Duration::from_secs(3600));
    assert_eq!(rig.state(), State::Ready);
}

#[test]
fn a_client_that_has_answered_before_and_is_silent_for_4_s_is_dead() {
    let mut rig = lasting();
    rig.run(Duration::from_secs(10));
    rig.dead.push(FIRST);
    // The last reply arrived at most a second before.
    rig.run(Duration::from_millis(4000));
    assert_eq!((rig.controller(), rig.state()), (None, State::Standby));
}

#[test]
fn a_client_that_never_answers_is_left_to_the_timeout() {
    let mut rig = lasting();
    rig.dead.push(FIRST);
    rig.run(Duration::from_secs(600));
    assert_eq!(rig.state(), State::Ready);
}

#[test]
fn acknowledgements_are_signs_of_life_of_a_client_that_answers_no_probe() {
    let mut rig = lasting();
    rig.dead.push(FIRST);
    for _second in 0..20 {
        rig.run(Duration::from_secs(1));
        rig.stack.handle_acknowledged(rig.now, FIRST);
    }
    assert_eq!(rig.state(), State::Ready);
    rig.run(Duration::from_secs(4));
    assert_eq!((rig.controller(), rig.state()), (None, State::Standby));
}

#[test]
fn acknowledgements_are_no_signs_of_life_of_a_client_that_has_answered_before() {
    let mut rig = lasting();
    rig.run(Duration::from_secs(10));
    rig.dead.push(FIRST);
    for _second in 0..4 {
        rig.run(Duration::from_secs(1));
        rig.stack.handle_acknowledged(rig.now, FIRST);
    }
    assert_eq!(
        rig.state(),
        State::Standby,
        "its node acknowledges, and it hangs"
    );
}

#[test]
fn the_emergency_of_a_dead_client_is_cleared_by_the_client_in_control() {
    let mut rig = lasting();
    rig.hear(THIRD, &STOP);
    rig.hear(FIRST, &CLEAR);
    assert_eq!(rig.state(), State::Emergency, "its setter lives");
    rig.dead.push(THIRD);
    rig.run(Duration::from_secs(5));
    rig.hear(SECOND, &CLEAR);
    assert_eq!(rig.state(), State::Emergency, "it is not in control");
    rig.hear(FIRST, &CLEAR);
    assert_eq!(
        (rig.controller(), rig.state()),
        (Some((FIRST, 100)), State::Standby)
    );
}

#[test]
fn a_forged_emergency_without_a_client_in_control_can_be_cleared_too() {
    let mut rig = Rig::managed();
    rig.dead.push(THIRD);
    rig.hear(THIRD, &STOP);
    let refused = confirmed(FIRST, Confirmation::NOT_AVAILABLE);
    assert_eq!(rig.request(FIRST, 100), [refused]);
    rig.run(Duration::from_secs(4));
    assert_eq!(
        rig.request(FIRST, 100),
        [confirmed(FIRST, Confirmation::CONTROL_ACCEPTED)]
    );
    assert_eq!(rig.state(), State::Emergency);
    rig.hear(FIRST, &CLEAR);
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn a_setter_that_shows_life_again_is_alive() {
    let mut rig = lasting();
    rig.hear(THIRD, &STOP);
    rig.dead.push(THIRD);
    rig.run(Duration::from_secs(10));
    rig.dead.clear();
    rig.hear(THIRD, &QueryStatus);
    rig.hear(FIRST, &CLEAR);
    assert_eq!(rig.state(), State::Emergency);
}

#[test]
fn any_message_of_a_setter_shows_its_life_before_it_is_answered() {
    let refused = confirmed(THIRD, Confirmation::NOT_AVAILABLE);
    let mut rig = Rig::managed();
    rig.hear(THIRD, &STOP);
    rig.dead.push(THIRD);
    rig.run(Duration::from_secs(10));
    rig.dead.clear();
    assert_eq!(rig.request(THIRD, 100), [refused], "in its own emergency");
    rig.dead.push(THIRD);
    rig.run(Duration::from_secs(10));
    rig.hear(THIRD, &QueryHeartbeatPulse);
    let refused = confirmed(FIRST, Confirmation::NOT_AVAILABLE);
    assert_eq!(rig.request(FIRST, 100), [refused]);
}

#[test]
fn a_managed_component_begins_in_standby_and_only_its_controller_moves_it() {
    let mut rig = Rig::managed();
    assert_eq!(rig.state(), State::Standby);
    rig.hear(FIRST, &Resume);
    assert_eq!(rig.state(), State::Standby, "nobody controls it");
    rig.request(FIRST, 100);
    rig.hear(SECOND, &Resume);
    assert_eq!(rig.state(), State::Standby, "somebody else does");
    rig.hear(FIRST, &Resume);
    assert_eq!(rig.state(), State::Ready);
    rig.hear(SECOND, &Standby);
    rig.hear(SECOND, &Reset);
    rig.hear(SECOND, &Shutdown);
    assert_eq!(rig.state(), State::Ready);
    rig.hear(FIRST, &Standby);
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn a_reset_drops_control_and_leads_to_standby() {
    let mut rig = Rig::ready();
    let lost = rejected(FIRST, Rejection::CONTROL_RELEASED);
    assert_eq!(rig.hear(FIRST, &Reset), [lost]);
    assert_eq!((rig.controller(), rig.state()), (None, State::Standby));
}

#[test]
fn a_component_that_initializes_cannot_be_controlled_before() {
    let mut rig = Rig::with(|stack| stack.management(Management::new().initializes()));
    let refused = confirmed(FIRST, Confirmation::NOT_AVAILABLE);
    assert_eq!(rig.request(FIRST, 100), [refused]);
    rig.stack.set_condition(rig.now, Condition::Initialized);
    assert_eq!(rig.state(), State::Standby);
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    rig.hear(FIRST, &Reset);
    assert_eq!(rig.state(), State::Initialize);
}

#[test]
fn shutdown_and_failure_end_control_for_good() {
    let ends: [fn(&mut Rig); 2] = [
        |rig| _ = rig.hear(FIRST, &Shutdown),
        |rig| rig.stack.set_condition(rig.now, Condition::Failed),
    ];
    for (end, state) in ends.iter().zip([State::Shutdown, State::Failure]) {
        let mut rig = Rig::ready();
        end(&mut rig);
        assert_eq!((rig.controller(), rig.state()), (None, state));
        rig.said();
        let refused = confirmed(FIRST, Confirmation::NOT_AVAILABLE);
        assert_eq!(rig.request(FIRST, 255), [refused]);
        rig.hear(FIRST, &Resume);
        assert_eq!(rig.state(), state);
    }
}

#[test]
fn what_the_application_tells_during_an_emergency_counts_afterwards() {
    for (told, before, after) in [
        (Condition::Initialized, State::Initialize, State::Standby),
        (Condition::Failed, State::Initialize, State::Failure),
        (Condition::Failed, State::Ready, State::Failure),
        (Condition::Initialized, State::Shutdown, State::Shutdown),
        (Condition::Failed, State::Shutdown, State::Shutdown),
        (Condition::Initialized, State::Failure, State::Standby),
        (Condition::Initialized, State::Ready, State::Standby),
    ] {
        let mut rig = Rig::brought_to(before);
        rig.hear(THIRD, &STOP);
        rig.stack.set_condition(rig.now, told);
        assert_eq!(rig.state(), State::Emergency);
        rig.hear(THIRD, &CLEAR);
        assert_eq!(rig.state(), after, "{told:?} after {before}");
    }
}

#[test]
fn a_failure_that_is_mended_leads_to_standby() {
    let mut rig = Rig::brought_to(State::Failure);
    rig.stack.set_condition(rig.now, Condition::Initialized);
    assert_eq!(rig.state(), State::Standby);
    let granted = confirmed(FIRST, Confirmation::CONTROL_ACCEPTED);
    assert_eq!(rig.request(FIRST, 100), [granted]);
}

/// The effect of each message, in each state, for each kind of sender.
#[test]
fn every_message_in_every_state_leads_where_the_clause_says_and_nowhere_else() {
    use State::{Emergency, Failure, Initialize, Ready, Shutdown as Down, Standby as Idle};
    const ALL: [State; 6] = [Initialize, Ready, Idle, Down, Failure, Emergency];
    type Send = fn(&mut Rig, JausId);
    type Leads = fn(State) -> State;
    let messages: [(&str, Send, Leads, Leads); 6] = [
        (
            "Resume",
            |rig, client| _ = rig.hear(client, &Resume),
            |state| if state == Idle { Ready } else { state },
            |state| state,
        ),
        (
            "Standby",
            |rig, client| _ = rig.hear(client, &Standby),
            |state| if state == Ready { Idle } else { state },
            |state| state,
        ),
        (
            "Reset",
            |rig, client| _ = rig.hear(client, &Reset),
            |state| match state {
                Ready | Idle => Initialize,
                other => other,
            },
            |state| state,
        ),
        (
            "Shutdown",
            |rig, client| _ = rig.hear(client, &Shutdown),
            |state| match state {
                Ready | Idle => Down,
                other => other,
            },
            |state| state,
        ),
        (
            "Set Emergency",
            |rig, client| _ = rig.hear(client, &STOP),
            |_| Emergency,
            |_| Emergency,
        ),
        (
            "Clear Emergency",
            |rig, client| _ = rig.hear(client, &CLEAR),
            |state| state,
            |state| state,
        ),
    ];
    for before in ALL {
        for (message, send, for_controller, for_others) in messages {
            for (client, leads) in [(FIRST, for_controller), (SECOND, for_others)] {
                let mut rig = Rig::brought_to(before);
                send(&mut rig, client);
                assert_eq!(
                    rig.state(),
                    leads(before),
                    "{message} of {client}, {before}"
                );
            }
        }
    }
}

#[test]
fn a_component_lists_the_services_of_its_settings() {
    type Settings = fn(Stack) -> Stack;
    let cases: [(Settings, &[&str]); 3] = [
        (|stack| stack, &[]),
        (
            |stack| stack.access_control(AccessControl::new()),
            &[access_control::URN],
        ),
        (
            |stack| stack.management(Management::new()),
            &[access_control::URN, management::URN],
        ),
    ];
    for (settings, expected) in cases {
        let mut rig = Rig::with(settings);
        let query = QueryServices {
            node_list: Vec::new(),
        };
        let answer = format!("{:?}", rig.hear(FIRST, &query));
        for urn in [access_control::URN, management::URN] {
            assert_eq!(answer.contains(urn), expected.contains(&urn), "{urn}");
        }
    }
}

#[test]
fn a_failed_component_is_failed_after_an_emergency_that_its_controller_cleared() {
    let mut rig = Rig::managed();
    rig.stack.set_condition(rig.now, Condition::Failed);
    rig.dead.push(THIRD);
    rig.hear(THIRD, &STOP);
    rig.run(Duration::from_secs(5));
    rig.request(FIRST, 100);
    rig.hear(FIRST, &CLEAR);
    assert_eq!((rig.controller(), rig.state()), (None, State::Failure));
}

#[test]
fn access_control_alone_leaves_a_component_ready_and_management_unanswered() {
    let mut rig = Rig::with(|stack| stack.access_control(AccessControl::new()));
    assert_eq!(rig.hear(FIRST, &QueryStatus), []);
    rig.hear(FIRST, &STOP);
    rig.request(FIRST, 100);
    rig.hear(FIRST, &ReleaseControl);
    assert_eq!(rig.state(), State::Ready);
}

#[test]
fn a_component_without_settings_obeys_anyone_and_answers_nothing() {
    let mut rig = Rig::with(|stack| stack);
    assert_eq!(rig.request(FIRST, 100), []);
    assert_eq!(*rig.stack.standing(), Now::default());
}
