//! Bridges as processes. Those that are joined by the router of another implementation's package are
//! ignored, because that package has to be installed: `.ci/zenoh` does so and runs them.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "the tests run in real time, within a limit, and fail by panicking"
)]

mod audit;
mod fleet;
mod scene;
mod tls;

use std::collections::HashSet;
use std::sync::{Arc, Mutex};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::component::{Component, ControlError, Priority, Update, When};
use jaus::messages::mobility::{QueryWrenchEffort, SetWrenchEffort, primitive_driver};
use jaus::service::State;
use jaus::wire::{Frame, judp};
use jaus_test_kit::waiting::{until, within_limit};
use serde_json::Value as Json;

use scene::{Client, System, effort, endpoint, operator, router, rover};

/// A command that drives.
fn half_effort() -> SetWrenchEffort {
    let mut command = SetWrenchEffort::default();
    command
        .set_propulsive_linear_effort_x_percent(50.0)
        .unwrap();
    command
}

async fn found(operator: &Component) -> JausId {
    within_limit(async {
        loop {
            if let Ok(found) = operator.find(primitive_driver::URN).await {
                return found;
            }
        }
    })
    .await
}

#[tokio::test]
#[ignore = "needs the Python package eclipse-zenoh: run .ci/zenoh"]
async fn an_operator_finds_queries_subscribes_and_drives_and_the_vehicle_stops_when_a_bridge_dies()
{
    let network = endpoint();
    let _router = router(&network, &[]);
    let (vehicles, operators) = (System::new(), System::new());
    let (at_vehicle, at_operator) = (vehicles.node(101, 1), operators.node(60, 1));
    let (rover, operator) = (rover(&at_vehicle), operator(&at_operator));
    let flags = ["--connect", &network];
    let may_drive = [
        &flags[..],
        &["--accept", "60 control=127", "--trust-network"],
    ]
    .concat();
    let _bridge = vehicles.bridge("101.250.1", &may_drive);
    let mut other_bridge = operators.bridge("60.250.1", &flags);

    let driver = found(&operator).await;
    assert_eq!(driver, rover.id());
    assert!(effort(&operator, driver).await < 0.1);

    let query = QueryWrenchEffort::all();
    let subscribed = operator.subscribe(driver, &query, When::hz(10.0));
    let mut efforts = within_limit(subscribed).await.unwrap();
    for _ in 0..5 {
        within_limit(efforts.report()).await.unwrap();
    }

    let control = within_limit(operator.control(driver, 127)).await.unwrap();
    within_limit(control.resume()).await.unwrap();
    within_limit(async {
        let mut report = efforts.report().await.unwrap();
        while report.propulsive_linear_effort_x_percent() < Some(49.0) {
            control.send(&half_effort()).unwrap();
            report = efforts.report().await.unwrap();
        }
    })
    .await;
    let holder = rover.standing().controller.map(|it| it.id);
    assert_eq!(holder, Some(operator.id()));

    other_bridge.kill();
    until(|| rover.standing().controller.is_none()).await;
    let witness = scene::operator(&vehicles.node(61, 1));
    assert!(effort(&witness, driver).await < 0.1);
    within_limit(async { while !matches!(efforts.next().await, Some(Update::Down { .. })) {} })
        .await;

    // A new bridge is another session, and everything begins anew.
    let _bridge_again = operators.bridge("60.250.1", &flags);
    within_limit(efforts.report()).await.unwrap();
}

#[tokio::test]
#[ignore = "needs the Python package eclipse-zenoh: run .ci/zenoh"]
async fn by_default_the_other_side_observes_and_gets_no_control() {
    let network = endpoint();
    let _router = router(&network, &[]);
    let (vehicles, operators) = (System::new(), System::new());
    let (at_vehicle, at_operator) = (vehicles.node(101, 1), operators.node(60, 1));
    let (rover, operator) = (rover(&at_vehicle), operator(&at_operator));
    let flags = ["--connect", &network[..]];
    let _bridges = [
        vehicles.bridge("101.250.1", &flags),
        operators.bridge("60.250.1", &flags),
    ];
    let driver = found(&operator).await;
    assert!(effort(&operator, driver).await < 0.1);
    let refused = within_limit(operator.control(driver, 127)).await;
    assert!(
        matches!(refused, Err(ControlError::Refused { .. })),
        "{refused:?}"
    );
    assert_eq!(rover.standing().controller, None);

    // Neither does a program that publishes under the keys of a bridge, or anything else there.
    let client = JausId::new(61, 1, 1);
    let key = "jaus/raw/61/1/1/000D/00000000000000aa/all";
    for (key, octets) in [(key, "02"), ("jaus/raw/60/x", "00")] {
        Client::output(&network, &["put", key, octets]);
    }
    // Request Control, Request Handoff with authority 255, Set Emergency.
    let token = "jaus/live/61/1/1/00000000000000aa";
    for message in [
        &b"\x0D\x00\x7F"[..],
        b"\x31\xFF\xFF\x01x",
        b"\x06\x00\x01\x00",
    ] {
        let [low, high, ..] = message else {
            unreachable!("it has a code");
        };
        let key = format!("jaus/raw/61/1/1/{high:02X}{low:02X}/00000000000000aa/all");
        let frame = Frame::new(client, driver, Bytes::from_static(message));
        let octets = jaus_view::to_hex(&judp::encode(&frame).unwrap());
        Client::output(&network, &["put", &key, &octets, token]);
        assert!(effort(&operator, driver).await < 0.1);
        assert_eq!(rover.standing().controller, None, "{key}");
        assert_ne!(rover.standing().state, State::Emergency, "{key}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs the Python package eclipse-zenoh: run .ci/zenoh"]
async fn who_squats_an_id_is_named_with_its_session_and_frees_the_id_when_it_goes() {
    let network = endpoint();
    let _router = router(&network, &[]);
    let (vehicles, operators) = (System::new(), System::new());
    let (at_vehicle, at_operator) = (vehicles.node(101, 1), operators.node(60, 1));
    let rover = rover(&at_vehicle);
    let flags = ["--connect", &network[..]];
    let may_drive = [
        &flags[..],
        &["--accept", "60 control=127", "--trust-network"],
    ]
    .concat();
    let (_bridge, log) = vehicles.bridge_with_log("101.250.1", &may_drive);
    until(|| log.count(&["zenoh session open"]) > 0).await;

    let token = "jaus/live/60/1/1/00000000000000aa";
    let mut squatter = Client::start(&network, &["token", token]);
    let session = squatter.line().unwrap();
    until(|| log.count(&["60.1.1 belongs to bridge 00000000000000aa", token]) > 0).await;
    until(|| log.count(&[token, "was declared by", &session]) > 0).await;
    let operator = operator(&at_operator);
    let (_other_bridge, other_log) = operators.bridge_with_log("60.250.1", &flags);
    until(|| other_log.count(&["60.1.1 is heard on this side, but", token]) > 0).await;
    tokio::time::sleep(std::time::Duration::from_secs(3)).await;
    assert_eq!(log.count(&["60.1.1 belongs to bridge"]), 1);
    assert_eq!(other_log.count(&["60.1.1 is heard on this side"]), 1);
    assert_eq!(rover.standing().controller, None);

    drop(squatter);
    until(|| log.count(&["60.1.1 belongs to bridge"]) > 1).await;
    let driver = found(&operator).await;
    within_limit(operator.control(driver, 127)).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs the Python package eclipse-zenoh: run .ci/zenoh"]
async fn a_zenoh_program_reads_reports_as_json_at_its_rate_and_sees_who_is_there() {
    let network = endpoint();
    let _router = router(&network, &[]);
    let vehicles = System::new();
    let node = vehicles.node(101, 1);
    let rover = rover(&node);
    let _bridge = vehicles.bridge("101.250.1", &["--connect", &network]);

    let key = "jaus/live/101/1/33/*";
    let is_there = || !Client::output(&network, &["tokens", key]).is_empty();
    until(is_there).await;

    let key = "jaus/json/101/1/33/4405";
    let mut reports = Client::start(&network, &["subscribe", key, "3"]);
    assert_eq!(reports.line().as_deref(), Some("subscribed"));
    let answer = Client::output(&network, &["get", &format!("{key}?rate=20;for=30s")]);
    for text in answer
        .into_iter()
        .chain(std::iter::from_fn(|| reports.line()))
    {
        let view: Json = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(view["source"], rover.id().to_string());
        assert_eq!(view["message"], "ReportWrenchEffort");
        assert!(view["body"].is_object(), "{text}");
    }

    for (selector, hint) in [
        ("jaus/json/101/1/33/0405", "0405h"),
        ("jaus/json/101/1/34/4405", "101.1.34"),
        ("jaus/json/101/1/*/4405", "one component"),
    ] {
        let answer = Client::output(&network, &["get", selector]).concat();
        assert!(
            answer.starts_with("error: ") && answer.contains(hint),
            "{answer}"
        );
    }
    drop(rover);
    node.shutdown().await;
}

/// A numbered message that no service knows.
fn numbered(number: u32) -> Bytes {
    let mut message = 0xD1F0_u16.to_le_bytes().to_vec();
    message.extend(number.to_le_bytes());
    message.into()
}

/// Sends numbered messages until so many more are acknowledged.
async fn deliver(operator: &Component, to: JausId, next: &mut u32, count: usize) -> Vec<Bytes> {
    let mut acknowledged = Vec::new();
    while acknowledged.len() < count {
        let message = numbered(*next);
        *next += 1;
        let priority = Priority::Standard;
        let sent = operator.deliver_undecoded(priority, to, message.clone());
        if within_limit(sent).await.is_ok() {
            acknowledged.push(message);
        }
    }
    acknowledged
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs the Python package eclipse-zenoh: run .ci/zenoh"]
async fn nothing_acknowledged_is_lost_when_a_router_dies_and_another_takes_over() {
    let (first, second) = (endpoint(), endpoint());
    let mut first_router = router(&first, &[]);
    let _second_router = router(&second, &["--connect", &first]);
    let (vehicles, operators) = (System::new(), System::new());
    let (at_vehicle, at_operator) = (vehicles.node(101, 1), operators.node(60, 1));
    let (rover, operator) = (rover(&at_vehicle), operator(&at_operator));
    let flags = ["--connect", &first[..], "--connect", &second];
    let may_command = [
        &flags[..],
        &["--accept", "60 command also=D1F0h", "--trust-network"],
    ]
    .concat();
    let _bridges = [
        vehicles.bridge("101.250.1", &may_command),
        operators.bridge("60.250.1", &flags),
    ];
    let driver = found(&operator).await;
    let mut messages = rover.messages();
    let received = Arc::new(Mutex::new(HashSet::new()));
    let seen = received.clone();
    let reader = tokio::spawn(async move {
        while let Some(message) = messages.next().await {
            seen.lock().unwrap().insert(message.payload);
        }
    });

    let mut next = 0;
    let mut acknowledged = deliver(&operator, driver, &mut next, 200).await;
    first_router.kill();
    acknowledged.extend(deliver(&operator, driver, &mut next, 200).await);
    let all = || {
        let received = received.lock().unwrap();
        acknowledged.iter().all(|it| received.contains(it))
    };
    until(all).await;
    reader.abort();
}
