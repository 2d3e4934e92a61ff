//! The judging tool of the 2015 competition: its scored run and a practice run. The vehicle's
//! answers are compared with a file beside this one, reviewed by hand.

use std::path::Path;
use std::time::Duration;

use jaus::codec::Message;
use jaus::messages::core::{CreateEvent, RejectEventRequest};
use jaus::wire::Frame;
use jaus_test_kit::{evidence, snapshot};
use jaus_view::Dictionary;
use serde_json::{Value as Json, json};

use crate::tool::judge::replay::capture::said_by;
use crate::tool::judge::replay::client::{Client, Exchange, Pauses, is_answered};
use crate::tool::judge::replay::vehicle::{VEHICLE, Vehicle};

/// Subsystem of the judged vehicle.
const JUDGED: u16 = 105;
/// Subsystem of the judge.
const JUDGE: u16 = 42;
/// The services that the contest required.
const CONTEST: [&str; 11] = [
    "Transport",
    "Events",
    "AccessControl",
    "Management",
    "Liveness",
    "Discovery",
    "LocalWaypointDriver",
    "LocalWaypointListDriver",
    "VelocityStateSensor",
    "LocalPoseSensor",
    "PrimitiveDriver",
];
/// Short pauses: still long enough for a reset, during which the tool waited 1.5 s.
const SHORT: Pauses = Pauses(Duration::from_millis(20));
/// Pauses of the tool.
const ORIGINAL: Pauses = Pauses(Duration::from_secs(30));

/// Sends all messages of the tool. Returns the exchanges.
fn replay(capture: &str, pauses: Pauses) -> Option<Vec<Exchange>> {
    let capture = evidence::capture(&format!("igvc2015/{capture}"))?;
    let of_judge = |id: jaus::address::JausId| id.subsystem() == JUDGE;
    let said = said_by(&capture, of_judge, JUDGED, VEHICLE);
    assert!(!said.is_empty(), "{} has requests", capture.display());
    let mut client = Client::new(Vehicle::start());
    let exchanges = client.replay(&said, pauses);
    assert_eq!(exchanges.len(), said.len());
    Some(exchanges)
}

/// Requires every answer, and compares the exchanges with the stored ones, one per line.
#[track_caller]
fn check(exchanges: &[Exchange], file: &str) {
    let dictionary = Dictionary::new();
    let mut lines = String::new();
    for exchange in exchanges {
        let line = line(&dictionary, exchange);
        assert!(is_answered(exchange), "no answer: {line}");
        lines += &format!("{line}\n");
    }
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/tool/judge/replay");
    snapshot::check(directory.join(file), &lines);
}

/// An exchange in readable form.
fn line(dictionary: &Dictionary, exchange: &Exchange) -> Json {
    let answers = exchange.answers.iter();
    let answers: Vec<_> = answers
        .map(|answer| message(dictionary, answer, "to"))
        .collect();
    json!({ "said": message(dictionary, &exchange.said, "by"), "answers": answers })
}

fn message(dictionary: &Dictionary, frame: &Frame, role: &str) -> Json {
    let line: Json = serde_json::from_str(&dictionary.line(&frame.payload).to_json()).unwrap();
    let who = if role == "by" {
        frame.source
    } else {
        frame.destination
    };
    let mut shown = json!({ role: who.to_string(), "message": line["message"] });
    for key in ["body", "octets", "error"] {
        if let Some(value) = line.get(key) {
            shown[key] = what_matters(value);
        }
    }
    shown
}

/// The value without the time of day, which differs in every run, and without services that the
/// contest did not require.
fn what_matters(value: &Json) -> Json {
    match value {
        Json::Object(object) => {
            let member = |(key, value): (&String, &Json)| match key.as_str() {
                "TimeStamp" => (key.clone(), "…".into()),
                "ServiceList" => (key.clone(), of_the_contest(value)),
                _ => (key.clone(), what_matters(value)),
            };
            Json::Object(object.iter().map(member).collect())
        }
        Json::Array(items) => items.iter().map(what_matters).collect(),
        other => other.clone(),
    }
}

/// The services of a list that the contest required.
fn of_the_contest(services: &Json) -> Json {
    let is_asked_for = |service: &&Json| {
        let name = service["URI"]
            .as_str()
            .and_then(|uri| uri.rsplit(':').next());
        name.is_some_and(|name| CONTEST.contains(&name))
    };
    let services = services.as_array().into_iter().flatten();
    services.filter(is_asked_for).cloned().collect()
}

#[test]
fn every_request_of_the_scored_run_is_answered_rightly() {
    let Some(exchanges) = replay("interface_test_1_13pts.pcapng", SHORT) else {
        return;
    };
    check(&exchanges, "scored_run.jsonl");
    // The only refusal is the provoked one: a stream of a report instead of a query.
    let refused = |exchange: &&Exchange| {
        exchange
            .answers
            .iter()
            .any(|answer| answer.code() == Some(RejectEventRequest::CODE))
    };
    let refused: Vec<_> = exchanges.iter().filter(refused).collect();
    assert_eq!(refused.len(), 1);
    let creation = CreateEvent::decode(&refused[0].said.payload).unwrap();
    assert_eq!(&creation.query_message[..2], [0x02, 0x44]);
}

#[test]
fn every_request_of_the_practice_run_is_answered_rightly() {
    let capture = "qualification-practive-2015.pcap.pcapng";
    if let Some(exchanges) = replay(capture, SHORT) {
        check(&exchanges, "practice_run.jsonl");
    }
}

#[test]
#[ignore = "takes as long as the contest did: two minutes"]
fn the_scored_run_is_answered_rightly_at_its_own_pace() {
    if let Some(exchanges) = replay("interface_test_1_13pts.pcapng", ORIGINAL) {
        check(&exchanges, "scored_run.jsonl");
    }
}
