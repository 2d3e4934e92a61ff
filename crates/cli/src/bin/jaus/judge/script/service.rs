//! Generates steps from a service's definition: its queries, and its commands without control.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use jaus::codec::Message as _;
use jaus::messages::core::{
    CancelEvent, ClearEmergency, CreateCommandEvent, CreateEvent, QueryElement, RegisterServices,
    ReleaseControl, RequestControl, SetEmergency, UpdateEvent, access_control,
};
use jaus::messages::mobility::{
    QueryGlobalPathSegment, QueryGlobalPathSegmentExt, QueryGlobalWaypoint, QueryGlobalWaypointExt,
    QueryLocalPathSegment, QueryLocalPathSegmentExt, QueryLocalWaypoint, QueryLocalWaypointExt,
};
use jaus_vehicle::messages::handoff::{RemoveHandoffRequest, RequestHandoff};
use jsidl::model::{Message, Service, Version};
use jsidl::{Library, dynamic};
use serde_json::Value as Json;

use super::super::memory::Memory;
use super::super::report::shortened;
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

/// The services to be tested, and the definitions that say how.
pub(in super::super) struct Services {
    library: Library,
    chosen: Vec<Arc<str>>,
}

impl Services {
    /// Chooses services by URN or name.
    pub(in super::super) fn choose(library: Library, texts: &[String]) -> Result<Self, String> {
        let chosen = texts.iter().map(|text| urn(&library, text));
        let chosen = chosen.collect::<Result<_, _>>()?;
        Ok(Self { library, chosen })
    }

    /// Origin of the steps, as text.
    pub(in super::super) fn origin(&self) -> String {
        match &*self.chosen {
            [] => "the contests' script".to_owned(),
            urns => urns.join(", "),
        }
    }

    /// Steps for the services, each in the offered version, or else the newest.
    pub(in super::super) fn steps(&self, offered: impl Fn(&str) -> Option<(u8, u8)>) -> Vec<Step> {
        let mut numbers = 1..=u16::MAX;
        let mut steps = Vec::new();
        for urn in &self.chosen {
            let version = offered(urn).map(|(major, minor)| Version { major, minor });
            let versions = || self.library.versions(urn);
            let is_offered = |service: &&Arc<Service>| Some(service.id.version) == version;
            let Some(service) = versions().find(is_offered).or_else(|| versions().last()) else {
                continue;
            };
            let of_messages = walk(&self.library, service).into_iter();
            let of_messages = of_messages.map(|(title, acts)| (title, acts, Vec::new()));
            let of_states = transitions::walk(&self.library, service).into_iter();
            let of_states = of_states.map(|(title, acts)| (title, acts, transitions::afterwards()));
            for ((title, acts, afterwards), number) in
                of_messages.chain(of_states).zip(&mut numbers)
            {
                let mut step = step(Part::S, number, title);
                step.needs.push(urn.to_string().into());
                step.acts = acts;
                step.afterwards = afterwards;
                steps.push(step);
            }
        }
        steps
    }
}

/// The URN of a service, from its URN or name.
fn urn(library: &Library, text: &str) -> Result<Arc<str>, String> {
    let is_it = |service: &&Arc<Service>| &*service.id.urn == text || service.name == text;
    if let Some(service) = library.services().find(is_it) {
        return Ok(service.id.urn.clone());
    }
    let names = library.services().flat_map(|it| [&*it.id.urn, &*it.name]);
    let alike = names.map(|name| (strsim::jaro_winkler(text, name), name));
    let nearest = alike.max_by(|(one, _), (other, _)| one.total_cmp(other));
    let nearest = nearest.map_or("", |(_, name)| name);
    Err(format!(
        "there is no service {text}; did you mean {nearest}? Load the definition of your own service \
         with --jsidl"
    ))
}

/// Titles and acts of the steps of one service's messages.
fn walk(library: &Library, service: &Service) -> Vec<(String, Vec<Act>)> {
    let queries = service.inputs.iter();
    let queries = queries.filter_map(|query| Some((query, report_of(library, service, query)?)));
    let queries: Vec<Query<'_>> = queries.collect();
    let mut steps = Vec::new();
    for query in &queries {
        let is_of_something = OF_SOMETHING.contains(&query.0.code);
        let condition = if is_of_something {
            " if there is something to report"
        } else {
            ""
        };
        let title = format!("{} is answered{condition}", query.0.name);
        let act = asked(query, takes_report, is_of_something).map(Act::Exchange);
        steps.push((title, act.into_iter().collect()));
        let cut = cut(query, is_of_something);
        if !cut.is_empty() {
            steps.push((format!("{} cut short is ignored", query.0.name), cut));
        }
    }
    let mut lineage = library.lineage(service);
    if !lineage.any(|it| &*it.id.urn == access_control::URN) {
        return steps;
    }
    let commands = service.inputs.iter();
    let commands = commands.filter(|it| it.is_command && !ANYBODYS.contains(&it.code));
    for command in commands {
        let title = format!("{} without control is ignored", command.name);
        steps.push((title, without_control(command, &queries)));
    }
    steps
}

/// Checks the report with this code.
type Look = fn(u16, &Json, &mut Memory) -> Check;
/// A query, and the report that answers it.
type Query<'a> = (&'a Arc<Message>, &'a Arc<Message>);

/// The report that answers a query.
fn report_of<'a>(
    library: &'a Library,
    service: &'a Service,
    query: &Message,
) -> Option<&'a Arc<Message>> {
    let mut declaring = library.lineage(service);
    declaring.find_map(|it| it.report_of(query))
}

/// Sends a query that may remain unanswered: another step checks that.
fn perhaps(query: &Query<'_>, look: Look) -> Option<Act> {
    asked(query, look, true).map(Act::Exchange)
}

/// Sends a query in its shortest form, and checks the report if it is readable.
fn asked((query, report): &Query<'_>, look: Look, is_optional: bool) -> Option<Exchange> {
    let report = Arc::clone(report);
    let mut exchange = Exchange::octets(Main, specimen::shortest(query)?);
    exchange.expects.push(Expectation {
        to: Main,
        code: report.code,
        name: report.name.clone().into(),
        words: "as defined".into(),
        check: Box::new(move |octets, memory| look(report.code, &read(&report, octets)?, memory)),
        is_optional,
        in_parts: false,
    });
    Some(exchange)
}

/// Sends a query without its last octet, if it has a body, and then the whole query, which must
/// still be answered.
fn cut(query: &Query<'_>, is_optional: bool) -> Vec<Act> {
    let Some(octets) = specimen::shortest(query.0).filter(|octets| octets.len() > 2) else {
        return Vec::new();
    };
    let ignored = Act::Ignored {
        exchange: Exchange::octets(Main, octets.slice(..octets.len() - 1)),
        lasting: IGNORED,
    };
    let whole = asked(query, takes_report, is_optional).map(Act::Exchange);
    // The answer of the step before may have more parts.
    [Act::Pause(IGNORED), ignored]
        .into_iter()
        .chain(whole)
        .collect()
}

/// Sends a command without control. The reports before and after must be equal, except for those
/// that change without a command, such as images.
fn without_control(command: &Message, queries: &[Query<'_>]) -> Vec<Act> {
    let ask = |look| queries.iter().filter_map(move |query| perhaps(query, look));
    let mut acts: Vec<Act> = ask(takes_report as Look).collect();
    if !acts.is_empty() {
        acts.push(Act::Pause(IGNORED));
        acts.extend(ask(forgets_if_changed));
    }
    if let Some(octets) = specimen::telling(command) {
        acts.push(Act::Ignored {
            exchange: Exchange::octets(Second, octets),
            lasting: IGNORED,
        });
    }
    acts.extend(ask(is_unchanged));
    acts
}

/// The JSON view of a report.
fn read(report: &Message, octets: &Bytes) -> Result<Json, String> {
    let value = dynamic::decode(report, octets).map_err(|error| error.to_string())?;
    dynamic::to_json(report, &value).map_err(|error| error.to_string())
}

fn takes_report(code: u16, report: &Json, memory: &mut Memory) -> Check {
    memory.reports.insert(code, report.clone());
    Ok(())
}

fn forgets_if_changed(code: u16, report: &Json, memory: &mut Memory) -> Check {
    let before = memory.reports.get(&code);
    if before.is_some_and(|before| !is_same(before, report)) {
        memory.reports.remove(&code);
    }
    Ok(())
}

fn is_unchanged(code: u16, report: &Json, memory: &mut Memory) -> Check {
    // Without an earlier report, nothing can be compared.
    let before = memory.reports.get(&code).unwrap_or(report);
    if is_same(before, report) {
        return Ok(());
    }
    let text = |report: &Json| shortened(report.to_string());
    Err(format!(
        "it was {}, and is now {}",
        text(before),
        text(report)
    ))
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
    use std::collections::BTreeSet;

    use super::*;

    fn library() -> Library {
        let mut loader = jsidl::Loader::new();
        loader.catalogue();
        loader.load().library
    }

    fn titles(name: &str) -> Vec<String> {
        let services = Services::choose(library(), &[name.to_owned()]).unwrap();
        let steps = services.steps(|_| None);
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
        let library = library();
        let has_steps = |service: &Service| {
            !walk(&library, service).is_empty() || !transitions::walk(&library, service).is_empty()
        };
        // A client of this service answers, and asks nothing.
        let exempt = ["HandoffController"];
        let without = library
            .services()
            .filter(|it| !it.inputs.is_empty() && !has_steps(it));
        let names: BTreeSet<_> = without.map(|it| &*it.name).collect();
        assert_eq!(names, BTreeSet::from(exempt));
    }

    #[test]
    fn an_unknown_service_is_refused_with_the_name_that_is_most_like_it() {
        for wrong in ["Livness", "urn:jaus:jss:core:Livness"] {
            let refused = urn(&library(), wrong).unwrap_err();
            let right = wrong.replace("Livness", "Liveness");
            assert!(refused.contains(&format!("mean {right}?")), "{refused}");
        }
    }
}
