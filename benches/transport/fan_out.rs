//! The cost of one event for its sender with one subscriber and with a hundred, each on its own
//! node.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{Component, Handlers, Kind};
use jaus::endpoint::Outgoing;
use jaus::link::Group;
use jaus::messages::core::{CreateEvent, Event, create_event};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, velocity_state_sensor,
};
use jaus::node::{Config, Node, Port};
use jaus_test_kit::figures::Figures;
use tokio::time::{sleep, timeout};

use crate::Effort;
use crate::child::Process;
use crate::loss::{free_addresses, settings};
use crate::placement::{Placement, Side};
use crate::report::{quotient, ratio, spread};
use crate::roles::{self, Role};

const SENSOR: JausId = JausId::new(101, 1, 1);
/// The first subscriber's subsystem.
const FIRST: u16 = 200;
const MOST: usize = 100;
const COUNTS: [usize; 3] = [1, 10, MOST];
/// The aim: the greatest ratio of the costs with the most subscribers and with one.
const AIM: f64 = 15.0;
/// The interval between two events.
const PERIOD: Duration = Duration::from_millis(4);

pub(crate) fn measure(effort: Effort, figures: &mut Figures) {
    let placement = *Placement::pinned().last().expect("one at least");
    placement.take();
    let time = Duration::from_secs_f64(effort.seconds);
    let mut costs = COUNTS.map(|_| Vec::new());
    for _ in 0..effort.runs {
        for (costs, subscribers) in costs.iter_mut().zip(COUNTS) {
            let cost = roles::runtime().block_on(cost(subscribers, time, placement));
            costs.push(cost);
        }
    }
    figures.table(
        &format!(
            "One event, {} (processor time of its sender)",
            placement.name()
        ),
        ["subscribers", "µs", "to one", "µs for each"],
    );
    for (all, subscribers) in costs.iter().zip(COUNTS) {
        let each: Vec<_> = all.iter().map(|cost| cost / subscribers as f64).collect();
        figures.row([
            &subscribers.to_string(),
            &spread(all, 1),
            &ratio(all, &costs[0]),
            &spread(&each, 2),
        ]);
    }
    let is_met = quotient(&costs[2], &costs[0]) <= AIM;
    figures.aim("100 subscribers cost at most 15 × one", [("", is_met)]);
    Placement::Free.take();
}

/// Microseconds of the sender's CPU time per event.
async fn cost(subscribers: usize, time: Duration, placement: Placement) -> f64 {
    let addresses = free_addresses::<{ MOST + 1 }>();
    let (sensor, clients) = addresses.split_first().expect("some");
    let clients = clients[..subscribers].to_vec();
    let role = Role::Sensor(*sensor, clients.clone());
    let process = Process::start(&role, &placement.of(Side::Theirs));
    let mut ports = Vec::new();
    let mut nodes = Vec::new();
    for (subsystem, &at) in (FIRST..).zip(&clients) {
        let peer = format!("{SENSOR}@{sensor}").parse().expect("a peer");
        let settings = settings(JausId::new(subsystem, 1, 1), at, peer);
        let node = Node::start(settings).expect("a node");
        let mut port = node.attach(1).expect("a free number");
        subscribe(&mut port).await;
        nodes.push(node);
        ports.push(port);
    }
    sleep(Duration::from_millis(300)).await;
    let mut counted = ports.pop().expect("one subscriber");
    for mut port in ports {
        tokio::spawn(async move { while port.recv().await.is_some() {} });
    }
    while counted.try_recv().is_some() {}
    let (start, before) = (Instant::now(), process.processor_time());
    let mut events = 0;
    while start.elapsed() < time {
        if let Ok(Some(message)) = timeout(Duration::from_secs(1), counted.recv()).await {
            events += u32::from(Event::decode(&message.payload).is_ok());
        }
    }
    assert!(events > 0, "no event came to {subscribers} subscribers");
    let used = process.processor_time() - before;
    used.as_secs_f64() * 1e6 / f64::from(events)
}

/// Subscribes, and waits for the first event.
async fn subscribe(port: &mut Port) {
    let query = QueryVelocityState::none().with_velocity_x();
    let create = CreateEvent {
        event_type: create_event::EventType::EVERY_CHANGE,
        query_message: query.encode().expect("a query"),
        ..CreateEvent::default()
    };
    let payload = create.encode().expect("a message");
    for _ in 0..50 {
        let request = Outgoing::new(port.id(), SENSOR, payload.clone());
        port.send(request).expect("sent");
        let answer = async {
            while let Some(message) = port.recv().await {
                if Event::decode(&message.payload).is_ok() {
                    return;
                }
            }
        };
        if timeout(Duration::from_millis(500), answer).await.is_ok() {
            return;
        }
    }
    panic!("no subscription");
}

/// A child: a sensor with a constantly changing value, with its subscribers' addresses.
pub(crate) async fn sensor(at: SocketAddr, subscribers: Vec<SocketAddr>) {
    let mut settings = Config::loopback(SENSOR.subsystem(), SENSOR.node())
        .port(at.port())
        .group(Group::Off);
    for (subsystem, address) in (FIRST..).zip(subscribers) {
        let peer = format!("{subsystem}.1.255@{address}");
        settings = settings.peer(peer.parse().expect("a peer"));
    }
    let node = Node::start(settings).expect("a node");
    let count = AtomicU32::new(0);
    // Successive answers to one subscriber must differ, or there would be no event: no number of
    // subscribers is a multiple of 97.
    let answer = move |_: QueryVelocityState| {
        let speed = count.fetch_add(1, Ordering::Relaxed) % 97;
        let mut report = ReportVelocityState::default();
        let set = report.set_velocity_x_m_per_s(f64::from(speed) / 10.0);
        set.expect("within its range");
        report
    };
    let sensor = Handlers::new(velocity_state_sensor::LATEST)
        .answer(answer)
        .declines::<QueryVelocityStateExt>();
    let component = Component::builder(Kind::Vehicle, "Bench")
        .offer(sensor)
        .attach(&node, SENSOR.component())
        .expect("a sensor");
    println!("ready");
    loop {
        sleep(PERIOD).await;
        _ = component.changed::<QueryVelocityState>().await;
    }
}
