//! Clients of lists and of command events.

use std::time::Duration;

use jaus::component::{AccessControl, Component, Handlers, Kind, Management, RequestError};
use jaus::messages::core::Reset;
use jaus::messages::mobility::{
    QueryWrenchEffort, SetLocalWaypoint, SetTravelSpeed, SetWrenchEffort, primitive_driver,
};
use jaus::node::{Config, Node};
use jaus::service::{Elements, ListManager};
use jaus_test_kit::waiting::within_limit;

/// Time limit of commands; longer than any test.
const LIMIT: Duration = Duration::from_secs(60);

fn node() -> Node {
    Node::start(Config::loopback(101, 1)).unwrap()
}

fn client(node: &Node) -> Component {
    let client = Component::builder(Kind::OperatorControlUnit, "Client");
    client.attach(node, 1).unwrap()
}

#[tokio::test]
async fn a_list_is_filled_read_and_emptied() {
    let node = node();
    let elements = Elements::new();
    elements.accept::<SetLocalWaypoint>();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(ListManager::new(elements.clone()))
        .access_control(AccessControl::new())
        .attach(&node, 33)
        .unwrap();
    let client = client(&node);
    let _control = within_limit(client.control(rover.id(), 127)).await.unwrap();
    let list = client.list(rover.id());
    let waypoints = vec![SetLocalWaypoint::default(); 200];
    within_limit(list.replace(&waypoints)).await.unwrap();
    let uids = within_limit(list.uids()).await.unwrap();
    assert!(uids.into_iter().eq(1..=200));
    assert_eq!(elements.place_of(200), (199, 200));

    within_limit(list.delete(&[1, 2])).await.unwrap();
    within_limit(list.replace(&waypoints[..3])).await.unwrap();
    assert_eq!(within_limit(list.uids()).await, Ok(vec![1, 2, 3]));

    let unknown = within_limit(list.delete(&[77])).await.unwrap_err();
    assert!(
        matches!(unknown, RequestError::Rejected { .. }),
        "{unknown}"
    );
    let unsupported = within_limit(list.replace(&[SetTravelSpeed::default()])).await;
    let text = unsupported.unwrap_err().to_string();
    assert!(text.contains("SetElement"), "{text}");
    within_limit(list.clear()).await.unwrap();
    assert_eq!(within_limit(list.uids()).await, Ok(vec![]));
}

/// A driver that reports the end of efforts, and a client that controls it.
async fn drivable(node: &Node) -> (Component, Component) {
    let driver = Handlers::new(primitive_driver::LATEST)
        .command(|_: SetWrenchEffort, _, _| {})
        .declines::<QueryWrenchEffort>()
        .on_stop(|context| {
            let effort = <SetWrenchEffort as jaus::codec::Message>::CODE;
            context.ended(effort, false);
        })
        .motion_policy(jaus::service::MotionPolicy::Hold)
        .tell_end_of::<SetWrenchEffort>();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(driver)
        .management(Management::new())
        .attach(node, 33)
        .unwrap();
    (rover, client(node))
}

#[tokio::test]
async fn the_client_learns_how_a_command_ends() {
    let node = node();
    let (rover, client) = drivable(&node).await;
    let control = within_limit(client.control(rover.id(), 127)).await.unwrap();
    within_limit(control.resume()).await.unwrap();
    let effort = SetWrenchEffort::default();

    let drive = within_limit(client.run(rover.id(), &effort, LIMIT))
        .await
        .unwrap();
    rover.ended::<SetWrenchEffort>(true).await.unwrap();
    within_limit(drive.end()).await.unwrap();

    let drive = within_limit(client.run(rover.id(), &effort, LIMIT))
        .await
        .unwrap();
    within_limit(control.standby()).await.unwrap();
    let stopped = within_limit(drive.end()).await.unwrap_err();
    let expected = RequestError::Unsuccessful {
        peer: rover.id(),
        command: "SetWrenchEffort",
    };
    assert_eq!(stopped, expected);
}

#[tokio::test]
async fn a_command_whose_end_is_not_reported_is_rejected() {
    let node = node();
    let (rover, client) = drivable(&node).await;
    let rejected = within_limit(client.run(rover.id(), &Reset {}, LIMIT)).await;
    let text = rejected.unwrap_err().to_string();
    assert!(
        text.contains("CreateCommandEvent") && text.contains("code 5"),
        "{text}"
    );
    let effort = SetWrenchEffort::default();
    let uncontrolled = client.run(rover.id(), &effort, LIMIT);
    let text = within_limit(uncontrolled).await.unwrap_err().to_string();
    assert!(text.contains("code 3"), "{text}");
}
