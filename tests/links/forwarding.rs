//! A node that forwards messages between UDP and TCP, with real sockets on the loopback interface.
//! Needs no network.

use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Counter, Outgoing, Received};
use jaus::node::{Config, Node, Port};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::{until, within_limit};

/// A router with UDP and TCP and a component of its own, one component reached over UDP and one
/// over TCP.
fn network(forward: bool) -> (Vec<Node>, [Port; 3]) {
    let group = own_group();
    let listen: SocketAddr = ([127, 0, 0, 1], 0).into();
    let mut config = Config::loopback(103, 1).group(group).tcp_listen(listen);
    config.routing.forward = forward;
    let router = Node::start(config).unwrap();
    let tcp = router.tcp().and_then(|tcp| tcp.listening).unwrap();
    let by_udp = Node::start(Config::loopback(101, 1).group(group)).unwrap();
    let peer = tcp.to_string().parse().unwrap();
    let by_tcp = Node::start(Config::new(102, 1).without_udp().tcp_connect(peer)).unwrap();
    let ports = [&router, &by_udp, &by_tcp].map(|node| node.attach(1).unwrap());
    (vec![router, by_udp, by_tcp], ports)
}

/// Sends repeatedly until the message is received: there may be no connection yet.
async fn say_until_heard(from: &Port, destination: JausId, to: &mut Port) -> Received {
    let say = async {
        loop {
            let payload = Bytes::from_static(&[0x02, 0x22]);
            from.send(Outgoing::new(from.id(), destination, payload))
                .unwrap();
            let heard = tokio::time::timeout(Duration::from_millis(50), to.recv());
            if let Ok(message) = heard.await {
                return message.expect("a running node");
            }
        }
    };
    within_limit(say).await
}

#[tokio::test]
async fn a_large_acknowledged_message_passes_from_udp_to_tcp_and_back() {
    let (nodes, [mut own, mut udp, mut tcp]) = network(true);
    let heard = say_until_heard(&tcp, udp.id(), &mut udp).await;
    assert_eq!(heard.source, tcp.id());
    let image: Bytes = (0..200_000).map(|i| (i * 7 % 251) as u8).collect();
    for (from, to) in [(0, 1), (1, 0)] {
        let mut ends = [&mut udp, &mut tcp];
        let destination = ends[to].id();
        let message = Outgoing {
            acknowledge: true,
            ..Outgoing::new(ends[from].id(), destination, image.clone())
        };
        let (sent, received) = {
            let [one, other] = &mut ends;
            let (sender, receiver) = if from == 0 {
                (one, other)
            } else {
                (other, one)
            };
            let receive = async {
                loop {
                    let message = receiver.recv().await.expect("a running node");
                    if message.payload.len() > 2 {
                        return message;
                    }
                }
            };
            within_limit(async { tokio::join!(sender.deliver(message), receive) }).await
        };
        assert_eq!(sent, Ok(()));
        assert!(received.payload == image);
    }
    let counters = nodes[0].counters();
    assert!(counters.get(Counter::MessagesForwarded) > 280, "{counters}");
    assert_eq!(own.try_recv(), None, "nothing of it was for the router");
}

#[tokio::test]
async fn a_broadcast_reaches_the_routers_component_and_the_other_side() {
    let (_nodes, [mut own, mut udp, mut tcp]) = network(true);
    say_until_heard(&tcp, udp.id(), &mut udp).await;
    let heard = say_until_heard(&udp, JausId::EVERYONE, &mut tcp).await;
    assert_eq!(heard.source, udp.id());
    let heard = within_limit(own.recv()).await;
    assert_eq!(heard.unwrap().source, udp.id());
}

#[tokio::test]
async fn a_node_that_was_not_asked_to_forward_does_not() {
    let (nodes, [mut own, udp, mut tcp]) = network(false);
    say_until_heard(&tcp, own.id(), &mut own).await;
    let heard = say_until_heard(&udp, own.id(), &mut own);
    within_limit(heard).await;
    udp.send(Outgoing::new(
        udp.id(),
        tcp.id(),
        Bytes::from_static(&[0x02, 0x22]),
    ))
    .unwrap();
    until(|| nodes[0].counters().get(Counter::NotForUs) > 0).await;
    assert_eq!(nodes[0].counters().get(Counter::MessagesForwarded), 0);
    assert_eq!(tcp.try_recv(), None);
}
