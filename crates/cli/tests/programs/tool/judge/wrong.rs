//! The judge reports every fault of a peer with the right reason.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::Outgoing;
use jaus::link::Group;
use jaus::messages::core::confirm_control::ResponseCode;
use jaus::messages::core::report_status::Status;
use jaus::messages::core::{
    ConfirmControl, ConfirmEventRequest, CreateEvent, QueryAuthority, QueryControl,
    QueryHeartbeatPulse, QueryStatus, ReportAuthority, ReportControl, ReportHeartbeatPulse,
    ReportStatus, RequestControl, access_control, events, liveness, management,
};
use jaus::messages::mobility::{
    QueryLocalPose, QueryVelocityState, QueryWrenchEffort, ReportLocalPose, ReportVelocityState,
    ReportWrenchEffort, local_pose_sensor, primitive_driver, velocity_state_sensor,
};
use jaus::node::{Config, Node};

use crate::support::run;
use crate::tool::judge::peer::{Peer, network};

/// The judge's second component.
const FIRST: JausId = JausId::new(42, 2, 1);

/// Runs one step, with its prerequisites, against a peer. Returns the reason of the failure.
#[track_caller]
fn reason(step: &str, peer: Peer) -> String {
    reason_with(&["--only", step], step, peer)
}

#[track_caller]
fn reason_with(steps: &[&str], step: &str, peer: Peer) -> String {
    let flags = network();
    let _peer = peer.start(&flags);
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = ["judge", "105.1.1", "--unicast", "--timeout", "1s", "--json"];
    let run = run(&[&judge, steps, &*network].concat(), b"");
    assert_eq!(run.status, 1, "{run:?}");
    let lines = run.json();
    let judged = lines.iter().find(|line| line["step"] == step);
    let judged = judged.unwrap_or_else(|| panic!("no {step} in {run:?}"));
    assert_eq!(judged["verdict"], "failed", "{judged}");
    judged["reason"].as_str().unwrap().to_owned()
}

fn in_control(id: JausId, authority_code: u8) -> ReportControl {
    ReportControl {
        subsystem_id: id.subsystem(),
        node_id: id.node(),
        component_id: id.component(),
        authority_code,
    }
}

fn responds(response_code: ResponseCode) -> ConfirmControl {
    ConfirmControl { response_code }
}

#[test]
fn silence_is_told_with_who_had_to_say_what_to_whom_and_how_long_was_waited() {
    let peer = Peer::offering(&[access_control::URN]);
    assert_eq!(
        reason("B13", peer),
        "no ReportControl reached 42.2.1 within 1 s"
    );
}

#[test]
fn a_peer_that_falls_silent_is_said_to_and_no_later_step_fails() {
    let peer = Peer::offering(&[access_control::URN]).falls_silent_at::<QueryControl>();
    let flags = network();
    let _peer = peer.start(&flags);
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = ["judge", "105.1.1", "--unicast", "--timeout", "1s", "--json"];
    let run = run(
        &[&judge, &["--only", "B1-B16"][..], &*network].concat(),
        b"",
    );
    let lines = run.json();
    let failed: Vec<_> = lines
        .iter()
        .filter(|it| it["verdict"] == "failed")
        .collect();
    let silenced = failed.last().unwrap_or_else(|| panic!("{run:?}"));
    let reason = silenced["reason"].as_str().unwrap();
    assert!(
        reason.ends_with("; it answers no query any more: it hangs, or has ended"),
        "{reason}"
    );
    let place = lines.iter().position(|it| it == *silenced).unwrap();
    let later = lines[place + 1..]
        .iter()
        .filter(|it| it["step"].is_string());
    let reasons: Vec<_> = later.map(|it| it["reason"].as_str().unwrap()).collect();
    let since = format!("silent since {}", silenced["step"].as_str().unwrap());
    assert!(!reasons.is_empty(), "{run:?}");
    assert!(
        reasons
            .iter()
            .all(|it| *it == since || it.ends_with("is not offered")),
        "{reasons:?}"
    );
    assert_eq!(run.status, 1);
}

#[test]
fn another_node_with_the_judge_s_id_is_named_instead_of_blaming_the_subject() {
    let flags = network();
    let _peer = Peer::offering(&[liveness::URN]).start(&flags);
    let group: Group = flags.last().unwrap().parse().unwrap();
    let over = Arc::new(AtomicBool::new(false));
    let is_over = over.clone();
    let other = std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build();
        runtime.unwrap().block_on(async {
            let node = Node::start(Config::loopback(42, 1).group(group)).unwrap();
            let port = node.attach(1).unwrap();
            let pulse = QueryHeartbeatPulse.encode().unwrap();
            while !is_over.load(Ordering::Relaxed) {
                let said = Outgoing::new(port.id(), JausId::EVERYONE, pulse.clone());
                port.send(said).unwrap();
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        });
    });
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = ["judge", "105.1.1", "--id", "42.1.1"];
    let run = run(&[&judge, &*network].concat(), b"");
    over.store(true, Ordering::Relaxed);
    other.join().unwrap();
    assert!(
        run.stderr.contains("also has the judge's id 42.1.1"),
        "{run:?}"
    );
    assert_eq!(run.status, 2, "{run:?}");
}

#[test]
fn an_answer_after_the_limit_is_none() {
    let peer = Peer::offering(&[access_control::URN])
        .answers::<QueryControl>(&in_control(JausId::new(0, 0, 0), 0))
        .late(Duration::from_millis(1500));
    assert_eq!(
        reason("B13", peer),
        "no ReportControl reached 42.2.1 within 1 s"
    );
}

#[test]
fn an_answer_to_another_than_who_asked_is_told() {
    let nobody = in_control(JausId::new(0, 0, 0), 0);
    let peer = Peer::offering(&[access_control::URN])
        .answers_to::<QueryControl>(JausId::new(42, 1, 1), &nobody);
    assert_eq!(
        reason("B13", peer),
        "no ReportControl reached 42.2.1 within 1 s, but ReportControl to 42.1.1"
    );
}

#[test]
fn another_answer_than_the_one_that_must_come_is_told() {
    let peer =
        Peer::offering(&[events::URN]).answers::<CreateEvent>(&ConfirmEventRequest::default());
    assert_eq!(
        reason("B7", peer),
        "no RejectEventRequest reached 42.1.1 within 1 s, but ConfirmEventRequest to 42.1.1"
    );
}

#[test]
fn octets_that_are_no_message_are_told_with_the_field_at_fault() {
    let octets = Bytes::from_static(&[0x02, 0x40, 0x02]);
    let peer = Peer::offering(&[management::URN]).answers_octets(QueryStatus::CODE, octets);
    let reason = reason("B20", peer);
    assert!(reason.starts_with("ReportStatus: "), "{reason}");
    assert!(reason.contains("Reserved"), "{reason}");
}

#[test]
fn wrong_fields_are_told_with_what_they_must_be() {
    let access = || Peer::offering(&[access_control::URN]);
    let somebody = JausId::new(7, 1, 1);
    let standby = ReportStatus {
        status: Status::STANDBY,
        reserved: 0,
    };
    let faults = [
        (
            "B13",
            access().answers::<QueryControl>(&in_control(somebody, 5)),
            "ReportControl: 7.1.1 is in control; expected none (0.0.0)",
        ),
        (
            "B14",
            access().answers::<RequestControl>(&responds(ResponseCode::CONTROL_ACCEPTED)),
            "ConfirmControl: the response code is 0, not 2",
        ),
        (
            "B16",
            access()
                .answers::<RequestControl>(&responds(ResponseCode::CONTROL_ACCEPTED))
                .answers::<QueryControl>(&in_control(FIRST, 220))
                .answers::<QueryAuthority>(&ReportAuthority {
                    authority_code: 220,
                }),
            "ReportAuthority: the authority is 220, not 219",
        ),
        (
            "B20",
            Peer::offering(&[management::URN]).answers::<QueryStatus>(&standby),
            "ReportStatus: the status is 2 (standby), not 5 (emergency)",
        ),
        (
            "B33",
            Peer::offering(&[velocity_state_sensor::URN])
                .answers::<QueryVelocityState>(&ReportVelocityState::default()),
            "ReportVelocityState: the report is empty",
        ),
    ];
    for (step, peer, told) in faults {
        assert_eq!(reason(step, peer), told, "{step}");
    }
}

#[test]
fn a_command_that_must_be_ignored_and_is_not_is_told() {
    let at = |x, y| {
        let mut pose = ReportLocalPose::default();
        pose.set_x_m(x).unwrap();
        pose.set_y_m(y).unwrap();
        pose
    };
    let peer = Peer::offering(&[access_control::URN, local_pose_sensor::URN])
        .answers::<QueryLocalPose>(&at(0.0, 0.0))
        .answers::<QueryLocalPose>(&at(-1000.0, -1000.0));
    let reason = reason("B34", peer);
    assert!(
        reason.starts_with("ReportLocalPose: X is -1000"),
        "{reason}"
    );
}

#[test]
fn an_event_stream_that_is_confirmed_but_never_comes_is_told() {
    let mut confirmation = ConfirmEventRequest {
        request_id: 1,
        event_id: 7,
        ..ConfirmEventRequest::default()
    };
    confirmation.set_confirmed_periodic_rate_hz(1.0).unwrap();
    let peer = Peer::offering(&[events::URN, liveness::URN])
        .answers::<CreateEvent>(&confirmation)
        .answers::<QueryHeartbeatPulse>(&ReportHeartbeatPulse);
    assert_eq!(
        reason("B4", peer),
        "only 0 reports of event 7 arrived, not 3"
    );
}

/// A peer that answers truncated queries and then obeys clients that are not in control.
fn obedient() -> Peer {
    let effort = |x| {
        let mut report = ReportWrenchEffort::default();
        report.set_propulsive_linear_effort_x_percent(x).unwrap();
        report
    };
    let mut peer = Peer::offering(&[primitive_driver::URN]);
    for report in [0.0, 0.0, 0.0, 0.0, 25.0].map(effort) {
        peer = peer.answers::<QueryWrenchEffort>(&report);
    }
    peer
}

#[test]
fn a_service_that_answers_half_a_query_is_told() {
    let reason = reason_with(&["--service", "PrimitiveDriver"], "S2", obedient());
    assert_eq!(reason, "it was answered with ReportWrenchEffort");
}

#[test]
fn a_service_that_obeys_without_control_is_told_with_what_changed() {
    let reason = reason_with(&["--service", "PrimitiveDriver"], "S3", obedient());
    assert!(
        reason.starts_with("ReportWrenchEffort: it was {"),
        "{reason}"
    );
    assert!(
        reason.contains("\"PropulsiveLinearEffortX\":25"),
        "{reason}"
    );
}
