//! Generates steps from a service's definition: its queries, and its commands without control.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::time::Duration;

use bytes::Bytes;
use jaus::codec::{Message, MessageInfo, ServiceInfo, report_code};
use jaus::messages::core::{
    CancelEvent, ClearEmergency, CreateCommandEvent, CreateEvent, QueryElement, RegisterServices,
    ReleaseControl, RequestControl, SetEmergency, UpdateEvent, access_control,
};
use jaus::messages::mobility::{
    QueryGlobalPathSegment, QueryGlobalPathSegmentExt, QueryGlobalWaypoint, QueryGlobalWaypointExt,
    QueryLocalPathSegment, QueryLocalPathSegmentExt, QueryLocalWaypoint, QueryLocalWaypointExt,
};
use jaus_vehicle::messages::handoff::{RemoveHandoffRequest, RequestHandoff};
use jaus_vehicle::messages::registry;
use serde_json::Value as Json;

use super::super::memory::Memory;
use super::super::step::{
    Act, Check, Exchange, Expectation, Part,
    Speaker::{Main, Second},
    Step, step,
};
use super::{specimen, transitions};

/// Required silence after a message that must be ignored.
const IGNORED: Duration = Duration::from_millis(300);
/// Tolerated drift of a number in a report, relative to its value …
const WANDERING: f64 = 0.02;
/// … and its minimum, in the number's unit.
const LEAST_WANDERING: f64 = 0.1;

/// Commands that do not require control.
const ANYBODYS: [u16; 11] = [
    CancelEvent::CODE,
    ClearEmergency::CODE,
    CreateCommandEvent::CODE,
    CreateEvent::CODE,
    RegisterServices::CODE,
    ReleaseControl::CODE,
    RemoveHandoffRequest::CODE,
    RequestControl::CODE,
    RequestHandoff::CODE,
    SetEmergency::CODE,
    UpdateEvent::CODE,
];
/// Queries for something that a client must set first.
const OF_SOMETHING: [u16; 9] = [
    QueryElement::CODE,
    QueryLocalWaypoint::CODE,
    QueryLocalWaypointExt::CODE,
    QueryGlobalWaypoint::CODE,
    QueryGlobalWaypointExt::CODE,
    QueryLocalPathSegment::CODE,
    QueryLocalPathSegmentExt::CODE,
    QueryGlobalPathSegment::CODE,
    QueryGlobalPathSegmentExt::CODE,
];

/// The URN of a service, from its URN or name.
pub(in super::super) fn known(text: &str) -> Result<&'static str, String> {
    let is_it = |info: &&ServiceInfo| info.id.urn == text || info.name == text;
    if let Some(info) = registry().services().find(is_it) {
        return Ok(info.id.urn);
    }
    let names: BTreeSet<_> = registry().services().map(|info| info.name).collect();
    let names: Vec<_> = names.into_iter().collect();
    Err(format!(
        "there is no service {text}; the services are {}",
        names.join(", ")
    ))
}

/// Steps for services, each in the offered version, or else the newest.
pub(in super::super) fn steps(
    urns: &[&'static str],
    offered: impl Fn(&str) -> Option<(u8, u8)>,
) -> Vec<Step> {
    let mut numbers = 1_u8..;
    let mut steps = Vec::new();
    for urn in urns {
        let version = offered(urn);
        let of_urn = || registry().services().filter(|info| info.id.urn == *urn);
        let is_offered = |info: &&ServiceInfo| version == Some((info.id.major, info.id.minor));
        let newest = || of_urn().max_by_key(|info| (info.id.major, info.id.minor));
        let Some(service) = of_urn().find(is_offered).or_else(newest) else {
            continue;
        };
        for (title, acts) in walk(service) {
            // No service has more than 255 messages.
            let Some(number) = numbers.next() else { break };
            let mut step = step(Part::S, number, title).needs(&[urn]);
            step.acts = acts;
            steps.push(step);
        }
        for (title, acts) in transitions::walk(service.id) {
            let Some(number) = numbers.next() else { break };
            let mut step = step(Part::S, number, title).needs(&[urn]);
            step.acts = acts;
            step.afterwards = transitions::afterwards();
            steps.push(step);
        }
    }
    steps
}

/// Titles and acts of the steps of one service.
fn walk(service: &ServiceInfo) -> Vec<(Cow<'static, str>, Vec<Act>)> {
    let inputs = service.inputs.iter();
    let inputs: Vec<_> = inputs
        .filter_map(|&code| registry().in_service(service.id, code))
        .collect();
    let queries = inputs.iter().filter(|info| report_of(info).is_some());
    let queries: Vec<_> = queries.copied().collect();
    let mut steps = Vec::new();
    for query in &queries {
        let is_of_something = OF_SOMETHING.contains(&query.code);
        let condition = if is_of_something {
            " if there is something to report"
        } else {
            ""
        };
        let title = format!("{} is answered{condition}", query.name).into();
        let act = asked(query, takes_report, is_of_something).map(Act::Exchange);
        steps.push((title, act.into_iter().collect()));
        let cut = cut(query, is_of_something);
        if !cut.is_empty() {
            let title = format!("{} cut short is ignored", query.name).into();
            steps.push((title, cut));
        }
    }
    if !is_controlled(service) {
        return steps;
    }
    let commands = inputs.iter();
    let commands = commands.filter(|info| info.is_command && !ANYBODYS.contains(&info.code));
    for command in commands {
        let title = format!("{} without control is ignored", command.name).into();
        steps.push((title, without_control(command, &queries)));
    }
    steps
}

/// Whether the service is or inherits Access Control.
fn is_controlled(service: &ServiceInfo) -> bool {
    if service.id.urn == access_control::URN {
        return true;
    }
    let parent = service.inherits_from;
    let parent = parent.and_then(|id| registry().services().find(|info| info.id == id));
    parent.is_some_and(is_controlled)
}

/// The type of the report that answers a query.
fn report_of(query: &MessageInfo) -> Option<&'static MessageInfo> {
    registry().by_code(report_code(query.code)?).next()
}

/// Sends a query that may remain unanswered: another step checks that.
fn perhaps(query: &MessageInfo, look: fn(u16, &Json, &mut Memory) -> Check) -> Option<Act> {
    asked(query, look, true).map(Act::Exchange)
}

/// Sends a query in its shortest form, and checks the report if it is readable.
fn asked(
    query: &MessageInfo,
    look: fn(u16, &Json, &mut Memory) -> Check,
    is_optional: bool,
) -> Option<Exchange> {
    let report = report_of(query)?;
    let mut exchange = Exchange::octets(Main, specimen::shortest(query)?);
    exchange.expects.push(Expectation {
        to: Main,
        code: report.code,
        name: report.name,
        words: "as defined".into(),
        check: Box::new(move |octets, memory| look(report.code, &read(octets)?, memory)),
        is_optional,
        in_parts: false,
    });
    Some(exchange)
}

/// Sends a query without its last octet, if it has a body, and then the whole query, which must
/// still be answered.
fn cut(query: &MessageInfo, is_optional: bool) -> Vec<Act> {
    let Some(octets) = specimen::shortest(query).filter(|octets| octets.len() > 2) else {
        return Vec::new();
    };
    let ignored = Act::Ignored {
        exchange: Exchange::octets(Main, octets.slice(..octets.len() - 1)),
        lasting: IGNORED,
    };
    let whole = asked(query, takes_report, is_optional).map(Act::Exchange);
    std::iter::once(ignored).chain(whole).collect()
}

/// Sends a command without control. The reports before and after must be equal.
fn without_control(command: &MessageInfo, queries: &[&MessageInfo]) -> Vec<Act> {
    let before = queries
        .iter()
        .filter_map(|query| perhaps(query, takes_report));
    let mut acts: Vec<Act> = before.collect();
    if let Some(octets) = specimen::telling(command) {
        acts.push(Act::Ignored {
            exchange: Exchange::octets(Second, octets),
            lasting: IGNORED,
        });
    }
    acts.extend(
        queries
            .iter()
            .filter_map(|query| perhaps(query, is_unchanged)),
    );
    acts
}

/// The JSON view of a report.
fn read(octets: &Bytes) -> Result<Json, String> {
    let message = registry()
        .decode(octets)
        .ok_or("it is not a known message")?;
    let message = message.map_err(|error| error.to_string())?;
    serde_json::to_value(message.view()).map_err(|error| error.to_string())
}

fn takes_report(code: u16, report: &Json, memory: &mut Memory) -> Check {
    memory.reports.insert(code, report.clone());
    Ok(())
}

fn is_unchanged(code: u16, report: &Json, memory: &mut Memory) -> Check {
    // Without an earlier report, nothing can be compared.
    let before = memory.reports.get(&code).unwrap_or(report);
    if is_same(before, report) {
        return Ok(());
    }
    Err(format!("it was {before}, and is now {report}"))
}

/// Whether two reports are equal, except for time stamps and tolerated drift.
fn is_same(one: &Json, other: &Json) -> bool {
    match (one, other) {
        (Json::Object(one), Json::Object(other)) => {
            one.len() == other.len()
                && one.iter().all(|(key, value)| {
                    key == "TimeStamp" || other.get(key).is_some_and(|other| is_same(value, other))
                })
        }
        (Json::Array(one), Json::Array(other)) => {
            one.len() == other.len()
                && one
                    .iter()
                    .zip(other)
                    .all(|(one, other)| is_same(one, other))
        }
        (Json::Number(one), Json::Number(other)) => match (one.as_f64(), other.as_f64()) {
            (Some(one), Some(other)) => {
                (one - other).abs() <= LEAST_WANDERING.max(WANDERING * one.abs())
            }
            _ => one == other,
        },
        _ => one == other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn titles(name: &str) -> Vec<String> {
        let steps = steps(&[known(name).unwrap()], |_| None);
        steps.iter().map(|step| step.title.to_string()).collect()
    }

    #[test]
    fn a_services_queries_and_commands_become_steps() {
        assert_eq!(titles("Liveness"), ["QueryHeartbeatPulse is answered"]);
        assert_eq!(
            titles("LocalPoseSensor")[..3],
            [
                "QueryLocalPose is answered",
                "QueryLocalPose cut short is ignored",
                "QueryLocalPoseExt is answered",
            ]
        );
        let management = titles("Management");
        assert!(management.contains(&"Resume without control is ignored".to_owned()));
        assert!(
            !management.contains(&"SetEmergency without control is ignored".to_owned()),
            "anybody may"
        );
    }

    #[test]
    fn the_ground_vehicles_own_services_become_steps() {
        assert_eq!(titles("WheelOdometry"), ["QueryWheelOdometry is answered"]);
        let planner = titles("urn:jaus-rs:ground:MissionPlanner");
        let query = "QueryMission is answered".to_owned();
        assert!(planner.contains(&query), "{planner:#?}");
    }

    #[test]
    fn the_states_of_control_are_walked_through_with_their_own_service_alone() {
        let management = titles("Management");
        for title in [
            "Resume when Standby, controlled by the sender",
            "Resume when Standby, controlled by another",
            "ReleaseControl when Emergency, set by the sender, uncontrolled, by another client",
        ] {
            assert!(management.iter().any(|it| it == title), "{management:#?}");
        }
        let heir = titles("PrimitiveDriver");
        assert!(!heir.iter().any(|title| title.contains(" when ")));
    }

    #[test]
    fn every_service_can_be_walked_through() {
        for service in registry().services() {
            let steps = steps(&[service.id.urn], |_| {
                Some((service.id.major, service.id.minor))
            });
            let has_steps = !steps.is_empty() || service.inputs.is_empty();
            // These receive reports and notices only.
            let is_passive = ["Transport", "HandoffController"].contains(&service.name);
            assert!(has_steps || is_passive, "{}", service.id);
        }
    }

    #[test]
    fn an_unknown_service_is_refused_with_those_that_are_known() {
        let refused = known("urn:jaus:jss:core:Livness").unwrap_err();
        assert!(refused.contains("Liveness"), "{refused}");
    }
}
