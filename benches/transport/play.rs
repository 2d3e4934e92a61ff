//! Runs a child process in its role.

use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::{Config, Node, Port};

use crate::place::{self, Place};
use crate::roles::{CODE, COUNT, Role, is, runtime};
use crate::{baseline, fan_out, idle, loss, relay};

/// Plays a role for the lifetime of the process.
pub(crate) fn play(role: Role) {
    match role {
        Role::UdpEcho => baseline::udp_echo(),
        Role::UdpSink(batching) => baseline::udp_sink(batching),
        Role::StreamEcho(at) => relay::stream_echo(&at),
        Role::StreamSink(at) => baseline::stream_sink(&at),
        Role::Relay(at) => relay::relay(&at),
        Role::DatagramRelay(at, other) => relay::datagram_relay(&at, other),
        Role::Network(one, two, percent, seed) => loss::network(one, two, percent, seed),
        Role::SinkAt(id, at, peer) => run(sink_at(id, loss::settings(id, at, peer))),
        Role::Sensor(at, subscribers) => run(fan_out::sensor(at, subscribers)),
        Role::Echo(id, place) => run(echo(id, place)),
        Role::Sink(id, place) => run(async move { sink(place.attach(id).await.port).await }),
        Role::Node(id, place) => run(node(id, place)),
        Role::Idle(components) => run(idle::stay(components)),
    }
}

/// Runs a component in its own task, as most components do: blocking the runtime on its future
/// costs one more system call per turn.
fn run(role: impl Future<Output = ()> + Send + 'static) {
    let runtime = runtime();
    let task = runtime.spawn(role);
    runtime.block_on(task).expect("a role without surprises");
}

async fn echo(id: JausId, place: Place) {
    let mut component = place.attach(id).await;
    println!("ready");
    while let Some(message) = component.port.recv().await {
        let answer = Outgoing::new(id, message.source, message.payload);
        component.port.send(answer).expect("sent");
    }
}

async fn sink_at(id: JausId, settings: Config) {
    let node = Node::start(settings).expect("a node on loopback");
    sink(node.attach(id.component()).expect("a free number")).await;
}

async fn sink(mut port: Port) {
    println!("ready");
    let mut count = 0u64;
    while let Some(message) = port.recv().await {
        if is(&message, COUNT) {
            let answer = [&COUNT[..], &count.to_le_bytes()].concat();
            let mut answer = Outgoing::new(port.id(), message.source, answer.into());
            answer.priority = message.priority;
            port.send(answer).expect("sent");
        } else if is(&message, CODE) {
            count += 1;
        }
    }
}

async fn node(id: JausId, place: Place) {
    let _node = place::serve(id, &place);
    println!("ready");
    std::future::pending::<()>().await;
}
