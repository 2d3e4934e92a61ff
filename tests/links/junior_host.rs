//! A node behind the node manager of Junior on the same host, which the test simulates: a Unix
//! datagram socket in a folder, as in the real one.
#![cfg(unix)]

use std::os::unix::net::UnixDatagram as StdDatagram;
use std::path::{Path, PathBuf};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::endpoint::{Counter, Outgoing};
use jaus::node::{AttachError, Config, Node, StartError};
use jaus::wire::{Acknowledgement, Broadcast, Flags, Frame, Version, judp};
use jaus_test_kit::waiting::{until, within_limit};
use tokio::net::UnixDatagram;

const VEHICLE: JausId = JausId::new(101, 1, 1);
const SENSOR: JausId = JausId::new(101, 1, 2);
const OPERATOR: JausId = JausId::new(42, 1, 1);
const MANAGER: JausId = JausId::from_u32(0);

const CONNECT: &[u8] = &[1, 0];
const ACCEPT: &[u8] = &[2, 0];
const CANCEL: &[u8] = &[3, 0];
const QUERY_HEARTBEAT: &[u8] = &[0x02, 0x22];
const REPORT_HEARTBEAT: &[u8] = &[0x02, 0x42];

/// A folder of sockets, removed when dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let name = format!("jaus-{test}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn client(&self, id: JausId) -> PathBuf {
        self.0.join(id.to_u32().to_string())
    }

    fn node(&self) -> Node {
        Node::start(Config::new(101, 1).junior(&self.0)).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The node manager, as a client sees it.
struct Manager<'a> {
    socket: UnixDatagram,
    folder: &'a Folder,
}

impl<'a> Manager<'a> {
    /// Starts in the folder. Like Junior, replaces an existing socket.
    fn start(folder: &'a Folder) -> Self {
        let path = folder.0.join("JuniorRTE");
        let _ = std::fs::remove_file(&path);
        let socket = UnixDatagram::bind(path).unwrap();
        Self { socket, folder }
    }

    /// The next message, with the octets of its datagram; probes are skipped, as by Junior.
    async fn next(&self) -> (Frame, Vec<u8>) {
        let mut buffer = [0; 5000];
        loop {
            let octets = within_limit(self.socket.recv(&mut buffer)).await.unwrap();
            if octets > 0 {
                let datagram = buffer[..octets].to_vec();
                let mut frames = judp::frames(datagram.clone().into()).unwrap();
                let frame = frames.next().unwrap().unwrap();
                assert_eq!(
                    frames.remaining(),
                    0,
                    "Junior reads one message of a datagram"
                );
                return (frame, datagram);
            }
        }
    }

    /// The next message from `source` whose payload begins with these octets.
    async fn wait_for(&self, source: JausId, payload: &[u8]) -> Frame {
        loop {
            let (frame, _) = self.next().await;
            if frame.source == source && frame.payload.starts_with(payload) {
                return frame;
            }
        }
    }

    fn deliver(&self, to: JausId, frame: &Frame) {
        let datagram = judp::encode(frame).unwrap();
        let sender = StdDatagram::unbound().unwrap();
        sender.send_to(&datagram, self.folder.client(to)).unwrap();
    }

    async fn accept(&self, id: JausId) {
        let connect = self.wait_for(id, CONNECT).await;
        assert_eq!(
            (connect.destination, connect.version),
            (MANAGER, Version::As5669)
        );
        let accept = Frame {
            version: Version::As5669,
            ..Frame::new(MANAGER, id, Bytes::from_static(ACCEPT))
        };
        self.deliver(id, &accept);
    }
}

fn message(source: JausId, destination: JausId, payload: &'static [u8], sequence: u16) -> Frame {
    Frame {
        sequence,
        ..Frame::new(source, destination, Bytes::from_static(payload))
    }
}

#[tokio::test]
async fn a_client_registers_in_juniors_own_octets_and_talks_both_ways() {
    let folder = Folder::new("both-ways");
    let manager = Manager::start(&folder);
    let node = folder.node();
    let mut vehicle = node.attach(1).unwrap();
    let (_, connect) = manager.next().await;
    let expected = b"\x01\0\0\x00\x10\x06\x02\x01\0\0\0\0\0\x01\x01\x65\0\0\0\0\0";
    assert_eq!(connect, expected);
    manager.accept(VEHICLE).await;
    until(|| node.junior().unwrap().is_registered).await;

    manager.deliver(VEHICLE, &message(OPERATOR, VEHICLE, QUERY_HEARTBEAT, 7));
    let query = vehicle.recv().await.unwrap();
    assert_eq!(
        (query.source, &query.payload[..]),
        (OPERATOR, QUERY_HEARTBEAT)
    );
    let report = Outgoing::new(VEHICLE, OPERATOR, Bytes::from_static(REPORT_HEARTBEAT));
    vehicle.send(report).unwrap();
    let report = manager.wait_for(VEHICLE, REPORT_HEARTBEAT).await;
    assert_eq!(
        (report.destination, report.version),
        (OPERATOR, Version::As5669a)
    );

    let everyone = JausId::EVERYONE;
    let query = Outgoing::new(VEHICLE, everyone, Bytes::from_static(QUERY_HEARTBEAT));
    vehicle.send(query).unwrap();
    assert_eq!(
        manager.wait_for(VEHICLE, QUERY_HEARTBEAT).await.destination,
        everyone
    );
}

#[tokio::test]
async fn each_component_is_a_client_and_takes_leave_when_it_goes() {
    let folder = Folder::new("components");
    let manager = Manager::start(&folder);
    let node = folder.node();
    let (vehicle, mut sensor) = (node.attach(1).unwrap(), node.attach(2).unwrap());
    manager.accept(VEHICLE).await;
    manager.accept(SENSOR).await;
    manager.deliver(SENSOR, &message(OPERATOR, SENSOR, QUERY_HEARTBEAT, 1));
    assert_eq!(sensor.recv().await.unwrap().source, OPERATOR);

    drop(vehicle);
    manager.wait_for(VEHICLE, CANCEL).await;
    assert!(!folder.client(VEHICLE).exists());
    let _again = node.attach(1).expect("the place is free at once");
    manager.accept(VEHICLE).await;
    drop(sensor);
    node.shutdown().await;
    let left = [VEHICLE, SENSOR].map(|id| folder.client(id).exists());
    assert_eq!(left, [false, false]);
}

/// Another client's broadcast arrives once for each of our components, with its wildcards.
#[tokio::test]
async fn a_broadcast_that_comes_by_each_socket_is_delivered_once_to_each() {
    let folder = Folder::new("broadcast");
    let manager = Manager::start(&folder);
    let node = folder.node();
    let (mut vehicle, mut sensor) = (node.attach(1).unwrap(), node.attach(2).unwrap());
    manager.accept(VEHICLE).await;
    manager.accept(SENSOR).await;
    let mut call = message(OPERATOR, JausId::EVERYONE, QUERY_HEARTBEAT, 3);
    call.flags = Flags::default().with_broadcast(Broadcast::Global);
    manager.deliver(VEHICLE, &call);
    manager.deliver(SENSOR, &call);
    let last = message(OPERATOR, SENSOR, REPORT_HEARTBEAT, 4);
    manager.deliver(SENSOR, &last);
    assert_eq!(vehicle.recv().await.unwrap().payload, QUERY_HEARTBEAT);
    assert_eq!(sensor.recv().await.unwrap().payload, QUERY_HEARTBEAT);
    assert_eq!(sensor.recv().await.unwrap().payload, REPORT_HEARTBEAT);
    assert_eq!(vehicle.counters().waiting, 0);
}

/// Junior forwards our own broadcasts to our other components, which already have them.
#[tokio::test]
async fn our_own_broadcast_that_junior_brings_back_is_no_second_one_and_no_conflict() {
    let folder = Folder::new("echo");
    let manager = Manager::start(&folder);
    let node = folder.node();
    let (vehicle, mut sensor) = (node.attach(1).unwrap(), node.attach(2).unwrap());
    manager.accept(VEHICLE).await;
    manager.accept(SENSOR).await;
    let call = Outgoing::new(
        VEHICLE,
        JausId::EVERYONE,
        Bytes::from_static(QUERY_HEARTBEAT),
    );
    vehicle.send(call).unwrap();
    let mut call = manager.wait_for(VEHICLE, QUERY_HEARTBEAT).await;
    call.flags = call.flags.with_broadcast(Broadcast::Global);
    manager.deliver(SENSOR, &call);
    manager.deliver(SENSOR, &message(OPERATOR, SENSOR, REPORT_HEARTBEAT, 1));
    assert_eq!(sensor.recv().await.unwrap().payload, QUERY_HEARTBEAT);
    assert_eq!(sensor.recv().await.unwrap().payload, REPORT_HEARTBEAT);
    assert_eq!(node.counters().get(Counter::IdConflict), 0);
}

#[tokio::test]
async fn discovery_answers_what_the_node_manager_brings_from_the_network() {
    let folder = Folder::new("discovery");
    let manager = Manager::start(&folder);
    let node = folder.node();
    let _vehicle = Component::builder(Kind::Vehicle, "Rover")
        .attach(&node, 1)
        .unwrap();
    manager.accept(VEHICLE).await;
    // Query Identification of a subsystem, to all; Junior replaced the wildcards with our id.
    let mut query = message(OPERATOR, VEHICLE, &[0x00, 0x2B, 2], 9);
    query.flags = Flags::default().with_broadcast(Broadcast::Global);
    manager.deliver(VEHICLE, &query);
    let report = manager.wait_for(VEHICLE, &[0x00, 0x4B]).await;
    assert_eq!(report.destination, OPERATOR);
    assert!(report.payload.ends_with(b"Rover"));
}

#[tokio::test]
async fn a_node_that_starts_first_waits_for_the_node_manager_and_finds_it_again_after_a_restart() {
    let folder = Folder::new("restart");
    let node = folder.node();
    let mut vehicle = node.attach(1).unwrap();
    let call = || {
        Outgoing::new(
            VEHICLE,
            JausId::EVERYONE,
            Bytes::from_static(QUERY_HEARTBEAT),
        )
    };
    vehicle.send(call()).unwrap();
    until(|| node.junior().unwrap().counters.manager_away == 1).await;

    let manager = Manager::start(&folder);
    manager.accept(VEHICLE).await;
    until(|| node.junior().unwrap().is_registered).await;
    drop(manager);
    // A quick restart: another socket at the same path.
    let manager = Manager::start(&folder);
    manager.accept(VEHICLE).await;
    until(|| node.junior().unwrap().is_registered).await;
    let counters = node.junior().unwrap().counters;
    assert_eq!((counters.failures, counters.registrations), (1, 2));
    manager.deliver(VEHICLE, &message(OPERATOR, VEHICLE, QUERY_HEARTBEAT, 1));
    assert_eq!(vehicle.recv().await.unwrap().source, OPERATOR);
}

#[tokio::test]
async fn a_node_manager_that_reads_nothing_blocks_nobody_and_all_is_counted() {
    const MESSAGES: u64 = 3000;
    let folder = Folder::new("stuck");
    let manager = Manager::start(&folder);
    let node = folder.node();
    let (vehicle, mut sensor) = (node.attach(1).unwrap(), node.attach(2).unwrap());
    manager.accept(VEHICLE).await;
    manager.accept(SENSOR).await;
    until(|| node.junior().unwrap().is_registered).await;
    let before = node.junior().unwrap().counters;
    for number in 0..MESSAGES {
        let payload = [QUERY_HEARTBEAT, &number.to_le_bytes()].concat();
        let call = Outgoing::new(VEHICLE, JausId::EVERYONE, payload.into());
        vehicle.send(call).unwrap();
        assert!(sensor.recv().await.is_some(), "the node goes on");
    }
    until(|| node.junior().unwrap().counters.send_overflows > 0).await;
    // The manager reads again and receives the kept messages: the newest ones.
    let mut read = 0;
    let newest = (MESSAGES - 1).to_le_bytes();
    while manager.wait_for(VEHICLE, QUERY_HEARTBEAT).await.payload[2..] != newest {
        read += 1;
    }
    read += 1;
    let counters = node.junior().unwrap().counters;
    assert_eq!(counters.sent - before.sent, read);
    assert_eq!(read + counters.send_overflows, MESSAGES);
}

#[tokio::test]
async fn an_id_of_another_client_is_refused_and_a_crashed_ones_taken_over() {
    let folder = Folder::new("taken");
    let other = StdDatagram::bind(folder.client(VEHICLE)).unwrap();
    let node = folder.node();
    let refused = node.attach(1).map(drop).unwrap_err();
    assert!(matches!(refused, AttachError::Link(_)), "{refused}");
    let words = refused.to_string();
    assert!(
        words.contains("101.1.1 is used by another client of Junior"),
        "{words}"
    );
    assert!(node.components().is_empty());
    drop(other);
    assert!(folder.client(VEHICLE).exists(), "as a crash leaves it");
    let _vehicle = node.attach(1).unwrap();
    let twice = node.attach(1).map(drop).unwrap_err();
    assert_eq!(twice, AttachError::AlreadyAttached(VEHICLE));
}

#[tokio::test]
async fn an_acknowledged_message_through_junior_is_acknowledged_end_to_end() {
    let folder = Folder::new("acknowledged");
    let manager = Manager::start(&folder);
    let node = folder.node();
    let vehicle = node.attach(1).unwrap();
    manager.accept(VEHICLE).await;
    let sender = vehicle.sender();
    let payload = [QUERY_HEARTBEAT, &[0x10; 9000]].concat();
    let delivered = tokio::spawn(async move {
        let message = Outgoing::new(VEHICLE, OPERATOR, payload.into());
        sender.deliver(message).await
    });
    while !delivered.is_finished() {
        let (frame, datagram) = tokio::select! {
            next = manager.next() => next,
            () = tokio::time::sleep(Duration::from_millis(10)) => continue,
        };
        assert!(
            datagram.len() <= 4094,
            "Junior reads no more than 5000 octets"
        );
        if frame.flags.acknowledgement() == Acknowledgement::Request {
            let acknowledgement = Frame {
                flags: frame.flags.with_acknowledgement(Acknowledgement::Positive),
                ..message(OPERATOR, VEHICLE, &[], frame.sequence)
            };
            manager.deliver(VEHICLE, &acknowledgement);
        }
    }
    assert_eq!(delivered.await.unwrap(), Ok(()));
}

#[tokio::test]
async fn settings_that_cannot_be_are_refused_with_the_reason() {
    let missing = Node::start(Config::new(101, 1).junior("/nowhere")).unwrap_err();
    assert!(matches!(missing, StartError::Junior(_)));
    assert!(missing.to_string().contains("/nowhere"), "{missing}");
    let mut router = Config::new(101, 1).junior(Path::new("/tmp"));
    router.routing.forward = true;
    let error = router.validate().unwrap_err().to_string();
    assert!(error.contains("routing.forward and junior"), "{error}");
}
