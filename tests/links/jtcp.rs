//! Nodes connected by TCP on the loopback interface, with each other and with scripted peers that
//! imitate other stacks or misbehave. Needs no network.

use std::net::SocketAddr;
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received, first_sequence_at};
use jaus::node::{Config, Node, PeerAddress, Port, StartError};
use jaus::peer::Implementation as Known;
use jaus::wire::jtcp::{self, Decoder};
use jaus::wire::{Acknowledgement, Frame, Version};
use jaus_test_kit::waiting::{until, within_limit};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

const QUERY_HEARTBEAT: Bytes = Bytes::from_static(&[0x02, 0x22]);
const REPORT_HEARTBEAT: Bytes = Bytes::from_static(&[0x02, 0x42]);

/// A node without UDP that accepts connections.
fn listening(subsystem: u16) -> Config {
    let at: SocketAddr = ([127, 0, 0, 1], 0).into();
    Config::new(subsystem, 1).without_udp().tcp_listen(at)
}

/// A node without UDP that connects to another; `id` is the peer's configured id.
fn connecting(subsystem: u16, to: SocketAddr, id: &str) -> Config {
    let peer: PeerAddress = format!("{id}{to}").parse().unwrap();
    Config::new(subsystem, 1).without_udp().tcp_connect(peer)
}

fn address(node: &Node) -> SocketAddr {
    node.tcp()
        .and_then(|tcp| tcp.listening)
        .expect("a listener")
}

async fn receive(port: &mut Port) -> Received {
    within_limit(port.recv()).await.expect("a running node")
}

fn to(port: &Port, destination: JausId, payload: Bytes) -> Outgoing {
    Outgoing::new(port.id(), destination, payload)
}

/// Sends queries until the receiver gets one: there may be no connection yet.
async fn ask_until_heard(console: &Port, driver: &mut Port) -> Received {
    let ask = async {
        loop {
            console
                .send(to(console, driver.id(), QUERY_HEARTBEAT))
                .unwrap();
            let answer = tokio::time::timeout(Duration::from_millis(50), driver.recv());
            if let Ok(message) = answer.await {
                return message.expect("a running node");
            }
        }
    };
    within_limit(ask).await
}

/// A peer scripted by the test.
struct Scripted {
    stream: TcpStream,
    decoder: Decoder,
}

impl Scripted {
    async fn connect(address: SocketAddr) -> Self {
        Self {
            stream: within_limit(TcpStream::connect(address)).await.unwrap(),
            decoder: Decoder::new(),
        }
    }

    async fn write(&mut self, octets: &[u8]) {
        within_limit(self.stream.write_all(octets)).await.unwrap();
    }

    /// The next frame; `None` if the other side has closed the connection.
    async fn read(&mut self) -> Option<Frame> {
        let read = async {
            loop {
                if let Some(frame) = self.decoder.next_frame().expect("a sound stream") {
                    return Some(frame);
                }
                // A reset also counts as the end.
                if self
                    .stream
                    .read_buf(self.decoder.input())
                    .await
                    .unwrap_or(0)
                    == 0
                {
                    return None;
                }
            }
        };
        within_limit(read).await
    }
}

fn frame(source: JausId, destination: JausId, sequence: u16) -> Frame {
    Frame {
        sequence,
        ..Frame::new(source, destination, QUERY_HEARTBEAT)
    }
}

#[tokio::test]
async fn nodes_without_udp_talk_over_one_connection_in_both_directions() {
    let vehicle = Node::start(listening(101)).unwrap();
    let operator = Node::start(connecting(102, address(&vehicle), "")).unwrap();
    let mut drivers = [1, 2, 3].map(|component| vehicle.attach(component).unwrap());
    let mut console = operator.attach(1).unwrap();

    for driver in &mut drivers {
        let query = ask_until_heard(&console, driver).await;
        assert_eq!(
            (query.source, &query.payload),
            (console.id(), &QUERY_HEARTBEAT)
        );
        driver
            .send(to(driver, query.source, REPORT_HEARTBEAT))
            .unwrap();
        let report = receive(&mut console).await;
        assert_eq!(
            (report.source, &report.payload),
            (driver.id(), &REPORT_HEARTBEAT)
        );
    }
    // Three ids at one end, one at the other, and one connection between them.
    assert_eq!(operator.peers().len(), 3);
    assert_eq!(vehicle.tcp().unwrap().counters.accepted, 1);
    assert!(vehicle.links().is_empty() && operator.links().is_empty());
}

#[tokio::test]
async fn a_broadcast_goes_to_all_connections() {
    let station = Node::start(listening(101)).unwrap();
    let vehicles = [102, 103].map(|id| Node::start(connecting(id, address(&station), "")).unwrap());
    let mut drivers = vehicles
        .each_ref()
        .map(|vehicle| vehicle.attach(1).unwrap());
    let console = station.attach(1).unwrap();
    until(|| station.tcp().unwrap().connections.len() == 2).await;

    console
        .send(to(&console, JausId::EVERYONE, QUERY_HEARTBEAT))
        .unwrap();
    for driver in &mut drivers {
        assert_eq!(receive(driver).await.payload, QUERY_HEARTBEAT);
    }
}

#[tokio::test]
async fn a_large_message_arrives_whole() {
    let vehicle = Node::start(listening(101)).unwrap();
    let mut operator = connecting(102, address(&vehicle), "101.255.255@");
    // Junior's fragment size: 64 KB in 17 messages.
    operator.payload_limit = 4079;
    let operator = Node::start(operator).unwrap();
    let (mut driver, console) = (vehicle.attach(1).unwrap(), operator.attach(1).unwrap());
    ask_until_heard(&console, &mut driver).await;
    let received = vehicle.tcp().unwrap().counters.received;

    let map: Bytes = (0..65_536_u32).map(|n| ((n * 7) >> 3) as u8).collect();
    console
        .send(to(&console, driver.id(), map.clone()))
        .unwrap();
    loop {
        // The query may have been sent more than once.
        let message = receive(&mut driver).await;
        if message.payload != QUERY_HEARTBEAT {
            assert!(message.payload == map);
            break;
        }
    }
    assert!(vehicle.tcp().unwrap().counters.received >= received + 17);
}

/// Junior writes the version octet once, and TCP may split the stream anywhere.
#[tokio::test]
async fn a_peer_that_writes_one_octet_at_a_time_is_answered_on_its_connection() {
    let vehicle = Node::start(listening(101)).unwrap();
    let mut driver = vehicle.attach(1).unwrap();
    let mut junior = Scripted::connect(address(&vehicle)).await;
    let (asking, other) = (JausId::new(2, 1, 1), JausId::new(2, 1, 7));

    let first = Frame {
        flags: frame(asking, driver.id(), 1)
            .flags
            .with_acknowledgement(Acknowledgement::Request),
        ..frame(asking, driver.id(), 1)
    };
    let second = frame(other, driver.id(), 2);
    let stream = [
        &jtcp::encode(&first).unwrap()[..],
        &jtcp::encode(&second).unwrap()[1..],
    ]
    .concat();
    for octet in stream {
        junior.write(&[octet]).await;
        tokio::task::yield_now().await;
    }
    assert_eq!(receive(&mut driver).await.source, asking);
    assert_eq!(receive(&mut driver).await.source, other);
    let acknowledgement = junior.read().await.unwrap();
    assert!(acknowledgement.is_acknowledgement() && acknowledgement.sequence == 1);

    driver.send(to(&driver, other, REPORT_HEARTBEAT)).unwrap();
    let report = junior.read().await.unwrap();
    assert_eq!(
        (report.destination, report.payload),
        (other, REPORT_HEARTBEAT)
    );
    assert_eq!(report.flags.acknowledgement(), Acknowledgement::None);
}

/// Junior opens a connection for each id, and assigns a connection to the first id received on it.
#[tokio::test]
async fn each_id_is_answered_on_the_connection_on_which_it_was_heard_last() {
    let vehicle = Node::start(listening(101)).unwrap();
    let mut driver = vehicle.attach(1).unwrap();
    let ids = [JausId::new(2, 1, 1), JausId::new(2, 1, 2)];
    let mut connections = Vec::new();
    for id in ids {
        let mut connection = Scripted::connect(address(&vehicle)).await;
        let encoded = jtcp::encode(&frame(id, driver.id(), 1)).unwrap();
        connection.write(&encoded).await;
        assert_eq!(receive(&mut driver).await.source, id);
        connections.push(connection);
    }
    for (connection, id) in connections.iter_mut().zip(ids) {
        driver.send(to(&driver, id, REPORT_HEARTBEAT)).unwrap();
        let report = connection.read().await.unwrap();
        assert_eq!((report.destination, report.payload), (id, REPORT_HEARTBEAT));
    }
    // The peer restarts, and opens a new connection for the first id.
    let mut again = Scripted::connect(address(&vehicle)).await;
    let encoded = jtcp::encode(&frame(ids[0], driver.id(), 2)).unwrap();
    again.write(&encoded).await;
    receive(&mut driver).await;
    driver.send(to(&driver, ids[0], REPORT_HEARTBEAT)).unwrap();
    assert_eq!(again.read().await.unwrap().destination, ids[0]);
}

/// Junior takes messages of a restarted node for old ones if their sequence numbers are old.
#[tokio::test]
async fn a_node_begins_at_the_number_that_the_clock_tells() {
    let now = || {
        let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        first_sequence_at(since_1970.unwrap())
    };
    let earliest = now();
    let vehicle = Node::start(listening(101)).unwrap();
    let started = now().wrapping_sub(earliest);
    let mut driver = vehicle.attach(1).unwrap();
    let mut junior = Scripted::connect(address(&vehicle)).await;
    let query = frame(JausId::new(2, 1, 1), driver.id(), 1);
    junior.write(&jtcp::encode(&query).unwrap()).await;
    receive(&mut driver).await;
    driver
        .send(to(&driver, query.source, REPORT_HEARTBEAT))
        .unwrap();
    let number = junior.read().await.unwrap().sequence;
    // The first message has the next number; 0 is skipped.
    let ahead = number.wrapping_sub(earliest);
    assert!((1..=started + 2).contains(&ahead), "{ahead} of {started}");
}

/// JAUS++ writes the version octet before each message, in its own segment.
#[tokio::test]
async fn a_version_octet_before_each_message_is_taken() {
    let vehicle = Node::start(listening(101)).unwrap();
    let mut driver = vehicle.attach(1).unwrap();
    let mut jausplusplus = Scripted::connect(address(&vehicle)).await;
    jausplusplus.stream.set_nodelay(true).unwrap();
    for sequence in 1..=3 {
        let encoded = jtcp::encode(&frame(JausId::new(2, 1, 1), driver.id(), sequence)).unwrap();
        jausplusplus.write(&encoded[..1]).await;
        jausplusplus.write(&encoded[1..]).await;
    }
    for _ in 0..3 {
        assert_eq!(receive(&mut driver).await.payload, QUERY_HEARTBEAT);
    }
}

/// Other stacks might also send Register Services to another subsystem; only the version octet
/// before each message makes it certain.
#[tokio::test]
async fn jauspp_is_recognised_by_the_version_octets_in_its_stream() {
    let registration = Bytes::from_static(b"\x00\x0B\x00");
    let vehicle = Node::start(listening(101)).unwrap();
    let mut driver = vehicle.attach(1).unwrap();
    for (id, again, profile) in [
        (JausId::new(2, 1, 1), &[2][..], Known::JausPlusPlus),
        (JausId::new(3, 1, 1), &[], Known::Standard),
    ] {
        let message = |sequence| Frame {
            payload: registration.clone(),
            ..frame(id, driver.id(), sequence)
        };
        let [first, second] = [7, 8].map(|it| jtcp::encode(&message(it)).unwrap());
        let mut peer = Scripted::connect(address(&vehicle)).await;
        peer.write(&[&first, again, &second[1..]].concat()).await;
        for _message in 0..2 {
            receive(&mut driver).await;
        }
        let recognised = || {
            let known = vehicle.peers().into_iter().find(|it| it.id == id);
            known.is_some_and(|it| it.profile == profile)
        };
        until(recognised).await;
    }
}

#[tokio::test]
async fn a_peer_with_the_older_header_is_answered_with_it() {
    let vehicle = Node::start(listening(101)).unwrap();
    let mut driver = vehicle.attach(1).unwrap();
    let mut peer = Scripted::connect(address(&vehicle)).await;
    let older = Frame {
        version: Version::As5669,
        ..frame(JausId::new(2, 1, 1), driver.id(), 1)
    };
    peer.write(&jtcp::encode(&older).unwrap()).await;
    let query = receive(&mut driver).await;
    driver
        .send(to(&driver, query.source, REPORT_HEARTBEAT))
        .unwrap();
    let report = peer.read().await.unwrap();
    assert_eq!(
        (report.version, report.payload),
        (Version::As5669, REPORT_HEARTBEAT)
    );
    assert_eq!(peer.decoder.version(), Some(Version::As5669));
}

#[tokio::test]
async fn rubbish_costs_the_connection_and_what_was_learned_through_it() {
    let vehicle = Node::start(listening(101)).unwrap();
    let mut driver = vehicle.attach(1).unwrap();
    let mut peer = Scripted::connect(address(&vehicle)).await;
    peer.write(&jtcp::encode(&frame(JausId::new(2, 1, 1), driver.id(), 1)).unwrap())
        .await;
    receive(&mut driver).await;
    assert_eq!(vehicle.peers().len(), 1);

    peer.write(&[0, 3, 0, 0]).await;
    assert_eq!(peer.read().await, None);
    let counters = vehicle.tcp().unwrap().counters;
    assert_eq!((counters.malformed, counters.closed), (1, 1));
    assert!(vehicle.peers().is_empty() && vehicle.tcp().unwrap().connections.is_empty());
}

#[tokio::test]
async fn a_peer_that_does_not_read_loses_its_own_messages_only() {
    let vehicle = Node::start(listening(101)).unwrap();
    let mut driver = vehicle.attach(1).unwrap();
    let (slow_id, quick_id) = (JausId::new(2, 1, 1), JausId::new(3, 1, 1));
    let mut slow = Scripted::connect(address(&vehicle)).await;
    slow.write(&jtcp::encode(&frame(slow_id, driver.id(), 1)).unwrap())
        .await;
    receive(&mut driver).await;
    let mut quick = Scripted::connect(address(&vehicle)).await;
    quick
        .write(&jtcp::encode(&frame(quick_id, driver.id(), 1)).unwrap())
        .await;
    receive(&mut driver).await;

    // Sends until the backlog is full and a message is lost.
    let payload = Bytes::from(vec![2; 1400]);
    let lost = || vehicle.tcp().unwrap().counters.send_overflows;
    let mut sent: u16 = 0;
    while lost() == 0 {
        for _ in 0..100 {
            driver.send(to(&driver, slow_id, payload.clone())).unwrap();
        }
        tokio::task::yield_now().await;
        sent += 1;
        assert!(sent < 1000, "100 MB fit somewhere");
    }
    for number in 0..500_u16 {
        let report = Bytes::copy_from_slice(&number.to_be_bytes());
        driver.send(to(&driver, quick_id, report)).unwrap();
        let received = quick.read().await.unwrap();
        assert_eq!(received.payload[..], number.to_be_bytes());
    }
    let connections = vehicle.tcp().unwrap().connections;
    let overflows: Vec<_> = connections.iter().map(|c| c.overflows > 0).collect();
    assert_eq!(overflows.iter().filter(|&&lost| lost).count(), 1);
    // The connection is still open: the backlog arrives when the peer reads.
    assert_eq!(slow.read().await.unwrap().payload, payload);
}

#[tokio::test]
async fn a_peer_that_was_restarted_is_connected_to_again() {
    let vehicle = Node::start(listening(101)).unwrap();
    let place = address(&vehicle);
    let operator = Node::start(connecting(102, place, "101.255.255@")).unwrap();
    let console = operator.attach(1).unwrap();
    ask_until_heard(&console, &mut vehicle.attach(1).unwrap()).await;

    vehicle.shutdown().await;
    until(|| operator.tcp().unwrap().connections.is_empty()).await;
    let again = Config::new(101, 1).without_udp().tcp_listen(place);
    let vehicle = Node::start(again).unwrap();
    let mut driver = vehicle.attach(1).unwrap();
    ask_until_heard(&console, &mut driver).await;
    assert_eq!(operator.tcp().unwrap().counters.connected, 2);
}

/// Only the peer's address is known, and there is no connection yet.
#[tokio::test]
async fn the_first_message_to_an_unknown_id_waits_for_the_connection() {
    let far = tokio::net::TcpListener::bind(("127.0.0.1", 0))
        .await
        .unwrap();
    let operator = Node::start(connecting(102, far.local_addr().unwrap(), "")).unwrap();
    let console = operator.attach(1).unwrap();
    let unknown = JausId::new(101, 1, 33);
    console
        .send(to(&console, unknown, QUERY_HEARTBEAT))
        .unwrap();
    let (stream, _) = within_limit(far.accept()).await.unwrap();
    let mut peer = Scripted {
        stream,
        decoder: Decoder::new(),
    };
    let heard = peer.read().await.expect("the message");
    assert_eq!(
        (heard.destination, heard.payload),
        (unknown, QUERY_HEARTBEAT)
    );
}

#[tokio::test]
async fn more_connections_than_allowed_are_refused() {
    let mut config = listening(101);
    config.tcp.max_accepted = 2;
    let vehicle = Node::start(config).unwrap();
    let driver = vehicle.attach(1).unwrap();
    let mut kept = Vec::new();
    for subsystem in [2, 3] {
        let mut peer = Scripted::connect(address(&vehicle)).await;
        let hello = frame(JausId::new(subsystem, 1, 1), driver.id(), 1);
        peer.write(&jtcp::encode(&hello).unwrap()).await;
        kept.push(peer);
    }
    let mut third = Scripted::connect(address(&vehicle)).await;
    assert_eq!(third.read().await, None);
    let tcp = vehicle.tcp().unwrap();
    assert_eq!((tcp.connections.len(), tcp.counters.refused), (2, 1));
}

#[tokio::test]
async fn a_port_that_is_taken_is_an_error_that_says_so() {
    let vehicle = Node::start(listening(101)).unwrap();
    let taken = Config::new(102, 1)
        .without_udp()
        .tcp_listen(address(&vehicle));
    let error = Node::start(taken).unwrap_err();
    assert!(matches!(error, StartError::Link(_)), "{error:?}");
    let port = address(&vehicle).port();
    assert!(
        error
            .to_string()
            .contains(&format!("TCP port {port} of 127.0.0.1 is taken")),
        "{error}"
    );
}
