//! Large messages between two nodes on the loopback interface: without acknowledgement no loss,
//! although nothing is retransmitted; with acknowledgement no loss at any size.

use std::collections::BTreeSet;

use bytes::Bytes;
use jaus::endpoint::{Counter, Event, Outgoing};
use jaus::node::{Config, Node, Port};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::{until, within_limit};

/// A request for this size gives Linux's default receive buffer of 212992 octets: the kernel
/// doubles the requested size.
const USUAL_BUFFER: usize = 212_992 / 2;

/// Two nodes with one component each, which know each other's address.
async fn pair(receive_buffer: Option<usize>) -> ([Node; 2], [Port; 2]) {
    let group = own_group();
    let nodes = [101, 102].map(|subsystem| {
        let mut config = Config::loopback(subsystem, 1).group(group);
        if let Some(octets) = receive_buffer {
            config.receive_buffer = octets;
        }
        Node::start(config).unwrap()
    });
    let [sender, mut receiver] = nodes.each_ref().map(|node| node.attach(1).unwrap());
    sender
        .send(message(
            &sender,
            &receiver,
            Bytes::from_static(&[0x02, 0x22]),
        ))
        .unwrap();
    receive(&mut receiver).await;
    (nodes, [sender, receiver])
}

fn message(from: &Port, to: &Port, payload: Bytes) -> Outgoing {
    Outgoing::new(from.id(), to.id(), payload)
}

/// A payload that differs between messages.
fn image(length: usize, number: usize) -> Bytes {
    (0..length).map(|i| (i * 7 % 251 + number) as u8).collect()
}

async fn receive(port: &mut Port) -> Bytes {
    let message = within_limit(port.recv()).await;
    message.expect("a running node").payload
}

async fn a_thousand_arrive(receive_buffer: Option<usize>) {
    let (_nodes, [sender, mut receiver]) = pair(receive_buffer).await;
    for number in 0..1000 {
        let payload = image(100 << 10, number);
        sender
            .send(message(&sender, &receiver, payload.clone()))
            .unwrap();
        assert!(receive(&mut receiver).await == payload, "message {number}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_thousand_messages_of_100_kib_without_acknowledgement_all_arrive() {
    a_thousand_arrive(None).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn so_they_do_with_the_receive_buffers_that_sockets_usually_have() {
    a_thousand_arrive(Some(USUAL_BUFFER)).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn sixteen_mebibytes_with_acknowledgement_arrive_through_usual_buffers() {
    let (nodes, [sender, mut receiver]) = pair(Some(USUAL_BUFFER)).await;
    let mut events = nodes[0].events();
    let payload = image(16 << 20, 0);
    let handle = sender
        .send(Outgoing {
            acknowledge: true,
            ..message(&sender, &receiver, payload.clone())
        })
        .unwrap();
    assert!(receive(&mut receiver).await == payload);
    let told = async {
        while let Some(event) = events.recv().await {
            if matches!(event, Event::Acknowledged { message, .. } if message == handle) {
                return;
            }
        }
    };
    within_limit(told).await;
}

/// More messages than a mailbox holds.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_was_acknowledged_is_not_dropped_when_the_receiver_is_slow() {
    let (nodes, [sender, mut receiver]) = pair(None).await;
    const MESSAGES: usize = 40;
    let payloads: Vec<Bytes> = (0..MESSAGES).map(|number| image(1 << 20, number)).collect();
    let mut sent = Vec::new();
    for payload in &payloads {
        let message = message(&sender, &receiver, payload.clone());
        let sender = sender.sender();
        sent.push(tokio::spawn(async move { sender.deliver(message).await }));
    }
    // Read nothing until the mailbox is full.
    until(|| nodes[1].counters().get(Counter::ReceiverBusy) > 0).await;
    let mut received = Vec::new();
    while received.len() < MESSAGES {
        received.push(receive(&mut receiver).await);
    }
    for result in sent {
        result.await.unwrap().expect("all is read in the end");
    }
    let all = |payloads: &[Bytes]| {
        payloads
            .iter()
            .map(|payload| payload[0])
            .collect::<BTreeSet<_>>()
    };
    assert_eq!(all(&received), all(&payloads), "each once");
}
