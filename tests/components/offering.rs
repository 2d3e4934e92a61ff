//! Services offered by an application's components, on nodes with real sockets on the loopback
//! interface.

use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{
    AttachError, Change, Component, Condition, FindError, Handlers, Kind, Level, Liveness,
    OfferError, Patience, QueryError, QueryOptions, SendError, State, StopReason, Stopped,
};
use jaus::link::Group;
use jaus::messages::core::{QueryHeartbeatPulse, QueryStatus, ReportStatus, liveness, management};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, velocity_state_sensor,
};
use jaus::node::{Config, Node};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;

fn start(subsystem: u16, group: Group) -> Node {
    Node::start(Config::loopback(subsystem, 1).group(group)).unwrap()
}

/// A rover that reports a speed of 1.5 m/s, and an operator that discovers it.
fn rover_and_operator() -> (Component, Component) {
    let group = own_group();
    let mut speed = ReportVelocityState::default();
    speed.set_velocity_x_m_per_s(1.5).unwrap();
    let speedometer = Handlers::new(velocity_state_sensor::LATEST)
        .answer(move |_: QueryVelocityState| speed.clone())
        .declines::<QueryVelocityStateExt>();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .component_name("Drive")
        .offer(speedometer)
        .attach(&start(101, group), 33)
        .unwrap();
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator")
        .patience(Patience {
            tries: 2,
            interval: Duration::from_millis(50),
        })
        .attach(&start(42, group), 1)
        .unwrap();
    (rover, operator)
}

#[tokio::test]
async fn an_operator_finds_a_rover_and_asks_for_its_speed() {
    let (rover, operator) = rover_and_operator();
    let sensor = within_limit(operator.find(velocity_state_sensor::URN))
        .await
        .unwrap();
    assert_eq!(sensor, rover.id());
    let query = QueryVelocityState::all();
    let report = within_limit(operator.query(sensor, &query)).await.unwrap();
    let speed = report.velocity_x_m_per_s().expect("it was asked for");
    assert!((speed - 1.5).abs() < 0.001, "{speed}");
}

#[tokio::test]
async fn a_component_with_a_query_that_is_neither_answered_nor_declined_is_not_attached() {
    let node = start(101, own_group());
    let attach = |handlers: Handlers| {
        Component::builder(Kind::Vehicle, "Rover")
            .offer(handlers)
            .attach(&node, 33)
    };
    let speedometer =
        || Handlers::new(velocity_state_sensor::LATEST).publishes::<QueryVelocityState>();
    let refused = attach(speedometer()).unwrap_err();
    assert!(matches!(refused, AttachError::Unsafe(_)), "{refused}");
    let text = refused.to_string();
    assert!(
        text.contains(".declines::<QueryVelocityStateExt>()"),
        "{text}"
    );
    attach(speedometer().declines::<QueryVelocityStateExt>()).unwrap();
}

#[tokio::test]
async fn queries_at_the_same_time_all_get_their_answers() {
    let (rover, operator) = rover_and_operator();
    let beat = || operator.query(rover.id(), &QueryHeartbeatPulse {});
    let (first, second, third) = within_limit(async { tokio::join!(beat(), beat(), beat()) }).await;
    assert!(first.is_ok() && second.is_ok() && third.is_ok());
}

#[tokio::test]
async fn who_does_not_answer_is_named_with_what_was_asked_and_for_how_long() {
    let (rover, operator) = rover_and_operator();
    let asked = operator.query(rover.id(), &QueryStatus {});
    let error = within_limit(asked).await.unwrap_err();
    assert!(
        matches!(error, QueryError::NoAnswer { tries: 2, .. }),
        "{error}"
    );
    let told = error.to_string();
    assert!(
        told.starts_with("101.1.33 did not answer QueryStatus with ReportStatus: 2 attempts"),
        "{told}"
    );
}

#[tokio::test]
async fn the_patience_of_a_call_holds_for_that_call_alone() {
    let (_rover, operator) = rover_and_operator();
    let absent = JausId::new(101, 1, 34);
    let patient = QueryOptions::from(Patience {
        tries: 4,
        interval: Duration::from_millis(20),
    });
    let ask = |options| operator.query_with(options, absent, &QueryStatus);
    for (options, expected) in [
        (QueryOptions::default(), 2),
        (patient, 4),
        (QueryOptions::default(), 2),
    ] {
        let error = within_limit(ask(options)).await.unwrap_err();
        let QueryError::NoAnswer { tries, .. } = error else {
            panic!("{error}")
        };
        assert_eq!(tries, expected);
    }
}

#[tokio::test]
async fn a_query_of_a_service_that_the_peer_does_not_list_fails_with_the_name_of_the_service() {
    let (rover, operator) = rover_and_operator();
    let found = within_limit(operator.find(velocity_state_sensor::URN)).await;
    let asked = operator.query(found.unwrap(), &QueryStatus {});
    let error = within_limit(asked).await.unwrap_err();
    assert!(matches!(error, QueryError::NotOffered { .. }), "{error}");
    assert!(error.to_string().contains(management::URN), "{error}");
    drop(rover);
}

#[tokio::test]
async fn a_query_to_nobody_is_refused_at_once() {
    let (_rover, operator) = rover_and_operator();
    let nobody = JausId::new(0, 1, 1);
    let asked = operator.query(nobody, &QueryStatus {});
    let error = within_limit(asked).await.unwrap_err();
    assert!(
        matches!(
            error,
            QueryError::NotSent {
                source: SendError::Node(_),
                ..
            }
        ),
        "{error}"
    );
}

#[tokio::test]
async fn a_service_that_nobody_offers_is_not_found() {
    let (rover, operator) = rover_and_operator();
    within_limit(operator.find(liveness::URN)).await.unwrap();
    let found = operator
        .find_within("urn:test:Nothing", Duration::from_millis(50))
        .await;
    let Err(FindError::NotFound {
        service, others, ..
    }) = found
    else {
        panic!("{found:?}")
    };
    assert_eq!((service.as_str(), others), ("urn:test:Nothing", 1));
    drop(rover);
}

#[tokio::test]
async fn changes_are_told_and_the_directory_shows_them() {
    let (rover, operator) = rover_and_operator();
    let mut watch = operator.watch();
    let named = Change::Identified(Level::Component, rover.id());
    let wait = async { while watch.next().await.expect("a living component") != named {} };
    within_limit(wait).await;
    let directory = operator.directory();
    let name = |level| {
        directory
            .identification(level, rover.id())
            .map(|told| told.name.as_str())
    };
    assert_eq!(name(Level::Component), Some("Drive"));
    assert_eq!(watch.missed(), 0);
}

#[tokio::test]
async fn a_message_that_no_service_handles_goes_to_the_application() {
    let (rover, operator) = rover_and_operator();
    let mut messages = rover.messages();
    operator.send(rover.id(), &QueryStatus {}).unwrap();
    let message = within_limit(messages.next())
        .await
        .expect("a living component");
    assert_eq!(
        (message.source, &message.payload[..]),
        (operator.id(), &[0x02, 0x20][..])
    );
}

#[tokio::test]
async fn a_service_can_be_offered_and_withdrawn_while_the_component_runs() {
    let (rover, operator) = rover_and_operator();
    let ask = || operator.query(rover.id(), &QueryStatus {});
    let id = management::LATEST;
    rover
        .offer(Handlers::new(id).answer(|_: QueryStatus| ReportStatus::default()))
        .await
        .unwrap();
    assert!(within_limit(ask()).await.is_ok());
    rover.withdraw(id.urn).await.unwrap();
    assert!(within_limit(ask()).await.is_err());
}

#[tokio::test]
async fn a_heartbeat_goes_out_without_being_asked_for() {
    let group = own_group();
    let station = start(42, group);
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator")
        .attach(&station, 1)
        .unwrap();
    let mut messages = operator.messages();
    let _rover = Component::builder(Kind::Vehicle, "Rover")
        .liveness(Liveness::with_heartbeat(
            operator.id(),
            Duration::from_millis(20),
        ))
        .attach(&start(101, group), 1)
        .unwrap();
    for _ in 0..3 {
        let message = within_limit(messages.next())
            .await
            .expect("a living component");
        assert_eq!(message.payload[..], [0x02, 0x42]);
    }
}

#[tokio::test]
async fn a_component_that_is_dropped_leaves_its_number_free() {
    let node = start(101, own_group());
    let first = Component::builder(Kind::Vehicle, "Rover")
        .attach(&node, 33)
        .unwrap();
    let second = Component::builder(Kind::Vehicle, "Rover").attach(&node, 33);
    assert!(matches!(second, Err(AttachError::Node(_))));
    drop(first);
    let third = async {
        while Component::builder(Kind::Vehicle, "Rover")
            .attach(&node, 33)
            .is_err()
        {
            tokio::task::yield_now().await;
        }
    };
    within_limit(third).await;
}

#[tokio::test]
async fn a_component_notices_that_its_node_has_stopped() {
    let group = own_group();
    let node = start(101, group);
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .attach(&node, 33)
        .unwrap();
    let mut watch = rover.watch();
    within_limit(node.shutdown()).await;
    assert_eq!(within_limit(watch.next()).await, None);
    assert_eq!(within_limit(rover.stopped()).await, StopReason::Ended);
    assert_eq!(rover.standing().state, State::Shutdown);
    let asked = rover.query(JausId::new(1, 1, 1), &QueryStatus {});
    assert_eq!(within_limit(asked).await, Err(QueryError::Stopped));
    assert_eq!(
        rover.find("urn:test:Nothing").await,
        Err(FindError::Stopped)
    );
}

#[tokio::test]
async fn a_component_whose_service_has_panicked_does_not_look_alive() {
    let (rover, operator) = rover_and_operator();
    let broken = Handlers::new(management::LATEST)
        .answer(|_: QueryStatus| -> ReportStatus { panic!("a fault of this service") });
    rover.offer(broken).await.unwrap();
    assert_eq!(rover.standing().state, State::Ready);
    operator.send(rover.id(), &QueryStatus {}).unwrap();
    assert_eq!(within_limit(rover.stopped()).await, StopReason::Panicked);
    assert_eq!(rover.standing().state, State::Failure);
    let condition = rover.set_condition(Condition::Initialized).await;
    assert_eq!(condition, Err(Stopped));
    assert_eq!(rover.changed::<QueryStatus>().await, Err(Stopped));
    assert_eq!(rover.withdraw(management::URN).await, Err(Stopped));
    let offered = rover.offer(Handlers::new(management::LATEST)).await;
    assert_eq!(offered, Err(OfferError::Stopped(Stopped)));
}

#[tokio::test]
async fn a_name_that_cannot_be_told_is_refused() {
    let node = start(101, own_group());
    let refused = Component::builder(Kind::Vehicle, "x".repeat(256)).attach(&node, 33);
    assert!(matches!(
        refused,
        Err(AttachError::NameTooLong { length: 256, .. })
    ));
}
