//! One service at two versions with different layouts under the same code: a component offers both,
//! a client selects one, and both are decoded correctly.

use std::time::Duration;

use jaus::codec::{Message, ServiceId};
use jaus::component::{AttachError, Component, FindError, Handlers, Kind};
use jaus::link::Group;
use jaus::messages::mobility::local_vector_driver::{V1_0, V1_1};
use jaus::messages::mobility::{self, QueryLocalVector, QueryLocalVectorExt, v1_0};
use jaus::messages::registry;
use jaus::node::{Config, Node};
use jaus::service::UnsafeService;
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;
use tokio::sync::mpsc;

const NEWEST_FIRST: [ServiceId; 2] = [V1_1, V1_0];

/// A command as the driver decoded it: version, speed and heading.
type Heard = (&'static str, Option<f64>, Option<f64>);

fn start(group: Group, subsystem: u16) -> Node {
    Node::start(Config::loopback(subsystem, 1).group(group)).unwrap()
}

/// A driver that accepts both versions, and reports each command.
fn both(heard: mpsc::UnboundedSender<Heard>) -> Handlers {
    let newer = heard.clone();
    Handlers::new(V1_1)
        .and_version(V1_0)
        .receive_unguarded(move |vector: mobility::SetLocalVector, _, _| {
            let speed = Some(vector.speed_m_per_s());
            newer.send(("1.1", speed, vector.heading_rad())).unwrap();
        })
        .receive_unguarded(move |vector: v1_0::SetLocalVector, _, _| {
            let (speed, heading) = (vector.speed_m_per_s(), vector.heading_rad());
            heard.send(("1.0", speed, heading)).unwrap();
        })
        .declines::<QueryLocalVector>()
        .declines::<QueryLocalVectorExt>()
}

fn rounded((version, speed, heading): Heard) -> Heard {
    let round = |value: f64| (value * 10.0).round() / 10.0;
    (version, speed.map(round), heading.map(round))
}

#[tokio::test]
async fn a_client_is_told_which_version_it_speaks_and_is_understood_in_it() {
    let group = own_group();
    let (heard, mut hears) = mpsc::unbounded_channel();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(both(heard))
        .attach(&start(group, 101), 1)
        .unwrap();
    let client = Component::builder(Kind::OperatorControlUnit, "Operator")
        .attach(&start(group, 42), 1)
        .unwrap();

    let found = within_limit(client.find_common_version(&NEWEST_FIRST)).await;
    assert_eq!(found, Ok((rover.id(), V1_1)));
    let mut vector = mobility::SetLocalVector::default();
    vector.set_speed_m_per_s(3.0).unwrap();
    vector.set_heading_rad(0.5).unwrap();
    client.send(rover.id(), &vector).unwrap();
    let told = within_limit(hears.recv()).await.map(rounded);
    assert_eq!(told, Some(("1.1", Some(3.0), Some(0.5))));

    // A client built before version 1.1, in which the speed is optional.
    let found = within_limit(client.find_common_version(&[V1_0])).await;
    assert_eq!(found, Ok((rover.id(), V1_0)));
    let mut vector = v1_0::SetLocalVector::default();
    vector.set_heading_rad(0.5).unwrap();
    client.send(rover.id(), &vector).unwrap();
    let told = within_limit(hears.recv()).await.map(rounded);
    assert_eq!(told, Some(("1.0", None, Some(0.5))));
}

#[tokio::test]
async fn a_client_without_a_common_version_is_told_the_versions_of_both_sides() {
    let group = own_group();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(
            Handlers::new(V1_0)
                .declines::<QueryLocalVector>()
                .declines::<QueryLocalVectorExt>(),
        )
        .attach(&start(group, 101), 1)
        .unwrap();
    let client = Component::builder(Kind::OperatorControlUnit, "Operator")
        .attach(&start(group, 42), 1)
        .unwrap();
    let found = within_limit(client.find_common_version(&NEWEST_FIRST)).await;
    assert_eq!(found, Ok((rover.id(), V1_0)), "the best of what is there");

    let newer = [ServiceId { minor: 2, ..V1_1 }, V1_1];
    let limit = Duration::from_millis(50);
    let finding = client.find_common_version_within(&newer, limit);
    let error = finding.await.unwrap_err();
    assert!(matches!(error, FindError::NotFound { .. }), "{error:?}");
    let told = error.to_string();
    let sought = "no component with urn:jaus:jss:mobility:LocalVectorDriver 1.2 or \
                  urn:jaus:jss:mobility:LocalVectorDriver 1.1 found within 0.";
    assert!(told.starts_with(sought), "{told}");
    assert!(told.ends_with("(101.1.1 offers version 1.0)"), "{told}");
}

#[test]
fn the_registry_settles_by_service_and_version_where_a_code_is_shared() {
    let code = mobility::SetLocalVector::CODE;
    let layouts = registry().by_code(code).count();
    assert_eq!(layouts, 2);
    let in_version = |version| registry().in_service(version, code).unwrap();
    let mut older = v1_0::SetLocalVector::default();
    older.set_heading_rad(0.5).unwrap();
    let octets = older.encode().unwrap();
    assert!((in_version(V1_0).decode)(&octets).is_ok());
    assert!((in_version(V1_1).decode)(&octets).is_err());
}

#[tokio::test]
async fn a_version_whose_layout_nothing_handles_cannot_be_offered() {
    let newest_only = || {
        Handlers::new(V1_1)
            .receive_unguarded(|_: mobility::SetLocalVector, _, _| {})
            .declines::<QueryLocalVector>()
            .declines::<QueryLocalVectorExt>()
    };
    let node = start(own_group(), 101);
    let rover = || Component::builder(Kind::Vehicle, "Rover");
    let both = rover().offer(newest_only().and_version(V1_0));
    let error = both.attach(&node, 1).unwrap_err();
    assert_eq!(
        error,
        AttachError::Unsafe(UnsafeService::VersionNotHandled {
            service: V1_0,
            message: "SetLocalVector"
        })
    );
    rover().offer(newest_only()).attach(&node, 1).unwrap();
}
