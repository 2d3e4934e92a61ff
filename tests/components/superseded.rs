//! Setpoints that wait for their acknowledgement, and what supersedes them.

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{Component, DeliverError, Kind};
use jaus::endpoint::Counter;
use jaus::messages::core::{QueryStatus, Standby};
use jaus::messages::mobility::{SetLocalWaypoint, SetWrenchEffort};
use jaus::node::{Config, Node, Undelivered};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;
use tokio::task::JoinHandle;

/// Nobody has this id, so nobody acknowledges.
const PEER: JausId = JausId::new(101, 1, 33);
const OTHER: JausId = JausId::new(101, 1, 34);

type Outcome = Result<(), DeliverError>;

fn deliver<M>(client: &Component, peer: JausId, message: M) -> JoinHandle<Outcome>
where
    M: Message + Send + Sync + 'static,
{
    let client = client.clone();
    tokio::spawn(async move { client.deliver(peer, &message).await })
}

fn superseded() -> Outcome {
    Err(Undelivered::Superseded.into())
}

#[tokio::test]
async fn a_newer_setpoint_or_a_stop_cancels_those_that_are_not_acknowledged() {
    let node = Node::start(Config::loopback(42, 1).group(own_group())).unwrap();
    let client = Component::builder(Kind::OperatorControlUnit, "Client");
    let client = client.attach(&node, 1).unwrap();
    let effort = SetWrenchEffort::default;

    let query = deliver(&client, PEER, QueryStatus {});
    let elsewhere = deliver(&client, OTHER, effort());
    let goal = deliver(&client, PEER, SetLocalWaypoint::default());
    let first = deliver(&client, PEER, effort());
    tokio::task::yield_now().await;
    let second = deliver(&client, PEER, effort());
    assert_eq!(within_limit(first).await.unwrap(), superseded());
    client.send(PEER, &effort()).unwrap();
    assert_eq!(within_limit(second).await.unwrap(), superseded());

    assert!(!goal.is_finished());
    client.send(PEER, &Standby {}).unwrap();
    assert_eq!(within_limit(goal).await.unwrap(), superseded());
    assert_eq!(node.counters().get(Counter::MessagesCancelled), 3);

    assert!(!query.is_finished() && !elsewhere.is_finished());
    for other in [query, elsewhere] {
        let outcome = within_limit(other).await.unwrap();
        let unacknowledged = matches!(
            outcome,
            Err(DeliverError::Undelivered(Undelivered::NotAcknowledged(_)))
        );
        assert!(unacknowledged, "{outcome:?}");
    }
}
