//! Whole nodes that have nothing but a secure link between them.
#![expect(
    clippy::disallowed_methods,
    reason = "the nodes run in real time, within a limit"
)]

use std::time::{Duration, SystemTime};

use jaus::component::{Component, Handlers, Kind, Update, When};
use jaus::messages::mobility::{
    QueryAccelerationState, QueryAccelerationStateExt, ReportAccelerationState,
    acceleration_state_sensor,
};
use jaus::node::{Config, Node};

use super::*;
use crate::transport::Act;
use crate::trust::{Peer, Trust};
use jaus::rights::Rules;

/// Longer than any step takes.
const LIMIT: Duration = Duration::from_secs(20);

const IDS: [&str; 2] = ["101.255.255", "60.255.255"];

/// What comes of this before the limit.
async fn within<T>(done: impl Future<Output = T>) -> T {
    tokio::time::timeout(LIMIT, done).await.expect("an answer")
}

fn key(folder: &tempfile::TempDir, name: &str) -> Key {
    Key::create(&folder.path().join(name)).unwrap()
}

fn trusting(name: &str, key: &Key, ids: &str) -> TrustFile {
    TrustFile::of(Trust::new(vec![Peer {
        name: name.to_owned(),
        key: key.public(),
        ids: vec![ids.parse().unwrap()],
        rules: Rules::default(),
    }]))
}

/// The link of a rover, and that of a client which dials it, with these ids.
fn linked(folder: &tempfile::TempDir, ids: [&str; 2]) -> (SecureLink, SecureLink) {
    let keys = ["rover", "client"].map(|name| key(folder, name));
    let any = "127.0.0.1:0".parse().unwrap();
    let trust = trusting("client", &keys[1], ids[1]);
    let at_rover = SecureLink::open(&keys[0], trust, Settings::new(any)).unwrap();
    let settings = Settings::new(any).connect(at_rover.local().unwrap());
    let trust = trusting("rover", &keys[0], ids[0]);
    let at_client = SecureLink::open(&keys[1], trust, settings).unwrap();
    (at_rover, at_client)
}

fn node(subsystem: u16, link: SecureLink) -> Node {
    let config = Config::new(subsystem, 1).without_udp();
    Node::start_with(config, vec![Box::new(link)]).unwrap()
}

fn sensor(node: &Node) -> Component {
    let sensor = Handlers::new(acceleration_state_sensor::LATEST)
        .publishes::<QueryAccelerationState>()
        .publishes::<QueryAccelerationStateExt>();
    let builder = Component::builder(Kind::Vehicle, "Rover").offer(sensor);
    builder.attach(node, 52).unwrap()
}

fn client(node: &Node) -> Component {
    let builder = Component::builder(Kind::OperatorControlUnit, "Client");
    builder.attach(node, 1).unwrap()
}

#[tokio::test]
async fn a_sensor_is_found_queried_and_subscribed_over_a_secure_link_alone() {
    let folder = tempfile::tempdir().unwrap();
    let (at_rover, at_client) = linked(&folder, IDS);
    let nodes = [node(101, at_rover), node(60, at_client)];
    let (rover, client) = (sensor(&nodes[0]), client(&nodes[1]));
    let mut report = ReportAccelerationState::default();
    report.set_acceleration_x_m_per_s2(0.5).unwrap();
    rover
        .publish(report.clone(), SystemTime::now())
        .await
        .unwrap();

    let exchange = async {
        let found = client.find(acceleration_state_sensor::URN).await.unwrap();
        assert_eq!(found, rover.id());
        let query = QueryAccelerationState::none().with_acceleration_x();
        let answer = client.query(found, &query).await.unwrap();
        assert_eq!(answer.acceleration_x, report.acceleration_x);
        let mut reports = client
            .subscribe(found, &query, When::hz(20.0))
            .await
            .unwrap();
        while let Some(update) = reports.next().await {
            if matches!(update, Update::Report(_)) {
                break;
            }
        }
    };
    within(exchange).await;
    for node in nodes {
        node.shutdown().await;
    }
}

#[tokio::test]
async fn a_relay_joins_nodes_that_have_no_link_with_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let keys = ["relay", "rover", "client"].map(|name| key(&folder, name));
    let any = "127.0.0.1:0".parse().unwrap();
    let peers = [
        ("rover", &keys[1], "101.255.255"),
        ("client", &keys[2], "60.255.255"),
    ];
    let peers = peers.map(|(name, key, ids)| Peer {
        name: name.to_owned(),
        key: key.public(),
        ids: vec![ids.parse().unwrap()],
        rules: Rules::default(),
    });
    let trust = TrustFile::of(Trust::new(peers.into()));
    let at_relay = SecureLink::open(&keys[0], trust, Settings::new(any)).unwrap();
    let settings = Settings::new(any).connect(at_relay.local().unwrap());
    let open = |own: &Key| {
        let trust = trusting("relay", &keys[0], "65535.255.255");
        SecureLink::open(own, trust, settings.clone()).unwrap()
    };
    let mut config = Config::new(200, 1).without_udp();
    config.routing.forward = true;
    let relay = Node::start_with(config, vec![Box::new(at_relay)]).unwrap();
    let nodes = [relay, node(101, open(&keys[1])), node(60, open(&keys[2]))];
    let (rover, client) = (sensor(&nodes[1]), client(&nodes[2]));
    rover
        .publish(ReportAccelerationState::default(), SystemTime::now())
        .await
        .unwrap();
    let exchange = async {
        let found = client.find(acceleration_state_sensor::URN).await.unwrap();
        let query = QueryAccelerationState::none().with_acceleration_x();
        client.query(found, &query).await.unwrap();
    };
    within(exchange).await;
    for node in nodes {
        node.shutdown().await;
    }
}

#[tokio::test]
async fn who_comes_first_with_the_id_of_a_peer_on_a_plain_link_gets_none_of_its_messages() {
    const ROVER: u16 = 11_501;
    let folder = tempfile::tempdir().unwrap();
    let (at_rover, at_client) = linked(&folder, ["11501.255.255", "11502.255.255"]);
    let config = Config::loopback(ROVER, 1);
    let at_rover = Node::start_with(config, vec![Box::new(at_rover)]).unwrap();
    let rover = sensor(&at_rover);
    let report = ReportAccelerationState::default();
    rover.publish(report, SystemTime::now()).await.unwrap();
    let plain = |subsystem| Node::start(Config::loopback(subsystem, 1)).unwrap();
    let (forger, stranger) = (plain(11_502), plain(11_503));
    let query = QueryAccelerationState::none().with_acceleration_x();
    let exchange = async {
        // A plain link that works answers others.
        client(&stranger).query(rover.id(), &query).await.unwrap();
        let forged = client(&forger);
        assert!(forged.query(rover.id(), &query).await.is_err());
        let at_client = node(11_502, at_client);
        let truly = client(&at_client);
        truly.query(rover.id(), &query).await.unwrap();
        assert!(forged.query(rover.id(), &query).await.is_err());
        truly.query(rover.id(), &query).await.unwrap();
    };
    within(exchange).await;
}

#[tokio::test]
async fn a_node_that_is_shut_down_tells_its_peers() {
    let folder = tempfile::tempdir().unwrap();
    let (at_rover, mut at_client) = linked(&folder, IDS);
    let peers = [at_rover.local().unwrap()];
    let rover = node(101, at_rover);
    assert!(at_client.probe(&peers, LIMIT).await[0].is_ok());
    rover.shutdown().await;
    let closed = std::future::poll_fn(|cx| at_client.poll_receive(cx, node::now()));
    let closed = within(closed).await;
    assert!(matches!(closed, Arrival::Closed(_)), "{closed:?}");
    let reason = std::iter::from_fn(|| at_client.transport.poll_record()).find_map(
        |(record, _)| match record.act {
            Act::Disconnected { reason } => Some(reason),
            _ => None,
        },
    );
    assert!(reason.unwrap().contains("the node stops"));
}

#[tokio::test]
async fn the_counters_of_a_link_are_in_the_reports_of_its_node() {
    let folder = tempfile::tempdir().unwrap();
    let (at_rover, _) = linked(&folder, IDS);
    let rover_key = Key::load(&folder.path().join("rover")).unwrap();
    let stranger = key(&folder, "stranger");
    let peers = [at_rover.local().unwrap()];
    let settings = Settings::new("127.0.0.1:0".parse().unwrap()).connect(peers[0]);
    let trust = trusting("rover", &rover_key, "101.255.255");
    let mut at_stranger = SecureLink::open(&stranger, trust, settings).unwrap();
    let rover = node(101, at_rover);
    assert!(at_stranger.probe(&peers, LIMIT).await[0].is_err());
    let counted = async {
        loop {
            let reports = rover.custom_links();
            assert_eq!(reports[0].name, "secure");
            let refused = |count: &&Count| count.name == "RefusedKeys" && count.value > 0;
            if let Some(count) = reports[0].counters.iter().find(refused) {
                break count.description;
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    let description = within(counted).await;
    assert_eq!(description, "handshakes refused: untrusted key");
    rover.shutdown().await;
}
