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
    SessionOrder, SessionState, State,
};

const READY: SessionState = SessionState::Ready(PEER);
const STANDBY: SessionState = SessionState::Standby(PEER);

fn begin(bench: &mut Bench, retake: Retake) -> SessionId {
    let patience = Patience::default();
    let session = bench
        .stack
        .begin_session(bench.now, PEER.into(), 127, retake, patience);
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

/// A session whose peer is ready.
fn ready(retake: Retake) -> (Bench, SessionId) {
    let mut bench = Bench::new();
    let session = begin(&mut bench, retake);
    confirm(&mut bench, 0);
    report(&mut bench, State::Ready);
    assert_eq!(states(&mut bench), [READY]);
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

fn reject(bench: &mut Bench) {
    let response_code = 0.into();
    bench.hear(PEER, &RejectControl { response_code });
}

#[test]
fn a_session_takes_control_and_resumes_its_peer_until_that_is_ready() {
    let mut bench = Bench::new();
    begin(&mut bench, Retake::default());
    assert_eq!(bench.sent::<RequestControl>()[0].authority_code, 127);
    confirm(&mut bench, 0);
    for _ in 0..3 {
        assert_eq!(bench.sent::<Resume>().len(), 1);
        report(&mut bench, State::Standby);
        bench.run_ms(500);
    }
    assert_eq!(states(&mut bench), []);
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
        report_controller(&mut bench, JausId::from_u32(0));
        let restarted = SessionLoss::Control(ControlLost::Restarted);
        assert_eq!(states(&mut bench), [lost(restarted, continues)]);
        bench.sent.clear();
        bench.run_ms(250);
        assert_eq!(!bench.sent::<RequestControl>().is_empty(), continues);
        if !continues {
            order(&mut bench, session, SessionOrder::Retake);
            assert_eq!(states(&mut bench), [SessionState::Engaging]);
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
fn another_client_is_opposed_only_by_who_says_so() {
    for (retake, continues) in [(Retake::Unopposed, false), (Retake::Always, true)] {
        let (mut bench, session) = ready(retake);
        reject(&mut bench);
        let taken = SessionLoss::Control(ControlLost::TakenBack);
        assert_eq!(states(&mut bench), [lost(taken, continues)]);
        bench.run_ms(5000);
        assert_eq!(!bench.sent::<RequestControl>().is_empty(), continues);
        order(&mut bench, session, SessionOrder::Retake);
        assert!(continues || bench.sent::<RequestControl>().len() == 1);
    }
}

#[test]
fn who_had_to_give_way_decides_itself_when_the_peer_is_to_move_again() {
    let (mut bench, session) = ready(Retake::Always);
    reject(&mut bench);
    bench.run_ms(250);
    confirm(&mut bench, 0);
    report(&mut bench, State::Standby);
    assert_eq!(states(&mut bench).last(), Some(&STANDBY));
    assert!(bench.sent::<Resume>().is_empty());
    order(&mut bench, session, SessionOrder::Resume);
    assert_eq!(bench.sent::<Resume>().len(), 1);
    report(&mut bench, State::Ready);
    assert_eq!(
        states(&mut bench),
        [SessionState::Engaging, READY],
        "not standby, from the order on"
    );
}

#[test]
fn after_an_emergency_the_peer_stands_by_until_it_is_resumed() {
    let (mut bench, session) = ready(Retake::Always);
    report(&mut bench, State::Emergency);
    let emergency = SessionLoss::State(State::Emergency as u8);
    assert_eq!(states(&mut bench), [lost(emergency, true)]);
    assert_eq!(emergency.to_string(), "it reports emergency");
    bench.run_ms(2000);
    report(&mut bench, State::Standby);
    bench.run_ms(2000);
    assert_eq!(states(&mut bench), [STANDBY]);
    assert!(bench.sent::<Resume>().is_empty());
    order(&mut bench, session, SessionOrder::Resume);
    assert_eq!(bench.sent::<Resume>().len(), 1);
}

#[test]
fn a_peer_that_is_not_available_is_asked_again_after_growing_pauses() {
    let mut bench = Bench::new();
    begin(&mut bench, Retake::Unopposed);
    let mut pauses = Vec::new();
    for _ in 0..6 {
        bench.sent.clear();
        confirm(&mut bench, 1);
        let mut pause = 0;
        while bench.sent::<RequestControl>().is_empty() {
            bench.run_ms(10);
            pause += 10;
        }
        pauses.push(pause);
    }
    assert_eq!(pauses, [250, 500, 1000, 2000, 2000, 2000]);
    let refused = SessionLoss::Refused(ControlRefused::NotAvailable);
    assert_eq!(states(&mut bench), [lost(refused, true)]);
    confirm(&mut bench, 0);
    report(&mut bench, State::Standby);
    assert_eq!(states(&mut bench), [SessionState::Engaging, STANDBY]);
}

#[test]
fn standby_is_repeated_until_the_peer_reports_it() {
    let (mut bench, session) = ready(Retake::Unopposed);
    order(&mut bench, session, SessionOrder::Standby);
    assert_eq!(states(&mut bench), [SessionState::Engaging]);
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
    reject(&mut bench);
    assert_eq!(states(&mut bench), [SessionState::Released]);
    bench.run_ms(20_000);
    assert!(bench.sent::<RequestControl>().is_empty());
}

#[test]
fn a_member_is_found_when_it_appears_and_left_when_it_is_gone() {
    let mut bench = Bench::looking_for(Scope::System);
    let vehicle = Audience::subsystem(PEER.subsystem());
    let (retake, patience) = (Retake::default(), Patience::default());
    bench
        .stack
        .begin_session(bench.now, vehicle, 127, retake, patience);
    bench.run_ms(5000);
    assert!(bench.sent::<RequestControl>().is_empty());
    identify(&mut bench);
    assert_eq!(bench.sent::<RequestControl>().len(), 1);
    confirm(&mut bench, 0);
    report(&mut bench, State::Ready);
    assert_eq!(states(&mut bench), [READY]);
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
    let session = begin(&mut bench, Retake::default());
    confirm(&mut bench, 0);
    assert_eq!(states(&mut bench), [READY]);
    order(&mut bench, session, SessionOrder::Standby);
    assert_eq!(states(&mut bench), [STANDBY]);
    order(&mut bench, session, SessionOrder::Resume);
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
