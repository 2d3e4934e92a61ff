//! Live observation: taps, the debug view with slow and hostile viewers, the communicator between
//! two networks and its log. All on the loopback interface.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::support::{self, RAW, ip_packet, pcap, run};
use bytes::Bytes;
use futures_util::{SinkExt, StreamExt};
use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::endpoint::Outgoing;
use jaus::link::Group;
use jaus::node::{Config, Node, Port, Tapped, Way};
use jaus_test_kit::group::own_group;
use jaus_vehicle::parts::{Communicator, Part, Slot};
use jaus_view::debug::{DebugView, MOST_VIEWERS};
use jaus_view::{Dictionary, Filter, JournalSettings, Links, MessageStream};
use serde_json::Value as Json;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

/// Timeout of any wait; reached only when a test fails.
const LIMIT: Duration = Duration::from_secs(30);

/// Query Heartbeat Pulse, and the report.
const QUERY: &[u8] = &[0x02, 0x22];
const REPORT: &[u8] = &[0x02, 0x42];
/// A message of the example of an own service, and the definition.
const SET_LAMP: &[u8] = &[0x00, 0xD0, 0xCC];
const LAMP: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../examples/own-service/services"
);

/// A vehicle's node that joins UDP and TCP, an operator on UDP, and a board on TCP.
fn two_networks() -> (Node, Port, Port) {
    let group = own_group();
    let listen: SocketAddr = ([127, 0, 0, 1], 0).into();
    let mut config = Config::loopback(101, 1).group(group).tcp_listen(listen);
    config.routing.forward = true;
    let vehicle = Node::start(config).unwrap();
    let tcp = vehicle.tcp().and_then(|tcp| tcp.listening).unwrap();
    let operator = Node::start(Config::loopback(42, 1).group(group)).unwrap();
    let peer = tcp.to_string().parse().unwrap();
    let board = Node::start(Config::new(101, 2).without_udp().tcp_connect(peer)).unwrap();
    let ports = (operator.attach(1).unwrap(), board.attach(33).unwrap());
    (vehicle, ports.0, ports.1)
}

/// Sends until received: the connection may not exist yet.
async fn say_until_heard(from: &Port, payload: &'static [u8], to: &mut Port) {
    let say = async {
        loop {
            let said = Outgoing::new(from.id(), to.id(), Bytes::from_static(payload));
            from.send(said).unwrap();
            let heard = timeout(Duration::from_millis(50), to.recv()).await;
            // Earlier messages may arrive first.
            if heard.is_ok_and(|m| m.is_some_and(|m| m.payload == payload)) {
                return;
            }
        }
    };
    timeout(LIMIT, say).await.expect("it is heard");
}

/// A test's own directory, removed when dropped.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let name = format!("jaus-watch-{}-{name}", std::process::id());
        Self(std::env::temp_dir().join(name))
    }

    fn path(&self) -> &str {
        self.0.to_str().unwrap()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[tokio::test]
async fn what_passes_between_two_networks_is_seen_once_and_within_the_node_too() {
    let (vehicle, operator, mut board) = two_networks();
    let mut tap = vehicle.tap(4096);
    say_until_heard(&operator, QUERY, &mut board).await;
    let (one, mut other) = (vehicle.attach(7).unwrap(), vehicle.attach(8).unwrap());
    let report = Bytes::from_static(REPORT);
    one.send(Outgoing::new(one.id(), other.id(), report))
        .unwrap();
    timeout(LIMIT, other.recv()).await.unwrap().unwrap();

    let dictionary = Dictionary::new();
    let filter: Filter = "message=Heartbeat".parse().unwrap();
    let mut stream = MessageStream::new(&dictionary, filter);
    let mut links = Links::of(vehicle.clone());
    let (mut ways, mut shown) = (Vec::new(), Vec::new());
    while let Some(Tapped::Passage(passage)) = tap.try_next() {
        ways.push(passage.way);
        let entries = stream.read_passage(&passage, &mut links);
        shown.extend(entries.into_iter().map(|entry| {
            let text = |key| entry.text(key).unwrap_or_default().to_owned();
            (
                text("direction"),
                text("message"),
                text("source"),
                entry.json()["sequence"].clone(),
            )
        }));
    }
    assert!(ways.iter().any(|way| matches!(way, Way::In(_))));
    assert!(
        ways.iter().any(|way| matches!(way, Way::Out(..))),
        "passed on"
    );
    let passing: Vec<_> = shown.iter().filter(|(way, ..)| way == "passing").collect();
    assert!(!passing.is_empty());
    let mut numbers: Vec<_> = passing
        .iter()
        .map(|(.., number)| number.to_string())
        .collect();
    assert!(
        passing
            .iter()
            .all(|(_, name, source, _)| { name == "QueryHeartbeatPulse" && source == "42.1.1" })
    );
    let all = numbers.len();
    numbers.dedup();
    assert_eq!(
        numbers.len(),
        all,
        "came by UDP, went by TCP, is shown once"
    );
    let local: Vec<_> = shown.iter().filter(|(way, ..)| way == "local").collect();
    assert_eq!(local.len(), 1, "{shown:?}");
}

type Viewer = WebSocketStream<MaybeTlsStream<TcpStream>>;

async fn view(nodes: &[Node]) -> SocketAddr {
    let component = Component::builder(Kind::Vehicle, "Rover")
        .attach(&nodes[0], 35)
        .unwrap();
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
    let address = listener.local_addr().unwrap();
    let view = DebugView::new(nodes.to_vec(), component, Dictionary::new());
    tokio::spawn(view.serve(listener));
    address
}

async fn look_on(address: SocketAddr, query: &str) -> Viewer {
    let url = format!("ws://{address}/messages{query}");
    timeout(LIMIT, connect_async(url)).await.unwrap().unwrap().0
}

/// The next object, within the time limit of the test.
async fn next(viewer: &mut Viewer) -> Json {
    loop {
        let message = timeout(LIMIT, viewer.next())
            .await
            .unwrap()
            .unwrap()
            .unwrap();
        if let Message::Text(text) = message {
            return serde_json::from_str(&text).unwrap();
        }
    }
}

#[tokio::test]
async fn a_slow_viewer_loses_messages_and_is_told_how_many_while_the_traffic_goes_on() {
    const COUNT: u32 = 40_000;
    let node = Node::start(Config::loopback(101, 1).group(own_group())).unwrap();
    let address = view(std::slice::from_ref(&node)).await;
    let mut slow = look_on(address, "?message=EEEE").await;
    let (one, mut other) = (node.attach(7).unwrap(), node.attach(8).unwrap());
    let mut delivered = 0_u32;
    for number in 0..COUNT {
        let octets = [&[0xEE, 0xEE][..], &number.to_le_bytes(), &[0; 500]].concat();
        one.send(Outgoing::new(one.id(), other.id(), octets.into()))
            .unwrap();
        if number % 64 == 63 {
            tokio::task::yield_now().await;
            while other.try_recv().is_some() {
                delivered += 1;
            }
        }
    }
    let last = [&[0xEE, 0xEE][..], &COUNT.to_le_bytes()].concat();
    // Now the viewer reads all lines, and the number of lost ones.
    let (mut seen, mut lost, mut before) = (0, 0, None);
    loop {
        one.send(Outgoing::new(one.id(), other.id(), last.clone().into()))
            .unwrap();
        let object = next(&mut slow).await;
        if let Some(count) = object["lost"].as_u64() {
            lost += count;
            continue;
        }
        let octets = object["octets"].as_str().unwrap();
        let number = u32::from_str_radix(&octets[4..12], 16)
            .unwrap()
            .swap_bytes();
        if number == COUNT {
            break;
        }
        assert!(before < Some(number), "in order");
        before = Some(number);
        seen += 1;
    }
    while other.try_recv().is_some() {
        delivered += 1;
    }
    assert!(
        delivered >= COUNT,
        "the traffic has not waited: {delivered}"
    );
    assert!(lost > 0 && seen > 0, "{seen} seen, {lost} lost");
    assert!(
        u64::from(COUNT) <= seen + lost,
        "{seen} seen and {lost} lost of {COUNT}"
    );
}

#[tokio::test]
async fn a_view_of_two_nodes_shows_what_passes_between_them_once() {
    let group = own_group();
    let nodes = [101, 102].map(|it| Node::start(Config::loopback(it, 1).group(group)).unwrap());
    let address = view(&nodes).await;
    let mut viewer = look_on(address, "?message=EEEE").await;
    let (one, mut other) = (nodes[0].attach(7).unwrap(), nodes[1].attach(8).unwrap());
    let mut shown = Vec::new();
    for number in 0..u8::MAX {
        let octets = Bytes::copy_from_slice(&[0xEE, 0xEE, number]);
        one.send(Outgoing::new(one.id(), other.id(), octets))
            .unwrap();
        timeout(LIMIT, other.recv()).await.unwrap();
        // The viewer may not look on yet when the first ones pass.
        let Ok(object) = timeout(Duration::from_millis(50), next(&mut viewer)).await else {
            continue;
        };
        let octets = object["octets"].as_str().unwrap().to_owned();
        assert!(!shown.contains(&octets), "shown twice: {object}");
        shown.push(octets);
        if shown.len() == 10 {
            return;
        }
    }
    panic!("{shown:?}");
}

#[tokio::test]
async fn a_viewer_can_only_look_and_mistakes_and_crowds_are_refused() {
    let node = Node::start(Config::loopback(101, 1).group(own_group())).unwrap();
    let address = view(std::slice::from_ref(&node)).await;
    let refused = |query: &str| {
        let url = format!("ws://{address}/messages{query}");
        async move {
            match timeout(LIMIT, connect_async(url)).await.unwrap() {
                Err(Error::Http(response)) => {
                    let body = response.body().clone().unwrap_or_default();
                    (response.status().as_u16(), String::from_utf8(body).unwrap())
                }
                other => panic!("{other:?}"),
            }
        }
    };
    let (status, words) = refused("?component=rover").await;
    assert_eq!(status, 400);
    assert!(words.contains("`rover`"), "{words}");
    assert_eq!(refused("?mesage=x").await.0, 400);

    let mut talker = look_on(address, "").await;
    talker
        .send(Message::text("{\"type\":\"drive\"}"))
        .await
        .unwrap();
    let giant = Message::binary(vec![0; 100_000]);
    // The connection may be closed meanwhile.
    let _ = talker.send(giant).await;
    let closed = async { while let Some(Ok(_)) = talker.next().await {} };
    timeout(LIMIT, closed)
        .await
        .expect("what is too long ends it");

    let mut viewers = Vec::new();
    let (status, words) = loop {
        let url = format!("ws://{address}/messages");
        match timeout(LIMIT, connect_async(url)).await.unwrap() {
            Ok((viewer, _)) => viewers.push(viewer),
            Err(Error::Http(response)) => {
                let body = response.body().clone().unwrap_or_default();
                break (response.status().as_u16(), String::from_utf8(body).unwrap());
            }
            Err(other) => panic!("{other}"),
        }
    };
    assert_eq!(status, 503);
    assert!(words.contains("viewers is reached"), "{words}");
    assert!(viewers.len() <= MOST_VIEWERS);
}

#[tokio::test]
async fn the_communicator_logs_what_passes_and_its_log_is_read_back_with_filters() {
    let scratch = Scratch::new("log");
    let (vehicle, mut operator, mut board) = two_networks();
    let part = Communicator {
        log: Some(JournalSettings::new(&scratch.0)),
        ..Communicator::default()
    };
    let slot = Slot::new(
        vehicle.attach(35).unwrap(),
        vehicle.clone(),
        Kind::Vehicle,
        "Rover",
    );
    let running = tokio::spawn(part.run(slot));
    // It runs once its component answers.
    let ask = async {
        loop {
            let query = Bytes::from_static(&[0x00, 0x2B, 0x02]);
            let to = JausId::new(101, 1, 35);
            operator
                .send(Outgoing::new(operator.id(), to, query))
                .unwrap();
            let heard = timeout(Duration::from_millis(50), operator.recv()).await;
            if heard.is_ok_and(|m| m.is_some_and(|m| m.payload.starts_with(&[0x00, 0x4B]))) {
                return;
            }
        }
    };
    timeout(LIMIT, ask).await.unwrap();
    say_until_heard(&operator, QUERY, &mut board).await;
    say_until_heard(&board, REPORT, &mut operator).await;
    vehicle.shutdown().await;
    timeout(LIMIT, running).await.unwrap().unwrap().unwrap_err();

    let lines = |filter: &[&str]| {
        let arguments = [&["watch", scratch.path(), "--json"], filter].concat();
        let read = run(&arguments, b"");
        assert_eq!(read.status, 0, "{read:?}");
        read.json()
    };
    let queries = lines(&["--from", "42", "--message", "QueryHeartbeatPulse"]);
    let reports = lines(&["--filter", "from=101.2.33 message=4202"]);
    assert!(!queries.is_empty() && !reports.is_empty());
    let named = lines(&["--field", "identification=rover"]);
    assert!(!named.is_empty() && named.iter().all(|line| line["source"] == "101.1.35"));
    assert!(lines(&["--component", "7"]).is_empty());

    let words = run(&["watch", scratch.path(), "--message", "Heartbeat"], b"");
    assert!(words.stdout.contains("42.1.1 → 101.2.33"), "{words:?}");
    let counted = run(&["watch", scratch.path(), "--stats"], b"");
    assert!(
        counted.stdout.contains("QueryHeartbeatPulse"),
        "{counted:?}"
    );
    let wrong = run(&["watch", scratch.path(), "--field", "speed>fast"], b"");
    assert_eq!(wrong.status, 2);
    assert!(wrong.stderr.contains("--field speed>fast"), "{wrong:?}");
}

#[tokio::test]
async fn an_interface_is_watched_without_a_communicator() {
    let group = own_group();
    let at = group.to_string();
    let watching = tokio::task::spawn_blocking(move || {
        let interface = ["watch", "--interface", "lo", "--group", &at];
        // With the privilege it sees the traffic of other tests, too.
        let chosen = ["--from", "4243", "--json", "--for", "3s"];
        run(&[interface, chosen].concat(), b"")
    });
    let node = Node::start(Config::loopback(4243, 1).group(group)).unwrap();
    let client = node.attach(1).unwrap();
    while !watching.is_finished() {
        let query = Bytes::from_static(QUERY);
        client
            .send(Outgoing::new(client.id(), JausId::EVERYONE, query))
            .unwrap();
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let watched = watching.await.unwrap();
    let first = watched.stdout.lines().next().unwrap_or_default();
    let first: Json = serde_json::from_str(first).unwrap_or_else(|_| panic!("{watched:?}"));
    assert_eq!(first["message"], "QueryHeartbeatPulse");
    assert_eq!(first["source"], "4243.1.1");
    assert_eq!(watched.status, 0, "{watched:?}");
}

#[tokio::test]
async fn jaus_watch_shows_what_passes_a_communicator_process() {
    let group = own_group();
    let Group::At(at) = group else { unreachable!() };
    let debug = {
        let probe = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        probe.local_addr().unwrap().to_string()
    };
    let mut communicator = Command::new(env!("CARGO_BIN_EXE_jaus-communicator"))
        .args(["--loopback", "--for", "60s", "--group", &at.to_string()])
        .args(["--debug", &debug])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let connected = async {
        while connect_async(format!("ws://{debug}/messages"))
            .await
            .is_err()
        {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LIMIT, connected).await.unwrap();
    let watching = tokio::task::spawn_blocking(move || {
        let watch = |flags: &[&str]| {
            let live = ["watch", "--at", &debug, "--for", "3s"];
            run(&[&live, flags].concat(), b"")
        };
        let lamp = ["--jsidl", LAMP, "--message", "SetLamp", "--json"];
        std::thread::scope(|scope| {
            let own = scope.spawn(|| watch(&lamp));
            let seen = watch(&["--message", "QueryHeartbeat*"]);
            (seen, own.join().unwrap())
        })
    });
    let node = Node::start(Config::loopback(42, 1).group(group)).unwrap();
    let operator = node.attach(1).unwrap();
    while !watching.is_finished() {
        let query = Bytes::from_static(QUERY);
        let to = JausId::new(101, 1, 35);
        for message in [query, Bytes::from_static(SET_LAMP)] {
            operator
                .send(Outgoing::new(operator.id(), to, message))
                .unwrap();
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let (seen, own) = watching.await.unwrap();
    let _ = communicator.kill();
    let _ = communicator.wait();
    assert_eq!(seen.status, 0, "{seen:?}");
    assert!(seen.stdout.lines().count() > 1, "{seen:?}");
    for line in seen.stdout.lines() {
        assert!(line.contains("42.1.1 → 101.1.35"), "{line}");
        assert!(line.contains("received QueryHeartbeatPulse"), "{line}");
    }
    // The communicator does not know this service; the viewer has its definition.
    let lines = own.json();
    assert!(!lines.is_empty(), "{own:?}");
    for line in lines {
        assert_eq!(line["message"], "SetLamp", "{line}");
        assert_eq!(line["body"]["Brightness"], 80.0, "{line}");
    }
}

#[test]
fn a_file_is_watched_to_its_end_and_what_was_skipped_is_said() {
    let scratch = Scratch::new("skipped");
    std::fs::create_dir_all(&scratch.0).unwrap();
    let file = scratch.0.join("some.pcap");
    let mut foreign = ip_packet(b"this is not JAUS");
    // Other ports.
    foreign[20..24].copy_from_slice(&[0x9C, 0x40, 0x9C, 0x41]);
    let message = ip_packet(&support::Message::new(QUERY).datagram());
    std::fs::write(&file, pcap(RAW, &[message, foreign])).unwrap();
    let seen = run(&["watch", file.to_str().unwrap()], b"");
    assert!(seen.stdout.contains("QueryHeartbeatPulse"), "{seen:?}");
    let note = "note: 1 datagrams and TCP segments skipped";
    assert!(seen.stderr.contains(note), "{seen:?}");
    let limited = run(&["watch", file.to_str().unwrap(), "--for", "1s"], b"");
    assert!(
        limited.stderr.contains("cannot be used with"),
        "{limited:?}"
    );
    assert_eq!(limited.status, 2);
}

#[test]
fn without_a_communicator_watch_says_what_to_do() {
    let free = std::net::TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let address = free.local_addr().unwrap().to_string();
    drop(free);
    let seen = run(&["watch", "--at", &address], b"");
    assert_eq!(seen.status, 2);
    assert!(seen.stderr.contains("jaus-communicator"), "{seen:?}");
    let seen = run(&["watch", "/nowhere/at-all.pcapng"], b"");
    assert_eq!(seen.status, 2);
    assert!(seen.stderr.contains("/nowhere/at-all.pcapng"), "{seen:?}");
}
