//! The running gateway with a JAUS vehicle on loopback: what its node and its log tell it.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a test with real sockets and time"
)]

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::link::Group;
use jaus::messages::core::QueryControl;
use jaus::node::{Config, DecisionRecorder, Node, Recorder};
use jaus::rights::{Acceptance, Decided, Refusal, Unaccepted, Verdict};
use jaus_ra::RaId;
use jaus_ra::gateway::{RaGateway, Settings};
use jaus_test_kit::group::own_group;
use jaus_test_kit::rover::datagram;
use jaus_test_kit::waiting::{until, within_limit};
use jaus_vehicle::parts::{Part, PrimitiveDriver, Slot};
use tokio::net::UdpSocket;

const DRIVER: JausId = JausId::new(101, 1, 33);
const RA_DRIVER: RaId = RaId::new(101, 1, 33, 33);

/// An audit log that cannot be written, and what it would hold.
#[derive(Clone, Default)]
struct Broken(Arc<Mutex<Vec<(String, Verdict)>>>);

impl DecisionRecorder<RaId> for Broken {
    fn record(&mut self, decided: Decided<RaId>) {
        let decision = decided.decision;
        let mut entries = self.0.lock().unwrap();
        entries.push((decision.what, decision.verdict));
    }

    fn refuses_commands(&self) -> bool {
        true
    }
}

/// A gateway and a vehicle.
struct Scene {
    group: Group,
    gateway: Node,
    log: Broken,
    to: SocketAddr,
    vehicle: Node,
}

impl Scene {
    async fn start(grants: Acceptance) -> Self {
        let group = own_group();
        let node = |subsystem| Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
        let (vehicle, gateway) = (node(101), node(250));
        let slot = |node: &Node, component, kind| {
            Slot::new(node.attach(component).unwrap(), node.clone(), kind, "Part")
        };
        tokio::spawn(PrimitiveDriver::default().run(slot(&vehicle, 33, Kind::Vehicle)));
        // A free port: another program may take it, but none looks for one there.
        let free = UdpSocket::bind("127.0.0.1:0").await.unwrap();
        let to = free.local_addr().unwrap();
        drop(free);
        let log = Broken::default();
        let part = RaGateway {
            settings: Settings {
                grants,
                ..Settings::default()
            },
            interface: Some("127.0.0.1".to_owned()),
            group: Group::Off,
            port: to.port(),
            recorder: Some(Recorder::new(log.clone())),
            ..RaGateway::default()
        };
        tokio::spawn(part.run(slot(&gateway, 1, Kind::OtherSubsystem)));
        Self {
            group,
            gateway,
            log,
            to,
            vehicle,
        }
    }

    /// An RA component sends a message to the vehicle's driver, again and again.
    fn repeat(&self, source: RaId, code: u16, data: &'static [u8]) {
        let (to, octets) = (self.to, datagram(source, RA_DRIVER, code, data));
        tokio::spawn(async move {
            let socket = UdpSocket::bind("127.0.0.1:0").await.unwrap();
            loop {
                socket.send_to(&octets, to).await.unwrap();
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
        });
    }

    async fn end(self) {
        self.gateway.shutdown().await;
        self.vehicle.shutdown().await;
    }
}

#[tokio::test]
async fn while_the_log_cannot_be_written_the_running_gateway_refuses_control() {
    let grants = Acceptance::new(["20 control=127".parse().unwrap()]);
    let scene = Scene::start(grants).await;
    scene.repeat(RaId::new(20, 1, 32, 1), 0x000D, &[127]);
    let entries = || scene.log.0.lock().unwrap().clone();
    until(|| !entries().is_empty()).await;
    let refused = Verdict::Refused(Unaccepted::Rule(Refusal::Unrecorded));
    for entry in entries() {
        assert_eq!(entry, ("RequestControl".to_owned(), refused));
    }
    scene.end().await;
}

#[tokio::test]
async fn the_running_gateway_gives_an_id_up_as_soon_as_the_jaus_side_uses_it() {
    let scene = Scene::start(Settings::default().grants).await;
    scene.repeat(RaId::new(60, 1, 33, 1), 0x2002, &[]);
    let guest = JausId::new(60, 1, 33);
    let has_id = || scene.gateway.components().iter().any(|it| it.id == guest);
    until(has_id).await;
    let node = Node::start(Config::loopback(60, 1).group(scene.group)).unwrap();
    let station = Component::builder(Kind::OperatorControlUnit, "Station");
    let station = station.attach(&node, 33).unwrap();
    until(|| !has_id()).await;
    let answered = async { while station.query(DRIVER, &QueryControl {}).await.is_err() {} };
    within_limit(answered).await;
    assert!(!has_id());
    node.shutdown().await;
    scene.end().await;
}
