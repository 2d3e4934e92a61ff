//! A component on the host's node behaves like one in the node's own process.

use std::pin::pin;
use std::task::{Context, Waker};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::component::{Component, Kind, Level};
use jaus::endpoint::{Counter, Outgoing};
use jaus::node::{
    ComponentEvent, Config, Departure, HostError, HostEvent, Node, SendError, Undelivered,
};
use jaus::wire::{Broadcast, Priority};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::{until, within_limit};

use crate::local::place::{Place, component_event, message, receive};

#[tokio::test]
async fn messages_go_both_ways_with_all_that_is_said_about_them() {
    let place = Place::new();
    let node = place.node();
    let mut here = node.attach(1).unwrap();
    let mut there = place.host().attach(33).await.unwrap();
    assert_eq!(there.id(), JausId::new(101, 1, 33));

    let urgent = Outgoing {
        priority: Priority::SafetyCritical,
        ..message(&there, here.id(), b"stop")
    };
    there.send(urgent.clone()).unwrap();
    let heard = receive(&mut here).await;
    assert_eq!((heard.source, heard.to), (there.id(), here.id()));
    assert_eq!(
        (heard.priority, &heard.payload),
        (urgent.priority, &urgent.payload)
    );

    here.send(message(&here, JausId::EVERYONE, b"hello"))
        .unwrap();
    let heard = receive(&mut there).await;
    assert_eq!((heard.source, heard.to), (here.id(), there.id()));
    assert_eq!(
        (heard.destination, heard.broadcast),
        (JausId::EVERYONE, Broadcast::Global)
    );
    assert_eq!(heard.path, None);
}

#[tokio::test]
async fn two_component_processes_talk_through_their_node_also_in_large_messages() {
    let place = Place::new();
    let mut config = place.config();
    config.max_message = 16 << 20;
    config.mailbox.octets = 40 << 20;
    let _node = Node::start(config).unwrap();
    let mut one = place.host().attach(1).await.unwrap();
    let mut two = place.host().attach(2).await.unwrap();
    for length in [0, 1, 4000, 8190, 8192, 20_000, 100_000, (16 << 20) - 2] {
        let body: Vec<u8> = (0..length).map(|at| (at % 251) as u8).collect();
        one.send(message(&one, two.id(), &body)).unwrap();
        let heard = receive(&mut two).await;
        assert!(heard.payload[2..] == body[..], "{length} octets");
        two.send(message(&two, one.id(), &body)).unwrap();
        let heard = receive(&mut one).await;
        assert!(heard.payload[2..] == body[..], "{length} octets back");
    }
}

#[tokio::test]
async fn a_sender_learns_whether_its_message_has_arrived() {
    let place = Place::new();
    let node = place.node();
    let here = node.attach(1).unwrap();
    let there = place.host().attach(33).await.unwrap();
    let nobody = JausId::new(101, 1, 200);

    assert_eq!(
        within_limit(there.deliver(message(&there, here.id(), b"x"))).await,
        Ok(())
    );
    assert_eq!(
        within_limit(here.deliver(message(&here, there.id(), b"x"))).await,
        Ok(())
    );
    for port in [&here, &there] {
        let outcome = within_limit(port.deliver(message(port, nobody, b"x"))).await;
        let Err(Undelivered::NotAcknowledged(shortfall)) = outcome else {
            panic!("{outcome:?}");
        };
        assert_eq!(shortfall.destination, nobody);
    }
}

#[tokio::test]
async fn a_message_whose_sender_no_longer_waits_is_not_sent_again() {
    let place = Place::new();
    let group = own_group();
    let node = Node::start(Config::loopback(101, 1).group(group).local(place.address())).unwrap();
    let other = Node::start(Config::loopback(102, 1).group(group)).unwrap();
    let there = place.host().attach(33).await.unwrap();
    let receiver = other.attach(1).unwrap();
    let id = receiver.id();
    assert_eq!(
        within_limit(there.deliver(message(&there, id, b"1"))).await,
        Ok(())
    );
    drop(receiver);
    let delivery = there.deliver(message(&there, id, b"2"));
    tokio::time::timeout(Duration::from_millis(150), delivery)
        .await
        .expect_err("nobody acknowledges");
    let mut successor = other.attach(1).unwrap();
    tokio::time::sleep(Duration::from_millis(1500)).await;
    assert_eq!(successor.try_recv(), None);
    assert_eq!(node.counters().get(Counter::MessagesCancelled), 1);
    there.send(message(&there, id, b"3")).unwrap();
    assert_eq!(receive(&mut successor).await.payload[2..], *b"3");
}

#[tokio::test]
async fn what_was_cancelled_while_the_node_did_not_run_is_not_sent_at_all() {
    let place = Place::new();
    let node = place.node();
    let mut receiver = node.attach(1).unwrap();
    let there = place.host().attach(33).await.unwrap();
    {
        // On a runtime of one thread the node runs only when this task waits.
        let mut delivery = pin!(there.deliver(message(&there, receiver.id(), b"2")));
        let mut cx = Context::from_waker(Waker::noop());
        assert!(delivery.as_mut().poll(&mut cx).is_pending());
    }
    there.send(message(&there, receiver.id(), b"3")).unwrap();
    assert_eq!(receive(&mut receiver).await.payload[2..], *b"3");
}

#[tokio::test]
async fn a_component_process_gets_the_numbers_of_the_senders_on_other_nodes() {
    let place = Place::new();
    let group = own_group();
    let node = Node::start(Config::loopback(101, 1).group(group).local(place.address())).unwrap();
    let other = Node::start(Config::loopback(102, 1).group(group)).unwrap();
    let mut there = place.host().attach(33).await.unwrap();
    let (away, here) = (other.attach(1).unwrap(), node.attach(1).unwrap());
    let mut numbers = Vec::new();
    for _ in 0..2 {
        let sent = away.deliver(message(&away, there.id(), b"x"));
        assert_eq!(within_limit(sent).await, Ok(()));
        numbers.push(receive(&mut there).await.sequence.unwrap());
    }
    let step = numbers[1].wrapping_sub(numbers[0]);
    assert!((1..10).contains(&step), "{numbers:?}");
    here.send(message(&here, there.id(), b"x")).unwrap();
    assert_eq!(receive(&mut there).await.sequence, None);
}

#[tokio::test]
async fn what_cannot_be_sent_is_told_at_once_or_by_the_node() {
    let place = Place::new();
    let mut config = place.config();
    config.max_message = 500_000;
    let _node = Node::start(config).unwrap();
    let port = place.host().attach(33).await.unwrap();
    let mut events = port.host_events();
    let to = JausId::new(101, 1, 1);

    let short = Outgoing::new(port.id(), to, Bytes::from_static(&[1]));
    assert!(matches!(port.send(short), Err(SendError::Endpoint(_))));
    let long = port.send(message(&port, to, vec![0; 1 << 20])).unwrap_err();
    assert!(long.to_string().contains("500000"), "{long}");
    let forged = Outgoing {
        source: to,
        ..message(&port, to, b"x")
    };
    assert!(matches!(port.send(forged), Err(SendError::Endpoint(_))));

    let nobody = JausId::new(101, 1, 0);
    let handle = port.send(message(&port, nobody, b"x")).unwrap();
    let Some(HostEvent::Rejected {
        message: rejected,
        why,
    }) = within_limit(events.recv()).await
    else {
        panic!("no word of the message to nobody");
    };
    assert_eq!(rejected, handle);
    assert!(why.contains("not a valid destination"), "{why}");
    let outcome = within_limit(port.deliver(message(&port, nobody, b"x"))).await;
    assert_eq!(outcome, Err(Undelivered::Rejected(why)));
}

#[tokio::test]
async fn a_second_claimant_is_told_who_has_the_id() {
    let place = Place::new();
    let node = place.node();
    let _own = node.attach(1).unwrap();
    let first = place.host().name("planner").attach(33).await.unwrap();
    let pid = std::process::id();

    let refused = |error: HostError| match error {
        HostError::Refused { words, .. } => words,
        other => panic!("{other}"),
    };
    let words = refused(place.host().attach(33).await.unwrap_err());
    assert!(words.contains("101.1.33 is used by \"planner\""), "{words}");
    assert!(words.contains(&format!("process {pid}")), "{words}");
    let words = refused(place.host().attach(1).await.unwrap_err());
    assert!(words.contains("used by the node itself"), "{words}");
    let words = refused(place.host().attach(255).await.unwrap_err());
    assert!(
        words.contains("101.1.255 is not a single component"),
        "{words}"
    );
    assert!(node.attach(33).is_err());

    let mut events = node.component_events();
    drop(first);
    let gone = |event: &ComponentEvent| matches!(event, ComponentEvent::Detached { .. });
    let gone = component_event(&mut events, gone).await;
    let ComponentEvent::Detached { process, why, .. } = gone else {
        panic!()
    };
    assert_eq!(
        (process.unwrap().name.as_str(), why),
        ("planner", Departure::Left)
    );
    within_limit(place.host().attach(33)).await.unwrap();
}

#[tokio::test]
async fn an_attached_component_is_found_and_answers() {
    let place = Place::new();
    let node = place.node();
    let port = place.host().attach(33).await.unwrap();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .live_on(port)
        .unwrap();
    let other = Component::builder(Kind::Vehicle, "Other")
        .attach(&node, 1)
        .unwrap();
    let found = within_limit(other.find("urn:jaus:jss:core:Liveness"))
        .await
        .unwrap();
    assert_eq!(found, rover.id());
}

#[tokio::test]
async fn a_guest_that_passes_by_does_not_rename_the_vehicle() {
    let place = Place::new();
    let node = place.node();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .attach(&node, 1)
        .unwrap();
    let port = place.host().attach(33).await.unwrap();
    let guest = Component::builder(Kind::OtherSubsystem, "").component_name("guest");
    let guest = guest.live_on(port).unwrap();
    let called = |component: &Component, level, id, wanted: &str| {
        let directory = component.directory();
        directory
            .identification(level, id)
            .is_some_and(|told| told.name == wanted)
    };
    until(|| {
        called(&rover, Level::Component, guest.id(), "guest")
            && called(&guest, Level::Subsystem, rover.id(), "Rover")
    })
    .await;
    assert!(called(&rover, Level::Subsystem, rover.id(), "Rover"));
}

#[tokio::test]
async fn what_is_to_be_acknowledged_is_refused_where_there_is_no_room_for_it() {
    let place = Place::new();
    let node = place.node();
    let full = node.attach(1).unwrap();
    let here = node.attach(2).unwrap();
    let there = place.host().attach(33).await.unwrap();
    let limit = node.config().mailbox.messages;
    for _ in 0..limit {
        here.send(message(&here, full.id(), b"x")).unwrap();
    }
    // What was not acknowledged makes room for half as many that are.
    for _ in 0..limit / 2 {
        let outcome = within_limit(here.deliver(message(&here, full.id(), b"x"))).await;
        assert_eq!(outcome, Ok(()));
    }
    // Sent after all of these, because components are served in the order of their messages.
    assert_eq!(
        within_limit(here.deliver(message(&here, there.id(), b"x"))).await,
        Ok(())
    );
    let refused = SendError::Endpoint(jaus::endpoint::SendError::ReceiverFull(full.id()));
    let words = refused.to_string();
    let outcome = within_limit(here.deliver(message(&here, full.id(), b"x"))).await;
    assert_eq!(outcome, Err(Undelivered::NotSent(refused)));
    let outcome = within_limit(there.deliver(message(&there, full.id(), b"x"))).await;
    assert_eq!(outcome, Err(Undelivered::Rejected(words)));
    assert_eq!(full.counters().dropped, limit as u64 / 2);
}

#[tokio::test]
async fn a_flush_ends_also_when_another_sender_writes_what_waits() {
    let place = Place::new();
    let _node = place.node();
    let port = place.host().attach(33).await.unwrap();
    let nobody = JausId::new(101, 1, 200);
    // The first is written at once; the second waits until the task runs.
    port.send(message(&port, nobody, b"one")).unwrap();
    port.send(message(&port, nobody, b"two")).unwrap();
    let sender = port.sender();
    let mut flushed = std::pin::pin!(sender.flushed());
    let mut look = Context::from_waker(Waker::noop());
    assert!(
        flushed.as_mut().poll(&mut look).is_pending(),
        "the second still waits"
    );
    // Enough data that the sender writes the whole backlog before the task runs.
    port.send(message(&port, nobody, [0; 20_000])).unwrap();
    assert!(
        flushed.as_mut().poll(&mut look).is_ready(),
        "all is written"
    );
}
