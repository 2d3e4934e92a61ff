//! Components whose messages are octets, on nodes with real sockets on the loopback interface.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use bytes::Bytes;
use jaus::codec::Message;
use jaus::component::{
    Component, Handlers, Kind, QueryError, QueryOptions, Undecoded, Update, When,
};
use jaus::messages::core::{QueryStatus, ReportStatus, Resume};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, velocity_state_sensor,
};
use jaus::node::{Config, Node};
use jaus::service::Topic;
use jaus::wire::Priority;
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;

/// Query Velocity State for the forward velocity.
const QUERY: &[u8] = &[0x04, 0x24, 1, 0];

/// A report with the forward velocity, of which the last octet is `number`.
fn report(number: u8) -> Bytes {
    Bytes::copy_from_slice(&[0x04, 0x44, 1, 0, 0, 0, 0, number])
}

#[tokio::test]
async fn octets_are_queried_subscribed_to_and_sent_like_messages_with_types() {
    let group = own_group();
    let node = Node::start(Config::loopback(101, 1).group(group)).unwrap();
    let number = Arc::new(AtomicU8::new(7));
    let current = number.clone();
    let speedometer = Handlers::undecoded(velocity_state_sensor::LATEST)
        .answer(QueryVelocityState::CODE, move |query| {
            assert_eq!(query.payload, QUERY);
            Some(report(current.load(Ordering::Relaxed)))
        })
        .declines(QueryVelocityStateExt::CODE);
    let rover = Component::builder(Kind::Vehicle, "Rover").offer(speedometer);
    let rover = rover.attach(&node, 33).unwrap();
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
    let operator = operator.attach(&node, 1).unwrap();
    let sensor = within_limit(operator.find(velocity_state_sensor::URN))
        .await
        .unwrap();

    let (query, code) = (Bytes::from_static(QUERY), ReportVelocityState::CODE);
    let options = QueryOptions::default();
    let answer = operator.query_undecoded(options, sensor, query.clone(), code);
    assert_eq!(within_limit(answer).await, Ok(report(7)));
    let status = QueryStatus {}.encode().unwrap();
    let missing = operator.query_undecoded(options, sensor, status, ReportStatus::CODE);
    let missing = within_limit(missing).await;
    let expected = QueryStatus::NAME;
    assert!(matches!(missing, Err(QueryError::NotOffered { query, .. }) if query == expected));

    let topic = Topic {
        peer: sensor,
        query,
        report: code,
        when: When::OnChange,
    };
    let mut speeds = within_limit(operator.subscribe_undecoded(topic))
        .await
        .unwrap();
    let mut next = async || within_limit(speeds.next()).await;
    assert_eq!(next().await, Some(Update::Up));
    assert_eq!(next().await, Some(Update::Report(Undecoded(report(7)))));
    number.store(8, Ordering::Relaxed);
    rover.changed_undecoded(QueryVelocityState::CODE).await;
    assert_eq!(next().await, Some(Update::Report(Undecoded(report(8)))));

    let mut messages = operator.messages();
    let resume = Resume {}.encode().unwrap();
    let sent = rover.send_undecoded(Priority::High, operator.id(), resume.clone());
    sent.unwrap();
    let received = within_limit(messages.next()).await.unwrap();
    assert_eq!(
        (received.payload, received.priority),
        (resume.clone(), Priority::High)
    );
    let delivered = rover.deliver_undecoded(Priority::Standard, operator.id(), resume);
    within_limit(delivered).await.unwrap();
}
