//! Exchanges of Liveness, transport acknowledgement, Access Control and Management. They send no
//! commands, and take control only if permitted.

use std::time::Duration;

use bytes::Bytes;
use jaus::messages::core::{
    ConfirmControl, QueryAuthority, QueryControl, QueryHeartbeatPulse, QueryStatus, RejectControl,
    ReleaseControl, ReportAuthority, ReportControl, ReportHeartbeatPulse, ReportStatus,
    RequestControl, confirm_control::ResponseCode,
};
use jaus::wire::Acknowledgement;

use super::case::{Case, Question, Send};
use super::discovery::shown;
use super::exchange::{Exchange, Mark, Verdict};
use super::judgement::{Begin, Judgement};

fn ask(case: &mut Case, message: &impl jaus::codec::Message) -> Begin {
    match case.ask_peer(message) {
        Some(send) => Begin::Ask(Question::new(send)),
        None => Begin::Over(Verdict::skipped("no component id is known at that address")),
    }
}

/// The reason to skip a service.
fn nobody_with(case: &Case, service: &str) -> Option<Verdict> {
    let nobody = case.nobody().or_else(|| case.mute());
    nobody.or_else(|| case.lacks(service))
}

pub(super) fn heartbeat(case: &mut Case) -> Begin {
    match case.nobody() {
        Some(skip) => Begin::Over(skip),
        None => ask(case, &QueryHeartbeatPulse),
    }
}

pub(super) fn beats(case: &mut Case, mark: usize) -> Judgement {
    match case.report::<ReportHeartbeatPulse>(mark) {
        Some(_) => Judgement::Over(Verdict::ok("Query Heartbeat Pulse is answered")),
        None => Judgement::Wait,
    }
}

pub(super) fn no_heartbeat(case: &Case) -> Verdict {
    Verdict::failed(
        format!("{} does not answer Query Heartbeat Pulse", shown(case)),
        "the component has no Liveness service",
        "clients that watch heartbeats consider it lost: let them watch its other reports",
    )
}

pub(super) fn acknowledgement(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    let (Some(id), Some(address)) = (case.id, case.address) else {
        return Begin::Over(Verdict::skipped("no component id is known at that address"));
    };
    let frame = case.wanting_acknowledgement(id);
    Begin::Ask(Question::new(Send::To(address, frame)))
}

pub(super) fn acknowledged(case: &mut Case, mark: usize) -> Judgement {
    let mut received = case.received(mark);
    let answer = received.find(|heard| heard.frame.flags.acknowledgement().is_answer());
    let verdict = match answer.map(|heard| &heard.frame) {
        None => return Judgement::Wait,
        Some(frame) if frame.flags.acknowledgement() == Acknowledgement::Negative => {
            Verdict::failed(
                "a message that requests acknowledgement gets a negative one",
                "the peer does not know the user-defined message, or cannot accept it now",
                "send to it without requesting acknowledgement",
            )
        }
        Some(frame) if !frame.payload.is_empty() => Verdict::failed(
            format!("its acknowledgement carries {} octets", frame.payload.len()),
            "the peer returns the message instead of an empty acknowledgement; JAUS++ and others \
             drop that",
            "send to it without requesting acknowledgement",
        ),
        Some(_) => Verdict::ok("a message that requests acknowledgement gets it"),
    };
    Judgement::Over(verdict)
}

pub(super) fn not_acknowledged(case: &Case) -> Verdict {
    Verdict::failed(
        format!("{} acknowledges nothing", shown(case)),
        "its transport does not implement acknowledgements, or sends them to another address",
        "send to it without requesting acknowledgement; large messages to it are then never \
         certain",
    )
}

pub(super) fn authority(case: &mut Case) -> Begin {
    match nobody_with(case, "AccessControl") {
        Some(skip) => Begin::Over(skip),
        None => ask(case, &QueryAuthority),
    }
}

pub(super) fn has_authority(case: &mut Case, mark: usize) -> Judgement {
    match case.report::<ReportAuthority>(mark) {
        Some(report) => Judgement::Over(Verdict::ok(format!(
            "its authority code is {}",
            report.authority_code
        ))),
        None => Judgement::Wait,
    }
}

pub(super) fn status(case: &mut Case) -> Begin {
    match nobody_with(case, "Management") {
        Some(skip) => Begin::Over(skip),
        None => ask(case, &QueryStatus),
    }
}

pub(super) fn has_status(case: &mut Case, mark: usize) -> Judgement {
    const NAMES: [&str; 6] = [
        "init",
        "ready",
        "standby",
        "shutdown",
        "failure",
        "emergency",
    ];
    let Some(report) = case.report::<ReportStatus>(mark) else {
        return Judgement::Wait;
    };
    let name = NAMES.get(usize::from(report.status.0));
    Judgement::Over(match name {
        Some(name) => Verdict::ok(*name),
        None => Verdict::ok(format!("{}, which has no name", report.status.0)),
    })
}

pub(super) fn control(case: &mut Case) -> Begin {
    match nobody_with(case, "AccessControl") {
        Some(skip) => Begin::Over(skip),
        None => ask(case, &QueryControl),
    }
}

/// The client in control, if any.
fn controller(report: &ReportControl) -> Option<String> {
    let (subsystem, node, component) = (report.subsystem_id, report.node_id, report.component_id);
    (subsystem != 0).then(|| format!("{subsystem}.{node}.{component}"))
}

pub(super) fn is_controlled(case: &mut Case, mark: usize) -> Judgement {
    let Some(report) = case.report::<ReportControl>(mark) else {
        return Judgement::Wait;
    };
    Judgement::Over(Verdict::ok(match controller(&report) {
        Some(who) => format!("{who} is in control"),
        None => "no client is in control".to_owned(),
    }))
}

/// The verdict on an unanswered query.
pub(super) fn silent(case: &Case, query: &str, service: &str) -> Verdict {
    let id = shown(case);
    if case.services.is_some() {
        return Verdict::failed(
            format!("{id} lists the service {service} but does not answer {query}"),
            "it implements the service only partly, or lost the query",
            "try again; `jaus record` at the peer shows whether the query arrives",
        );
    }
    Verdict::failed(
        format!("{id} does not answer {query}"),
        format!("the component has no {service} service"),
        "query the component that has it: `jaus discover` lists components with their services",
    )
}

/// Takes control, if permitted, with the least necessary authority, and only if no client has it.
pub(super) fn take_control(case: &mut Case) -> Begin {
    if let Some(skip) = nobody_with(case, "AccessControl") {
        return Begin::Over(skip);
    }
    if !case.settings.control {
        return Begin::Over(Verdict::skipped("only with --control"));
    }
    if let Some(who) = case
        .report::<ReportControl>(0)
        .as_ref()
        .and_then(controller)
    {
        return Begin::Over(Verdict::skipped(format!("{who} has control")));
    }
    let authority = case.report::<ReportAuthority>(0);
    let request = RequestControl {
        authority_code: authority.map_or(1, |report| report.authority_code.max(1)),
    };
    case.in_control = true;
    match case.ask_peer(&request) {
        Some(send) => Begin::Ask(Question::new(send)),
        None => Begin::Over(Verdict::skipped("no component id is known at that address")),
    }
}

/// First the confirmation, then the release.
pub(super) fn taking_control(case: &mut Case, mark: usize, stage: u8) -> Judgement {
    if stage > 0 {
        return match case.report::<RejectControl>(mark) {
            Some(_) => Judgement::Over(Verdict::ok("granted and released")),
            None => Judgement::Wait,
        };
    }
    let Some(confirm) = case.report::<ConfirmControl>(mark) else {
        return Judgement::Wait;
    };
    if confirm.response_code == ResponseCode::CONTROL_ACCEPTED {
        let send = release(case);
        return Judgement::Ask(Question {
            sends: send.into_iter().collect(),
            ..Question::silence(Duration::from_secs(1))
        });
    }
    case.in_control = false;
    let why = match confirm.response_code {
        ResponseCode::NOT_AVAILABLE => "it is not available",
        ResponseCode::INSUFFICIENT_AUTHORITY => "our authority is insufficient",
        _ => "an unknown reason",
    };
    Judgement::Over(Verdict::failed(
        format!("control is refused: {why}"),
        "a client with more authority has it, or the component cannot be controlled now",
        "find that client with `jaus query ID QueryControl`; raise our authority code",
    ))
}

pub(super) fn control_unanswered(case: &mut Case, stage: u8) -> Verdict {
    if stage == 0 {
        // Control may have been granted, and the answer lost.
        let send = release(case);
        case.unsent.extend(send);
        return Verdict::failed(
            "Request Control is not answered",
            "the component is not controlled by this service, or does not accept our id",
            "check the peer's access settings",
        );
    }
    Verdict::failed(
        "control was granted, but Release Control is not answered",
        "the peer sends no Reject Control when control is released",
        "do not wait for it; Query Control shows whether it is released",
    )
}

/// Releases control that may have been granted.
pub(super) fn release(case: &mut Case) -> Option<Send> {
    let held = std::mem::take(&mut case.in_control);
    held.then(|| case.ask_peer(&ReleaseControl)).flatten()
}

/// The answered queries, the best one for a subscription first.
pub(super) fn answered_query(case: &Case) -> Option<(Bytes, u16, &'static str)> {
    use jaus::codec::Message;

    use super::case::octets;
    if case.mark_of(Exchange::Status) == Some(Mark::Ok) {
        return Some((octets(&QueryStatus), ReportStatus::CODE, "Query Status"));
    }
    if case.mark_of(Exchange::Heartbeat) == Some(Mark::Ok) {
        let code = ReportHeartbeatPulse::CODE;
        return Some((octets(&QueryHeartbeatPulse), code, "Query Heartbeat Pulse"));
    }
    None
}
