//! Sessions against a scripted peer.

use super::{Bench, OTHER, PEER};
use crate::address::JausId;
use crate::messages::core::{
    ConfirmControl, QueryControl, RejectControl, ReleaseControl, ReportControl,
    ReportIdentification, ReportServices, ReportStatus, RequestControl, Resume, Standby,
    access_control, report_services,
};
use crate::service::{
    Audience, ControlLost, ControlRefused, Event, Patience, Retake, Scope, SessionId, SessionLoss,
    SessionOrder, SessionSettings, SessionState, State, TargetState,
};

const READY: SessionState = SessionState::Ready(PEER);
const STANDBY: SessionState = SessionState::Standby(PEER);
const REQUESTING: SessionState = SessionState::Requesting(PEER);
const PREPARING: SessionState = SessionState::Preparing(PEER);
const RESUME: SessionOrder = SessionOrder::Target(TargetState::Ready);
const NOBODY: JausId = JausId::from_u32(0);

fn begin(bench: &mut Bench, settings: SessionSettings) -> SessionId {
    let patience = Patience::default();
    let session = bench
        .stack
        .begin_session(bench.now, PEER.into(), settings, patience);
    bench.collect();
    session
}

fn order(bench: &mut Bench, session: SessionId, order: SessionOrder) {
    bench.stack.order_session(bench.now, session, order);
    bench.collect();
}

fn confirm(bench: &mut Bench, code: u8) {
    let response_code = code.into();
    bench.hear(PEER, &ConfirmControl { response_code });
}

fn report(bench: &mut Bench, state: State) {
    let status = ReportStatus {
        status: (state as u8).into(),
        ..ReportStatus::default()
    };
    bench.hear(PEER, &status);
}

fn report_controller(bench: &mut Bench, controller: JausId) {
    let report = ReportControl {
        subsystem_id: controller.subsystem(),
        node_id: controller.node(),
        component_id: controller.component(),
        ..ReportControl::default()
    };
    bench.hear(PEER, &report);
}

/// The answers of a peer that is examined.
fn explain(bench: &mut Bench, state: State, controller: JausId) {
    report_controller(bench, controller);
    report(bench, state);
}

fn with(retake: Retake) -> SessionSettings {
    SessionSettings::new(127).retake(retake)
}

/// A session whose peer is ready.
fn ready(retake: Retake) -> (Bench, SessionId) {
    let mut bench = Bench::new();
    let session = begin(&mut bench, with(retake));
    confirm(&mut bench, 0);
    report(&mut bench, State::Ready);
    assert_eq!(states(&mut bench), [REQUESTING, PREPARING, READY]);
    bench.sent.clear();
    (bench, session)
}

fn states(bench: &mut Bench) -> Vec<SessionState> {
    let events = bench.events().into_iter();
    events
        .filter_map(|event| match event {
            Event::Session(_, state) => Some(state),
            _ => None,
        })
        .collect()
}

fn lost(why: SessionLoss, continues: bool) -> SessionState {
    SessionState::Lost {
        peer: PEER,
        why,
        continues,
    }
}

fn identify(bench: &mut Bench) {
    let identified = ReportIdentification {
        query_type: 4.into(),
        r#type: 60001.into(),
        identification: "Rover".into(),
    };
    bench.hear(PEER, &identified);
}

fn reject(bench: &mut Bench, code: u8) {
    let response_code = code.into();
    bench.hear(PEER, &RejectControl { response_code });
}

#[test]
fn a_session_takes_control_and_resumes_its_peer_until_that_is_ready() {
    let mut bench = Bench::new();
    begin(&mut bench, 127.into());
    assert_eq!(bench.sent::<RequestControl>()[0].authority_code, 127);
    confirm(&mut bench, 0);
    for _ in 0..3 {
        assert_eq!(bench.sent::<Resume>().len(), 1);
        report(&mut bench, State::Standby);
        bench.run_ms(500);
    }
    assert_eq!(states(&mut bench), [REQUESTING, PREPARING]);
    report(&mut bench, State::Ready);
    assert_eq!(states(&mut bench), [READY]);
    bench.sent.clear();
    bench.run_ms(3000);
    assert!(bench.sent::<Resume>().is_empty());
}

#[test]
fn a_restarted_peer_is_controlled_and_resumed_again_unless_that_is_not_wanted() {
    for (retake, continues) in [(Retake::Never, false), (Retake::Unopposed, true)] {
        let (mut bench, session) = ready(retake);
        bench.run_ms(300);
        assert!(!bench.sent::<QueryControl>().is_empty());
        report_controller(&mut bench, NOBODY);
        explain(&mut bench, State::Standby, NOBODY);
        let restarted = SessionLoss::Control(ControlLost::Restarted);
        assert_eq!(states(&mut bench), [REQUESTING, lost(restarted, continues)]);
        bench.run_ms(250);
        bench.sent.clear();
        explain(&mut bench, State::Standby, NOBODY);
        assert_eq!(!bench.sent::<RequestControl>().is_empty(), continues);
        if !continues {
            order(&mut bench, session, SessionOrder::Retake);
            assert_eq!(states(&mut bench), [REQUESTING]);
            assert_eq!(bench.sent::<RequestControl>().len(), 1);
        }
        bench.sent.clear();
        confirm(&mut bench, 0);
        assert_eq!(bench.sent::<Resume>().len(), 1);
        report(&mut bench, State::Ready);
        assert_eq!(states(&mut bench).last(), Some(&READY));
    }
}

#[test]
fn a_restart_shows_as_soon_as_the_status_changes() {
    let (mut bench, _) = ready(Retake::Unopposed);
    report(&mut bench, State::Standby);
    assert_eq!(bench.sent::<QueryControl>().len(), 1);
}

#[test]
fn another_client_is_opposed_only_by_who_says_so() {
    for (retake, continues) in [(Retake::Unopposed, false), (Retake::Always, true)] {
        let (mut bench, session) = ready(retake);
        reject(&mut bench, 0);
        explain(&mut bench, State::Ready, OTHER);
        let taken = SessionLoss::Taken(OTHER);
        assert_eq!(states(&mut bench), [REQUESTING, lost(taken, continues)]);
        bench.run_ms(5000);
        assert_eq!(!bench.sent::<RequestControl>().is_empty(), continues);
        order(&mut bench, session, SessionOrder::Retake);
        assert!(continues || bench.sent::<RequestControl>().len() == 1);
    }
}

#[test]
fn who_had_to_give_way_decides_itself_when_the_peer_is_to_move_again() {
    let (mut bench, session) = ready(Retake::Always);
    reject(&mut bench, 0);
    explain(&mut bench, State::Ready, OTHER);
    bench.run_ms(250);
    explain(&mut bench, State::Ready, OTHER);
    confirm(&mut bench, 0);
    report(&mut bench, State::Standby);
    assert_eq!(states(&mut bench).last(), Some(&STANDBY));
    assert!(bench.sent::<Resume>().is_empty());
    order(&mut bench, session, RESUME);
    assert_eq!(bench.sent::<Resume>().len(), 1);
    report(&mut bench, State::Ready);
    assert_eq!(
        states(&mut bench),
        [PREPARING, READY],
        "not standby, from the order on"
    );
}

#[test]
fn after_an_emergency_the_peer_stands_by_until_it_is_resumed() {
    let (mut bench, session) = ready(Retake::Always);
    report(&mut bench, State::Emergency);
    let emergency = SessionState::Disabled {
        peer: PEER,
        state: State::Emergency as u8,
    };
    assert_eq!(states(&mut bench), [emergency]);
    assert_eq!(emergency.to_string(), "101.1.33 reports emergency");
    order(&mut bench, session, RESUME);
    bench.run_ms(2000);
    report(&mut bench, State::Standby);
    bench.run_ms(2000);
    assert_eq!(states(&mut bench), [STANDBY]);
    let too_early = bench.sent::<Resume>();
    assert!(too_early.is_empty(), "resumed while it was stopped");
    order(&mut bench, session, RESUME);
    assert_eq!(bench.sent::<Resume>().len(), 1);
}

#[test]
fn a_peer_that_is_not_available_is_asked_again_after_growing_pauses() {
    let mut bench = Bench::new();
    begin(&mut bench, 127.into());
    let mut pauses = Vec::new();
    for _ in 0..6 {
        bench.sent.clear();
        confirm(&mut bench, 1);
        explain(&mut bench, State::Standby, NOBODY);
        bench.sent.clear();
        let mut pause = 0;
        while bench.sent::<QueryControl>().is_empty() {
            bench.run_ms(10);
            pause += 10;
        }
        explain(&mut bench, State::Standby, NOBODY);
        assert_eq!(bench.sent::<RequestControl>().len(), 1);
        pauses.push(pause);
    }
    assert_eq!(pauses, [250, 500, 1000, 2000, 2000, 2000]);
    let refused = SessionLoss::Refused(ControlRefused::NotAvailable);
    assert_eq!(states(&mut bench), [REQUESTING, lost(refused, true)]);
    confirm(&mut bench, 0);
    report(&mut bench, State::Standby);
    assert_eq!(states(&mut bench), [PREPARING, STANDBY]);
}

#[test]
fn standby_is_repeated_until_the_peer_reports_it() {
    let (mut bench, session) = ready(Retake::Unopposed);
    order(
        &mut bench,
        session,
        SessionOrder::Target(TargetState::Standby),
    );
    assert_eq!(states(&mut bench), [PREPARING]);
    bench.run_ms(600);
    assert_eq!(bench.sent::<Standby>().len(), 2);
    report(&mut bench, State::Standby);
    assert_eq!(states(&mut bench), [STANDBY]);
    bench.run_ms(2000);
    assert!(bench.sent::<Standby>().is_empty() && bench.sent::<Resume>().is_empty());
}

#[test]
fn a_session_is_over_once_its_peer_has_confirmed_the_release() {
    let (mut bench, session) = ready(Retake::Unopposed);
    bench.stack.release_session(bench.now, session);
    bench.collect();
    assert_eq!(bench.sent::<ReleaseControl>().len(), 1);
    assert_eq!(states(&mut bench), []);
    reject(&mut bench, 0);
    assert_eq!(states(&mut bench), [SessionState::Released]);
    bench.run_ms(20_000);
    assert!(bench.sent::<RequestControl>().is_empty());
}

#[test]
fn a_member_is_found_when_it_appears_and_left_when_it_is_gone() {
    let mut bench = Bench::looking_for(Scope::System);
    let vehicle = Audience::subsystem(PEER.subsystem());
    let patience = Patience::default();
    bench
        .stack
        .begin_session(bench.now, vehicle, 127.into(), patience);
    bench.run_ms(5000);
    assert!(bench.sent::<RequestControl>().is_empty());
    identify(&mut bench);
    assert_eq!(bench.sent::<RequestControl>().len(), 1);
    confirm(&mut bench, 0);
    report(&mut bench, State::Ready);
    assert_eq!(states(&mut bench), [REQUESTING, PREPARING, READY]);
    bench.run_ms(20_000);
    let SessionState::Lost { why, .. } = states(&mut bench)[0] else {
        panic!("its peer is silent");
    };
    assert!(matches!(why, SessionLoss::Control(ControlLost::Silent(_))));
    bench.run_ms(60_000);
    assert!(!bench.sent::<RequestControl>().is_empty());
    bench.run_ms(5000);
    let asked = bench.sent::<RequestControl>();
    assert!(asked.is_empty(), "it has left the directory");
    identify(&mut bench);
    explain(&mut bench, State::Standby, NOBODY);
    assert_eq!(bench.sent::<RequestControl>().len(), 1, "it is back");
}

#[test]
fn a_peer_without_states_obeys_once_it_is_under_control_and_the_session_stands_by_for_it() {
    let mut bench = Bench::looking_for(Scope::System);
    identify(&mut bench);
    let access_control = report_services::ServiceRec {
        uri: access_control::URN.into(),
        major_version_number: 1,
        minor_version_number: 1,
    };
    let component = report_services::ComponentSeq {
        component_rec: report_services::ComponentRec {
            component_id: PEER.component(),
            instance_id: 0,
        },
        service_list: vec![access_control],
    };
    let node = report_services::NodeSeq {
        node_rec: report_services::NodeRec {
            node_id: PEER.node(),
        },
        component_list: vec![component],
    };
    let node_list = vec![node];
    bench.hear(PEER, &ReportServices { node_list });
    let session = begin(&mut bench, 127.into());
    confirm(&mut bench, 0);
    assert_eq!(states(&mut bench), [REQUESTING, READY]);
    order(
        &mut bench,
        session,
        SessionOrder::Target(TargetState::Standby),
    );
    assert_eq!(states(&mut bench), [STANDBY]);
    order(&mut bench, session, RESUME);
    assert_eq!(states(&mut bench), [READY]);
    assert!(bench.sent::<Resume>().is_empty() && bench.sent::<Standby>().is_empty());
}

#[test]
fn what_others_say_does_not_move_a_session() {
    let (mut bench, _) = ready(Retake::Unopposed);
    let response_code = 0.into();
    bench.hear(OTHER, &RejectControl { response_code });
    assert_eq!(states(&mut bench), []);
}

#[test]
fn a_loss_is_explained_by_what_the_peer_reports() {
    let taken_back = SessionLoss::Control(ControlLost::TakenBack);
    let no_longer = SessionLoss::Control(ControlLost::NotAvailable);
    let failed = SessionLoss::State(State::Failure as u8);
    let stopped = SessionLoss::State(State::Emergency as u8);
    for (code, state, controller, why, continues) in [
        (0, State::Ready, OTHER, SessionLoss::Taken(OTHER), false),
        (0, State::Standby, NOBODY, SessionLoss::Dropped, true),
        (1, State::Failure, NOBODY, failed, true),
        (0, State::Emergency, NOBODY, stopped, true),
        (1, State::Standby, NOBODY, no_longer, true),
    ] {
        let (mut bench, _) = ready(Retake::Unopposed);
        reject(&mut bench, code);
        assert_eq!(states(&mut bench), [REQUESTING]);
        assert_eq!(bench.sent::<QueryControl>().len(), 1);
        explain(&mut bench, state, controller);
        assert_eq!(states(&mut bench), [lost(why, continues)]);
    }
    let (mut bench, _) = ready(Retake::Unopposed);
    reject(&mut bench, 0);
    bench.run_ms(500);
    let silent = [REQUESTING, lost(taken_back, true)];
    assert_eq!(states(&mut bench), silent, "it does not answer");
    bench.run_ms(250);
    explain(&mut bench, State::Standby, OTHER);
    let taken = lost(SessionLoss::Taken(OTHER), false);
    assert_eq!(states(&mut bench), [taken], "it answers later");
}

#[test]
fn after_an_unexplained_loss_a_client_that_is_found_later_counts() {
    let (mut bench, _) = ready(Retake::Always);
    reject(&mut bench, 0);
    bench.run_ms(750);
    explain(&mut bench, State::Ready, OTHER);
    bench.sent.clear();
    confirm(&mut bench, 0);
    report(&mut bench, State::Standby);
    assert_eq!(states(&mut bench).last(), Some(&STANDBY));
    assert!(bench.sent::<Resume>().is_empty());
}

#[test]
fn a_failed_peer_is_resumed_when_it_has_recovered_and_a_stopped_one_is_not() {
    for (state, is_resumed) in [(State::Failure, true), (State::Emergency, false)] {
        let (mut bench, _) = ready(Retake::Unopposed);
        reject(&mut bench, 1);
        explain(&mut bench, state, NOBODY);
        bench.run_ms(250);
        explain(&mut bench, state, NOBODY);
        assert!(bench.sent::<RequestControl>().is_empty(), "not in {state}");
        bench.run_ms(500);
        explain(&mut bench, State::Standby, NOBODY);
        assert_eq!(bench.sent::<RequestControl>().len(), 1);
        confirm(&mut bench, 0);
        report(&mut bench, State::Standby);
        assert_eq!(!bench.sent::<Resume>().is_empty(), is_resumed, "{state}");
    }
}

/// A session whose peer has ended control and is in this state.
fn dropped(loss: State) -> (Bench, SessionId) {
    let (mut bench, session) = ready(Retake::Always);
    reject(&mut bench, 1);
    explain(&mut bench, loss, NOBODY);
    let state = states(&mut bench).pop();
    assert!(
        matches!(
            state,
            Some(SessionState::Lost {
                continues: true,
                ..
            })
        ),
        "{state:?}"
    );
    (bench, session)
}

/// Control is granted to a session that has lost it, and the peer stands by.
fn grant_again(bench: &mut Bench) {
    bench.run_ms(250);
    explain(bench, State::Standby, NOBODY);
    bench.sent.clear();
    confirm(bench, 0);
    report(bench, State::Standby);
}

#[test]
fn a_target_that_is_set_while_the_peer_is_lost_holds_when_it_is_under_control_again() {
    for (target, resumes) in [(TargetState::Ready, 1), (TargetState::Standby, 0)] {
        let (mut bench, session) = dropped(State::Standby);
        order(&mut bench, session, SessionOrder::Target(target));
        grant_again(&mut bench);
        assert_eq!(bench.sent::<Resume>().len(), resumes, "{target:?}");
    }
}

#[test]
fn a_peer_that_was_lost_in_an_emergency_is_not_resumed_by_an_order_given_before_its_end() {
    let (mut bench, session) = dropped(State::Emergency);
    order(&mut bench, session, RESUME);
    grant_again(&mut bench);
    assert!(bench.sent::<Resume>().is_empty());
    order(&mut bench, session, RESUME);
    assert_eq!(bench.sent::<Resume>().len(), 1);
}

#[test]
fn a_peer_is_not_taken_from_a_client_that_has_it_meanwhile() {
    for retake in [Retake::Unopposed, Retake::WhenFree] {
        let (mut bench, session) = ready(retake);
        reject(&mut bench, 0);
        explain(&mut bench, State::Standby, NOBODY);
        bench.run_ms(250);
        explain(&mut bench, State::Ready, OTHER);
        let waits = retake == Retake::WhenFree;
        let taken = lost(SessionLoss::Taken(OTHER), waits);
        assert_eq!(states(&mut bench).last(), Some(&taken));
        bench.sent.clear();
        bench.run_ms(500);
        assert_eq!(!bench.sent::<QueryControl>().is_empty(), waits);
        explain(&mut bench, State::Standby, NOBODY);
        assert_eq!(!bench.sent::<RequestControl>().is_empty(), waits);
        if !waits {
            order(&mut bench, session, SessionOrder::Retake);
            assert_eq!(bench.sent::<RequestControl>().len(), 1, "it is asked to");
        }
        confirm(&mut bench, 0);
        report(&mut bench, State::Standby);
        let last = *states(&mut bench).last().expect("a state");
        assert_eq!(last, STANDBY, "the other client may have stopped it");
    }
}

#[test]
fn a_peer_that_another_client_has_at_first_is_made_ready_once_it_is_free() {
    let mut bench = Bench::new();
    begin(&mut bench, with(Retake::WhenFree));
    confirm(&mut bench, 2);
    explain(&mut bench, State::Ready, OTHER);
    bench.run_ms(250);
    explain(&mut bench, State::Standby, NOBODY);
    bench.sent.clear();
    confirm(&mut bench, 0);
    assert_eq!(bench.sent::<Resume>().len(), 1);
}

#[test]
fn a_peer_is_left_as_it_is_found() {
    let mut bench = Bench::new();
    let settings = SessionSettings::new(127).target(TargetState::AsFound);
    let session = begin(&mut bench, settings);
    confirm(&mut bench, 0);
    for (state, told) in [(State::Standby, STANDBY), (State::Ready, READY)] {
        report(&mut bench, state);
        assert_eq!(states(&mut bench).last(), Some(&told));
        bench.run_ms(1000);
    }
    assert!(bench.sent::<Resume>().is_empty());
    order(
        &mut bench,
        session,
        SessionOrder::Target(TargetState::Standby),
    );
    assert_eq!(bench.sent::<Standby>().len(), 1);
}
