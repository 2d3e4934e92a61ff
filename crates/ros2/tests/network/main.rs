//! Sessions and a node in Python, which knows of rmw_zenoh's documents alone, joined by a router of
//! another implementation's package. Ignored, because packages have to be installed: `.ci/ros2` does so
//! and runs them.
#![allow(
    clippy::disallowed_methods,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "the tests fail by panicking"
)]

mod bridge;
mod figures;
#[path = "../rover/mod.rs"]
mod rover;
#[path = "../samples/mod.rs"]
mod samples;
mod scene;

use jaus_ros2::graph::{EntityKind, Token};
use jaus_ros2::session::{Publisher, Ros, Subscription};
use jaus_ros2::{Message, Qos};
use jaus_test_kit::waiting::{until, within_limit};

use scene::{Script, endpoint, session};

/// The topic of a sample, as `ros.py` names it.
fn topic(sample: &Message) -> String {
    let name = sample.interface().name().name();
    format!("/test/{}", name.to_lowercase())
}

fn subscription(ros: &Ros, sample: &Message) -> Subscription {
    let node = ros.node("/test", "rover").unwrap();
    let qos = Qos::default();
    node.subscription(&topic(sample), sample.interface(), qos)
        .unwrap()
}

fn publisher(ros: &Ros, sample: &Message) -> Publisher {
    let node = ros.node("/test", "rover").unwrap();
    let qos = Qos::default();
    node.publisher(&topic(sample), sample.interface(), qos)
        .unwrap()
}

#[tokio::test]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn messages_of_python_arrive_with_their_publisher_number_and_time() {
    let network = endpoint();
    let _router = Script::router(&network);
    let ros = session(&network);
    let samples = samples::all();
    let mut subscriptions: Vec<_> = samples.iter().map(|it| subscription(&ros, it)).collect();
    let _python = Script::node(&network, &["publish"]);
    for (sample, subscription) in samples.iter().zip(&mut subscriptions) {
        let first = within_limit(subscription.receive()).await;
        assert_eq!(&first.message, sample);
        let second = within_limit(subscription.receive()).await;
        assert_eq!(second.attachment.sequence, first.attachment.sequence + 1);
        assert!(second.attachment.stamp > first.attachment.stamp);
        until(|| !ros.publishers(&topic(sample)).is_empty()).await;
        let publishers = ros.publishers(&topic(sample));
        let gids: Vec<_> = publishers.iter().map(|it| it.gid).collect();
        assert_eq!(gids, [first.attachment.gid]);
        assert_eq!(publishers[0].token.node_name(), "/python_talker");
        assert_eq!(subscription.counters().malformed, 0);
    }
}

#[tokio::test]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn python_receives_messages_octet_for_octet_and_knows_their_publisher() {
    let network = endpoint();
    let _router = Script::router(&network);
    let ros = session(&network);
    let samples = samples::all();
    let publishers: Vec<_> = samples.iter().map(|it| publisher(&ros, it)).collect();
    let count = samples.len().to_string();
    let python = Script::node(&network, &["subscribe", &count]);
    for (sample, publisher) in samples.iter().zip(&publishers) {
        until(|| !ros.subscriptions(&topic(sample)).is_empty()).await;
        publisher.publish(sample).unwrap();
    }
    let mut lines = python.lines_left();
    lines.sort();
    let names = samples.iter().map(|it| it.interface().name());
    let mut expected: Vec<_> = names.map(|name| format!("ok {name}")).collect();
    expected.sort();
    assert_eq!(lines, expected);
}

#[tokio::test]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn nodes_publishers_and_subscriptions_are_listed_until_they_are_dropped() {
    let network = endpoint();
    let _router = Script::router(&network);
    let (ros, observer) = (session(&network), session(&network));
    let twist = &samples::all()[2];
    let node = ros.node("/test", "rover").unwrap();
    let qos = Qos::sensor();
    let publisher = node.publisher("/test/a", twist.interface(), qos).unwrap();
    let subscription = node.subscription("/test/b", twist.interface(), qos);
    let subscription = subscription.unwrap();
    until(|| observer.publishers("/test/a").len() == 1).await;
    until(|| observer.subscriptions("/test/b").len() == 1).await;
    assert_eq!(ros.publishers("/test/a"), []);

    let kinds = |tokens: &[String]| -> Vec<_> {
        let tokens = tokens.iter().map(|it| it.parse::<Token>().unwrap());
        tokens.map(|it| (it.kind, it.node_name())).collect()
    };
    let rover = || "/test/rover".to_owned();
    let tokens = Script::tokens(&network);
    let expected = [
        (EntityKind::Node, rover()),
        (EntityKind::Publisher, rover()),
        (EntityKind::Subscription, rover()),
    ];
    assert_eq!(kinds(&tokens), expected);
    assert!(
        tokens[1]
            .contains("/1/MP/%/%test/rover/%test%a/geometry_msgs::msg::dds_::Twist_/RIHS01_9c45")
    );
    assert!(tokens[1].ends_with("/2::,5:,:,:,,"), "{tokens:?}");

    drop((publisher, node));
    until(|| observer.publishers("/test/a").is_empty()).await;
    let left = kinds(&Script::tokens(&network));
    assert_eq!(left, [expected[0].clone(), expected[2].clone()]);
    within_limit(ros.close()).await;
    assert_eq!(Script::tokens(&network), [""; 0]);
    drop(subscription);
}

#[tokio::test]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn a_session_survives_the_loss_of_its_router_and_begins_without_one() {
    let network = endpoint();
    let ros = session(&network);
    let twist = &samples::all()[2];
    let mut subscription = subscription(&ros, twist);
    assert!(!ros.is_connected());
    let router = Script::router(&network);
    until(|| ros.is_connected()).await;
    let python = Script::node(&network, &["publish"]);
    within_limit(subscription.receive()).await;
    until(|| !ros.publishers("/test/twist").is_empty()).await;

    let mut changes = ros.changes();
    drop((router, python));
    until(|| ros.publishers("/test/twist").is_empty()).await;
    until(|| !ros.is_connected()).await;
    assert!(changes.has_changed().unwrap());
    changes.mark_unchanged();

    while subscription.try_receive().is_some() {}
    let _router = Script::router(&network);
    let _python = Script::node(&network, &["publish"]);
    within_limit(subscription.receive()).await;
    until(|| !ros.publishers("/test/twist").is_empty() && ros.is_connected()).await;
    assert!(changes.has_changed().unwrap());
}

#[tokio::test]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn a_publisher_that_is_killed_leaves_the_graph() {
    let network = endpoint();
    let _router = Script::router(&network);
    let ros = session(&network);
    let python = Script::node(&network, &["publish"]);
    until(|| !ros.publishers("/test/twist").is_empty()).await;
    drop(python);
    until(|| ros.publishers("/test/twist").is_empty()).await;
}

#[tokio::test]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn messages_that_are_no_messages_are_counted() {
    let network = endpoint();
    let _router = Script::router(&network);
    let ros = session(&network);
    let samples = samples::all();
    let mut subscriptions: Vec<_> = samples.iter().map(|it| subscription(&ros, it)).collect();
    until(|| ros.is_connected() && Script::tokens(&network).len() == 2 * samples.len()).await;
    let _python = Script::node(&network, &["spoil"]);
    for subscription in &mut subscriptions {
        let counts = || {
            assert_eq!(subscription.try_receive(), None);
            subscription.counters().malformed == 4
        };
        until(counts).await;
    }
}

#[tokio::test]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn a_subscription_that_is_not_read_keeps_the_newest_messages() {
    let network = endpoint();
    let _router = Script::router(&network);
    let (ros, other) = (session(&network), session(&network));
    let twist = &samples::all()[2];
    let (publisher, mut subscription) = (publisher(&ros, twist), subscription(&other, twist));
    until(|| !ros.subscriptions("/test/twist").is_empty()).await;
    // The publisher keeps ten messages at most while they wait for the thread of the session.
    let mut sent = 0;
    until(|| {
        publisher.publish(twist).unwrap();
        sent += 1;
        subscription.counters().dropped >= 5
    })
    .await;
    until(|| {
        let passed = sent - publisher.dropped();
        subscription.counters().dropped == passed - 10
    })
    .await;
    let first = subscription.try_receive().unwrap().attachment.sequence;
    let last = (1..10).map(|_| subscription.try_receive().unwrap()).last();
    assert_eq!(last.unwrap().attachment.sequence, first + 9);
    assert_eq!(subscription.try_receive(), None);
}

#[tokio::test]
#[ignore = "needs packages of Python: run .ci/ros2"]
async fn another_type_or_another_durability_is_refused() {
    let ros = session(&endpoint());
    let samples = samples::all();
    let publisher = publisher(&ros, &samples[0]);
    let error = publisher.publish(&samples[2]).unwrap_err().to_string();
    assert!(
        error.contains("std_msgs/msg/Bool, not geometry_msgs/msg/Twist"),
        "{error}"
    );
    let node = ros.node("/", "rover").unwrap();
    let mut qos = Qos::default();
    qos.durability = jaus_ros2::graph::Durability::TransientLocal;
    let error = node
        .publisher("/a", samples[0].interface(), qos)
        .unwrap_err();
    assert!(error.to_string().contains("use volatile"), "{error}");
}
