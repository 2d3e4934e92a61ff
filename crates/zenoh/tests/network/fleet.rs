//! A fleet on three routers, one of which is killed: what is acknowledged is not lost, and all vehicles
//! answer again. `JAUS_FLEET` is the number of vehicles, each with a bridge and a zenoh session.

use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::component::{Component, Kind, Priority};
use jaus::messages::mobility::QueryWrenchEffort;
use jaus::node::{Config, Node};
use jaus::rights::Acceptance;
use jaus::service::Timing;
use jaus_test_kit::figures::Figures;
use jaus_vehicle::parts::{Part, Slot};
use jaus_zenoh::{Bridge, NetworkSettings, Settings};
use tokio::task::JoinSet;

use super::numbered;
use super::scene::{Process, endpoint, router, router_program, rover};

/// The subsystem of the first vehicle.
const FIRST: u16 = 1000;
/// Clients that send at the same time.
const SENDERS: usize = 32;
/// Queries for the latency of an idle fleet.
const QUERIES: usize = 2000;
/// How long the load lasts before the router dies, and the fleet rests for the cost of an idle vehicle.
const STRETCH: Duration = Duration::from_secs(10);
/// Longer than a fleet needs to come up on a busy machine.
const LIMIT: Duration = Duration::from_secs(600);

/// Starts a node whose only link is a bridge; its first router is the one at this place.
fn node(subsystem: u16, accept: &[&str], routers: &[String], first: usize) -> Node {
    let mut network = NetworkSettings::default();
    let (before, after) = routers.split_at(first % routers.len());
    network.connect = [after, before].concat();
    let mut settings = Settings::default();
    if !accept.is_empty() {
        settings.accept = Acceptance::new(accept.iter().map(|it| it.parse().unwrap()));
        settings.trusts_network = true;
    }
    let mut bridge = Bridge::new(settings, &network, None).unwrap();
    let mut config = Config::new(subsystem, 1).without_udp();
    config.limits.max_peers = 16_384;
    let node = Node::start_with(config, bridge.links()).unwrap();
    let slot = Slot::new(
        node.attach(1).unwrap(),
        node.clone(),
        Kind::Vehicle,
        "Rover",
    );
    tokio::spawn(bridge.run(slot));
    node
}

/// A vehicle, and the messages that it has received.
struct Vehicle {
    node: Node,
    rover: Component,
    received: Arc<Mutex<HashSet<Bytes>>>,
}

impl Vehicle {
    fn start(number: usize, routers: &[String]) -> Self {
        let subsystem = FIRST + u16::try_from(number).unwrap();
        let node = node(subsystem, &["60 command"], routers, number);
        let rover = rover(&node);
        let received: Arc<Mutex<HashSet<Bytes>>> = Arc::default();
        let (mut messages, seen) = (rover.messages(), received.clone());
        tokio::spawn(async move {
            while let Some(message) = messages.next().await {
                seen.lock().unwrap().insert(message.payload);
            }
        });
        Self {
            node,
            rover,
            received,
        }
    }
}

/// The acknowledged messages, with their receivers, and how long each took.
type Acknowledged = Vec<(usize, Bytes, Duration)>;

/// Sends acknowledged messages to all vehicles in turn until it is stopped.
fn load(operator: &Component, ids: &[JausId], stop: &Arc<AtomicBool>) -> JoinSet<Acknowledged> {
    let mut senders = JoinSet::new();
    for sender in 0..SENDERS {
        let (operator, ids, stop) = (operator.clone(), ids.to_vec(), stop.clone());
        senders.spawn(async move {
            let (mut acknowledged, mut number) = (Vec::new(), sender as u32);
            while !stop.load(Ordering::Relaxed) {
                let (to, message) = (number as usize % ids.len(), numbered(number));
                number += SENDERS as u32;
                let begun = Instant::now();
                let sent = operator.deliver_undecoded(Priority::Standard, ids[to], message.clone());
                if sent.await.is_ok() {
                    acknowledged.push((to, message, begun.elapsed()));
                }
            }
            acknowledged
        });
    }
    senders
}

async fn answers(operator: &Component, id: JausId) -> bool {
    let query = QueryWrenchEffort::all();
    operator.query(id, &query).await.is_ok()
}

/// How long it takes until each vehicle has answered a query.
async fn all_answer(operator: &Component, ids: &[JausId]) -> Vec<Duration> {
    let begun = Instant::now();
    let mut tasks = JoinSet::new();
    for part in ids.chunks(ids.len().div_ceil(SENDERS)) {
        let (operator, part) = (operator.clone(), part.to_vec());
        tasks.spawn(async move {
            let mut times = Vec::new();
            for id in part {
                while !answers(&operator, id).await {}
                times.push(begun.elapsed());
            }
            times
        });
    }
    sorted(tasks.join_all().await.concat())
}

fn sorted(mut times: Vec<Duration>) -> Vec<Duration> {
    times.sort_unstable();
    times
}

/// A percentile of sorted times, in ms.
fn percentile(times: &[Duration], percent: usize) -> String {
    let at = (times.len() * percent / 100).min(times.len().saturating_sub(1));
    let time = times.get(at).copied().unwrap_or_default();
    format!("{:.2}", time.as_secs_f64() * 1e3)
}

/// The resident memory of a process, in KiB.
fn memory(process: &str) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let number = line.and_then(|line| line.split_whitespace().nth(1));
    number.unwrap().parse().unwrap()
}

/// The processor time of this process so far.
fn processor_time() -> Duration {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let (_, fields) = stat.rsplit_once(')').unwrap();
    let ticks = fields.split_whitespace().skip(11).take(2);
    // Linux counts a hundred ticks per second for every program.
    ticks
        .map(|it| Duration::from_millis(10) * it.parse::<u32>().unwrap())
        .sum()
}

struct Fleet {
    routers: [Process; 3],
    vehicles: Vec<Vehicle>,
    operator: Component,
    ids: Vec<JausId>,
    /// The memory of this process without the fleet, in KiB.
    before: u64,
}

impl Fleet {
    fn start(count: usize) -> Self {
        let places = [endpoint(), endpoint(), endpoint()];
        let routers = [
            router(&places[0], &[]),
            router(&places[1], &["--connect", &places[0]]),
            router(
                &places[2],
                &["--connect", &places[0], "--connect", &places[1]],
            ),
        ];
        let before = memory("self");
        // The operator is at the router that dies.
        let timing = Timing {
            max_components: 16_384,
            ..Timing::default()
        };
        let operator = Component::builder(Kind::OperatorControlUnit, "Operator")
            .timing(timing)
            .attach(&node(60, &[], &places, 0), 2)
            .unwrap();
        let start = |number| Vehicle::start(number, &places);
        let vehicles: Vec<_> = (0..count).map(start).collect();
        let ids = vehicles.iter().map(|it| it.rover.id()).collect();
        Self {
            routers,
            vehicles,
            operator,
            ids,
            before,
        }
    }

    /// Waits until the operator lists all vehicles.
    async fn listed(&self) {
        let deadline = Instant::now() + LIMIT;
        loop {
            let directory = self.operator.directory();
            let is_missing = |id: &&JausId| directory.component(**id).is_none();
            let missing = self.ids.iter().filter(is_missing).count();
            if missing == 0 {
                return;
            }
            assert!(Instant::now() < deadline, "{missing} vehicles are missing");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    /// Whether each of these messages has arrived.
    fn has_received(&self, acknowledged: &Acknowledged) -> bool {
        acknowledged.iter().all(|(vehicle, message, _)| {
            let received = self.vehicles[*vehicle].received.lock().unwrap();
            received.contains(message)
        })
    }

    async fn report_idle(&self, figures: &mut Figures, listed: Duration) {
        let count = self.vehicles.len() as u64;
        let mut times = Vec::new();
        for query in 0..QUERIES {
            let begun = Instant::now();
            // A stride that visits all vehicles in a changing order.
            if answers(&self.operator, self.ids[query * 7919 % self.ids.len()]).await {
                times.push(begun.elapsed());
            }
        }
        let times = sorted(times);
        let processor = processor_time();
        tokio::time::sleep(STRETCH).await;
        let processor = processor_time() - processor;
        let routers: u64 = self
            .routers
            .iter()
            .map(|it| memory(&it.id().to_string()))
            .sum();
        figures.table("An idle fleet", ["figure", "value"]);
        figures.row(["vehicles", &count.to_string()]);
        figures.row(["routers", &format!("3 of {}", router_program())]);
        let listed = format!("{:.1}", listed.as_secs_f64());
        figures.row(["all listed after the start (s)", &listed]);
        figures.row(["query and report, median (ms)", &percentile(&times, 50)]);
        figures.row(["query and report, p99 (ms)", &percentile(&times, 99)]);
        let own = (memory("self") - self.before) / count;
        figures.row([
            "memory per vehicle, node, bridge and session (KiB)",
            &own.to_string(),
        ]);
        let each = (routers / count).to_string();
        figures.row(["memory per vehicle, three routers together (KiB)", &each]);
        let load = processor.as_secs_f64() / STRETCH.as_secs_f64() / count as f64;
        figures.row([
            "processor per idle vehicle (%)",
            &format!("{:.3}", load * 1e2),
        ]);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes minutes, and the Python package eclipse-zenoh: .ci/zenoh --fleet"]
async fn a_fleet_loses_nothing_acknowledged_when_a_router_dies_and_answers_again() {
    let count = std::env::var("JAUS_FLEET").map_or(1000, |text| text.parse().unwrap());
    let mut figures = Figures::new("zenoh-fleet", ".ci/zenoh --fleet");
    let begun = Instant::now();
    let mut fleet = Fleet::start(count);
    fleet.listed().await;
    fleet.report_idle(&mut figures, begun.elapsed()).await;

    let stop = Arc::new(AtomicBool::new(false));
    let senders = load(&fleet.operator, &fleet.ids, &stop);
    tokio::time::sleep(STRETCH).await;
    fleet.routers[0].kill();
    let answered = tokio::time::timeout(LIMIT, all_answer(&fleet.operator, &fleet.ids));
    let answered = answered.await.expect("every vehicle answers again");
    fleet.listed().await;
    tokio::time::sleep(STRETCH).await;
    stop.store(true, Ordering::Relaxed);
    let acknowledged = senders.join_all().await.concat();
    // An acknowledged message is in the component's mailbox; it may not have read it yet.
    let deadline = Instant::now() + LIMIT;
    while !fleet.has_received(&acknowledged) {
        assert!(Instant::now() < deadline, "an acknowledged message is lost");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }

    let times = sorted(acknowledged.iter().map(|it| it.2).collect());
    figures.table("One of three routers dies under load", ["figure", "value"]);
    figures.row(["acknowledged messages", &times.len().to_string()]);
    figures.row(["of them lost", "0"]);
    figures.row(["acknowledgement, median (ms)", &percentile(&times, 50)]);
    figures.row(["acknowledgement, p99 (ms)", &percentile(&times, 99)]);
    let last = answered.last().copied().unwrap_or_default();
    figures.row([
        "half of the vehicles answer again (ms)",
        &percentile(&answered, 50),
    ]);
    figures.row([
        "all vehicles answer again (ms)",
        &percentile(&answered, 100),
    ]);
    let aim = "all vehicles listed and answering within 10 s";
    figures.aim(aim, [("", last <= Duration::from_secs(10))]);
    figures.finish();
    for vehicle in fleet.vehicles {
        drop((vehicle.rover, vehicle.node));
    }
}
