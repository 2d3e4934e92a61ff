//! Setpoints that wait for their acknowledgement, and what supersedes them.

use std::net::{Ipv4Addr, UdpSocket};

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{Component, DeliverError, Handlers, Kind, Management};
use jaus::endpoint::Counter;
use jaus::messages::core::{QueryStatus, RequestControl, Resume, Standby};
use jaus::messages::mobility::{
    QueryWrenchEffort, SetLocalWaypoint, SetWrenchEffort, primitive_driver,
};
use jaus::node::{Config, Node, Undelivered};
use jaus::wire::{Frame, judp};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::{until, within_limit};
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

#[tokio::test]
async fn a_component_counts_the_setpoints_that_it_refuses() {
    let node = Node::start(Config::loopback(101, 1).group(own_group())).unwrap();
    let driver = Handlers::new(primitive_driver::LATEST)
        .command(|_: SetWrenchEffort, _, _| {})
        .declines::<QueryWrenchEffort>()
        .on_stop(|_| {});
    let builder = Component::builder(Kind::Vehicle, "Rover").offer(driver);
    let rover = builder.management(Management::new());
    let rover = rover.attach(&node, PEER.component()).unwrap();
    let (socket, to) = (UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)), node.links());
    let (socket, to) = (socket.unwrap(), to[0].local);
    let payloads = [
        (20, RequestControl { authority_code: 9 }.encode().unwrap()),
        (21, Resume {}.encode().unwrap()),
        (23, SetWrenchEffort::default().encode().unwrap()),
        // Overtaken by the one before.
        (22, SetWrenchEffort::default().encode().unwrap()),
    ];
    for (sequence, payload) in payloads {
        let client = JausId::new(42, 1, 1);
        let frame = Frame {
            sequence,
            ..Frame::new(client, rover.id(), payload)
        };
        let datagram = judp::encode(&frame).unwrap();
        socket.send_to(&datagram, to).unwrap();
    }
    until(|| rover.refused_setpoints() == 1).await;
}
