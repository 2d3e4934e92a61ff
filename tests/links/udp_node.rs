//! Whole nodes with real sockets on the loopback interface: unicast, both broadcast scopes,
//! acknowledgement, components that do not read, and shutdown. Needs no network.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Counter, Event, Outgoing, Received, Shortfall, Unacknowledged};
use jaus::link::Group;
use jaus::node::{Config, Events, MailboxLimits, Node, Port, StartError};
use jaus::wire::{Broadcast, Priority};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;

const QUERY_HEARTBEAT: Bytes = Bytes::from_static(&[0x02, 0x22]);
const REPORT_HEARTBEAT: Bytes = Bytes::from_static(&[0x02, 0x42]);

fn start(subsystem: u16, node: u8, group: Group) -> Node {
    Node::start(Config::loopback(subsystem, node).group(group)).unwrap()
}

async fn receive(port: &mut Port) -> Received {
    within_limit(port.recv()).await.expect("a running node")
}

async fn event(events: &mut Events, wanted: impl Fn(&Event) -> bool) -> Event {
    let search = async {
        loop {
            let event = events.recv().await.expect("a running node");
            if wanted(&event) {
                return event;
            }
        }
    };
    within_limit(search).await
}

fn to(port: &Port, destination: JausId, payload: Bytes) -> Outgoing {
    Outgoing::new(port.id(), destination, payload)
}

#[tokio::test]
async fn nodes_that_never_met_talk_by_id_alone() {
    let group = own_group();
    let (a, b) = (start(101, 1, group), start(102, 1, group));
    let (mut driver, mut console) = (a.attach(33).unwrap(), b.attach(1).unwrap());

    console
        .send(to(&console, driver.id(), QUERY_HEARTBEAT))
        .unwrap();
    let query = receive(&mut driver).await;
    assert_eq!(
        (query.source, &query.payload),
        (console.id(), &QUERY_HEARTBEAT)
    );

    driver
        .send(to(&driver, query.source, REPORT_HEARTBEAT))
        .unwrap();
    let report = receive(&mut console).await;
    assert_eq!(
        (report.source, &report.payload),
        (driver.id(), &REPORT_HEARTBEAT)
    );
    // The answer went to the query's source address.
    assert_eq!(report.broadcast, Broadcast::None);
    assert_eq!(report.path.unwrap().peer, a.links()[0].local.into());
    assert_eq!(b.peers()[0].path.peer, a.links()[0].local.into());
}

#[tokio::test]
async fn a_global_broadcast_reaches_every_matching_component_once() {
    let group = own_group();
    let (a, b, c) = (
        start(101, 1, group),
        start(101, 2, group),
        start(102, 1, group),
    );
    let mut ports = [a.attach(2), b.attach(1), b.attach(2), c.attach(1)].map(Result::unwrap);
    let sender = a.attach(1).unwrap();

    sender
        .send(to(&sender, JausId::EVERYONE, QUERY_HEARTBEAT))
        .unwrap();
    sender
        .send(to(&sender, JausId::EVERYONE, REPORT_HEARTBEAT))
        .unwrap();
    for port in &mut ports {
        let (first, second) = (receive(port).await, receive(port).await);
        assert_eq!(
            [&first.payload, &second.payload],
            [&QUERY_HEARTBEAT, &REPORT_HEARTBEAT]
        );
        assert_eq!(first.destination, JausId::EVERYONE);
        assert_eq!(port.counters().delivered, 2);
    }
}

#[tokio::test]
async fn a_local_broadcast_stays_in_its_subsystem() {
    let group = own_group();
    let (a, b, c) = (
        start(101, 1, group),
        start(101, 2, group),
        start(102, 1, group),
    );
    let sender = a.attach(1).unwrap();
    let (mut sibling, mut stranger) = (b.attach(1).unwrap(), c.attach(1).unwrap());

    let local = Outgoing {
        broadcast: Broadcast::Local,
        ..to(&sender, JausId::new(101, 255, 255), QUERY_HEARTBEAT)
    };
    sender.send(local).unwrap();
    sender
        .send(to(&sender, JausId::EVERYONE, REPORT_HEARTBEAT))
        .unwrap();

    assert_eq!(receive(&mut sibling).await.payload, QUERY_HEARTBEAT);
    assert_eq!(receive(&mut sibling).await.payload, REPORT_HEARTBEAT);
    // Sent later, received first: the other one had a different destination.
    assert_eq!(receive(&mut stranger).await.payload, REPORT_HEARTBEAT);
}

#[tokio::test]
async fn who_asks_for_an_acknowledgement_is_told_when_it_comes_and_when_it_does_not() {
    let group = own_group();
    let (a, b) = (start(101, 1, group), start(102, 1, group));
    let (sender, receiver) = (a.attach(1).unwrap(), b.attach(1).unwrap());
    let mut events = a.events();

    let asking = |destination| Outgoing {
        acknowledge: true,
        ..to(&sender, destination, REPORT_HEARTBEAT)
    };
    let heard = sender.send(asking(receiver.id())).unwrap();
    let wanted = Event::Acknowledged {
        message: heard,
        by: receiver.id(),
    };
    event(&mut events, |event| *event == wanted).await;

    let nobody = JausId::new(103, 1, 1);
    let unheard = sender.send(asking(nobody)).unwrap();
    let wanted = Event::NotAcknowledged {
        message: unheard,
        shortfall: Shortfall {
            destination: nobody,
            reason: Unacknowledged::TimedOut,
            acknowledged: 0,
            length: REPORT_HEARTBEAT.len() as u32,
        },
    };
    event(&mut events, |event| *event == wanted).await;
}

#[tokio::test]
async fn a_second_node_with_the_same_id_is_announced() {
    let group = own_group();
    let (a, b) = (start(101, 1, group), start(101, 1, group));
    let mut events = a.events();
    let (_ours, theirs) = (a.attach(1).unwrap(), b.attach(1).unwrap());
    theirs
        .send(to(&theirs, JausId::EVERYONE, REPORT_HEARTBEAT))
        .unwrap();
    let conflict = event(&mut events, |event| {
        matches!(event, Event::IdConflict { .. })
    })
    .await;
    let Event::IdConflict { id, path } = conflict else {
        unreachable!()
    };
    assert_eq!((id, path.peer), (theirs.id(), b.links()[0].local.into()));
}

#[tokio::test]
async fn peers_named_by_address_are_found_without_multicast() {
    let a = start(101, 1, Group::Off);
    let address = a.links()[0].local;
    let b = Config::loopback(102, 1)
        .group(Group::Off)
        .peer(address.to_string().parse().unwrap());
    let b = Node::start(b).unwrap();
    let (mut driver, mut console) = (a.attach(33).unwrap(), b.attach(1).unwrap());

    console
        .send(to(&console, JausId::EVERYONE, QUERY_HEARTBEAT))
        .unwrap();
    let query = receive(&mut driver).await;
    driver
        .send(to(&driver, query.source, REPORT_HEARTBEAT))
        .unwrap();
    assert_eq!(receive(&mut console).await.source, driver.id());
}

#[tokio::test]
async fn a_peer_named_with_its_id_is_spoken_to_directly() {
    let a = start(101, 1, own_group());
    let address = a.links()[0].local;
    let peer = format!("101.255.255@{address}").parse().unwrap();
    let b = Node::start(Config::loopback(102, 1).group(own_group()).peer(peer)).unwrap();
    let (mut driver, console) = (a.attach(33).unwrap(), b.attach(1).unwrap());

    console
        .send(to(&console, driver.id(), QUERY_HEARTBEAT))
        .unwrap();
    assert_eq!(receive(&mut driver).await.broadcast, Broadcast::None);
    console
        .send(to(&console, JausId::EVERYONE, REPORT_HEARTBEAT))
        .unwrap();
    assert_eq!(receive(&mut driver).await.broadcast, Broadcast::Global);
}

#[tokio::test]
async fn a_component_that_does_not_read_stops_nobody_and_keeps_the_urgent() {
    let group = own_group();
    let limits = MailboxLimits {
        messages: 10,
        ..MailboxLimits::default()
    };
    let mut config = Config::loopback(101, 1).group(group);
    config.mailbox = limits;
    let a = Node::start(config).unwrap();
    let b = start(102, 1, group);
    let (mut lazy, mut eager) = (a.attach(1).unwrap(), a.attach(2).unwrap());
    let sender = b.attach(1).unwrap();
    // The first message to a new peer asks for an acknowledgement, and what is acknowledged stays.
    let first = sender.deliver(to(&sender, lazy.id(), QUERY_HEARTBEAT));
    assert_eq!(within_limit(first).await, Ok(()));
    receive(&mut lazy).await;

    let urgent = Outgoing {
        priority: Priority::SafetyCritical,
        ..to(&sender, lazy.id(), QUERY_HEARTBEAT)
    };
    sender.send(urgent).unwrap();
    for n in 0..100_u8 {
        let payload = Bytes::copy_from_slice(&[0x02, 0x42, n]);
        sender
            .send(to(&sender, lazy.id(), payload.clone()))
            .unwrap();
        sender
            .send(to(&sender, eager.id(), payload.clone()))
            .unwrap();
        assert_eq!(receive(&mut eager).await.payload, payload);
    }
    let counters = lazy.counters();
    assert_eq!(
        (counters.delivered, counters.dropped, counters.waiting),
        (102, 91, 10)
    );
    assert_eq!(lazy.try_recv().unwrap().payload, QUERY_HEARTBEAT);
    assert_eq!(lazy.try_recv().unwrap().payload[..], [0x02, 0x42, 91]);
}

#[tokio::test]
async fn large_messages_arrive_whole_whatever_the_size_of_packets() {
    for payload_limit in [64, 1425, 4079] {
        let group = own_group();
        let mut config = Config::loopback(101, 1).group(group);
        config.payload_limit = payload_limit;
        config.max_message = 1 << 20;
        let a = Node::start(config.clone()).unwrap();
        config.subsystem = 102;
        let b = Node::start(config).unwrap();
        let (mut receiver, sender) = (a.attach(1).unwrap(), b.attach(1).unwrap());

        // Fits into a default receive buffer.
        for length in [2, 1425, 1426, 100_000] {
            let image: Bytes = (0..length).map(|i| (i * 7 % 251) as u8).collect();
            sender
                .send(to(&sender, receiver.id(), image.clone()))
                .unwrap();
            assert!(
                receive(&mut receiver).await.payload == image,
                "{length} octets"
            );
        }
    }
}

#[tokio::test]
async fn what_is_sent_before_the_end_still_arrives_and_then_every_port_ends() {
    let group = own_group();
    let (a, b) = (start(101, 1, group), start(102, 1, group));
    let (mut first, mut second) = (a.attach(1).unwrap(), a.attach(2).unwrap());
    let mut other = b.attach(1).unwrap();
    let mut events = a.events();

    first
        .send(to(&first, JausId::EVERYONE, REPORT_HEARTBEAT))
        .unwrap();
    a.clone().shutdown().await;
    assert_eq!(receive(&mut other).await.payload, REPORT_HEARTBEAT);
    assert_eq!(
        second.recv().await.map(|m| m.payload),
        Some(REPORT_HEARTBEAT)
    );
    assert_eq!((first.recv().await, second.recv().await), (None, None));
    assert!(
        first
            .send(to(&first, other.id(), REPORT_HEARTBEAT))
            .is_err()
    );
    while events.recv().await.is_some() {}
    assert!(a.links().is_empty());
    a.shutdown().await;
}

#[tokio::test]
async fn a_node_ends_when_nobody_holds_it_and_its_port_is_free_again() {
    let config = Config::loopback(101, 1).group(own_group());
    let a = Node::start(config.clone()).unwrap();
    let number = a.links()[0].local.port();
    let mut events = a.events();
    let port = a.attach(1).unwrap();
    drop(a);
    assert_eq!(port.id(), JausId::new(101, 1, 1));
    drop(port);
    assert_eq!(within_limit(events.recv()).await, None);
    Node::start(config.port(number)).unwrap();
}

#[tokio::test]
async fn an_id_is_attached_once_and_can_be_taken_again() {
    let a = start(101, 1, own_group());
    let port = a.attach(1).unwrap();
    assert!(a.attach(1).is_err());
    assert!(a.attach(0).is_err() && a.attach(255).is_err());
    drop(port);
    a.attach(1).unwrap();
}

#[tokio::test]
async fn a_component_cannot_send_for_another() {
    let a = start(101, 1, own_group());
    let (one, two) = (a.attach(1).unwrap(), a.attach(2).unwrap());
    assert!(
        one.send(to(&two, JausId::EVERYONE, REPORT_HEARTBEAT))
            .is_err()
    );
}

#[tokio::test]
async fn a_node_that_cannot_start_says_why() {
    let group = own_group();
    let first = start(101, 1, group);
    let number = first.links()[0].local.port();
    let text = |config: Config| Node::start(config).unwrap_err().to_string();

    let taken = text(Config::loopback(102, 1).group(group).port(number));
    assert!(
        taken.contains(&format!("UDP port {number} of 127.0.0.1 is taken")),
        "{taken}"
    );
    let nowhere = text(Config::new(102, 1).interfaces(["nosuch0"]));
    assert!(
        nowhere.contains("`nosuch0`") && nowhere.contains("127.0.0.1"),
        "{nowhere}"
    );
    let nobody = text(Config::loopback(0, 1));
    assert!(nobody.contains("1 to 65534"), "{nobody}");
}

#[test]
fn a_node_outside_of_a_runtime_says_what_it_needs() {
    let error = Node::start(Config::loopback(101, 1)).unwrap_err();
    assert!(matches!(error, StartError::NoRuntime), "{error}");
}

/// Sends a message that is not acknowledged, because its receiver has left, and drops the future.
/// Returns the receiver's successor under its id after the time in which the message would have been
/// retransmitted.
async fn give_up_waiting(sender: &Port, node: &Node, receiver: Port) -> Port {
    let to_receiver = || to(sender, receiver.id(), QUERY_HEARTBEAT);
    assert_eq!(within_limit(sender.deliver(to_receiver())).await, Ok(()));
    let id = receiver.id();
    drop(receiver);
    let delivery = sender.deliver(to(sender, id, REPORT_HEARTBEAT));
    tokio::time::timeout(Duration::from_millis(150), delivery)
        .await
        .expect_err("nobody acknowledges");
    let successor = node.attach(id.component()).unwrap();
    tokio::time::sleep(Duration::from_millis(1500)).await;
    successor
}

#[tokio::test]
async fn a_message_whose_sender_no_longer_waits_reaches_no_successor() {
    let group = own_group();
    let (a, b) = (start(101, 1, group), start(102, 1, group));
    let (driver, console) = (a.attach(33).unwrap(), b.attach(1).unwrap());
    let mut successor = give_up_waiting(&console, &a, driver).await;
    assert_eq!(successor.try_recv(), None);
    assert_eq!(b.counters().get(Counter::MessagesCancelled), 1);
    console
        .send(to(&console, successor.id(), QUERY_HEARTBEAT))
        .unwrap();
    assert_eq!(receive(&mut successor).await.payload, QUERY_HEARTBEAT);
}
