//! Throughput from one component to another: messages sent, and messages that arrive.

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::{Port, Undelivered};
use jaus::wire::Priority;
use jaus_test_kit::figures::Figures;
use tokio::time::{sleep, timeout};

use crate::Effort;
use crate::baseline::{self, Flow};
use crate::child::Process;
use crate::placement::{Placement, Side};
use crate::report::{median, ratio, spread};
use crate::roles::{self, Batching, CODE, COUNT, Role};
use crate::setting::Setting;

/// Payload lengths in octets.
const LENGTHS: [usize; 4] = [64, 1024, 64 << 10, 1 << 20];
/// Limits of acknowledged messages in flight: octets, and messages.
const UNDERWAY: (usize, usize) = (4 << 20, 256);
/// The aim for the shortest messages between two nodes, per second.
const AIM: f64 = 2e6;
/// Small messages per second of a paced sender.
const PACE: f64 = 300_000.0;

/// How the messages are sent.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Manner {
    /// As fast as the node accepts them.
    AllOut,
    /// Small messages at a steady rate.
    Paced,
    /// Each is acknowledged, with many in flight.
    Acknowledged,
}

impl Manner {
    const ALL: [(Self, &str); 3] = [
        (Self::AllOut, ""),
        (Self::Paced, ", 300 000/s"),
        (Self::Acknowledged, ", acknowledged"),
    ];
}

pub(crate) fn measure(effort: Effort, figures: &mut Figures) {
    for placement in Placement::pinned() {
        placement.take();
        for length in LENGTHS {
            measure_length(length, placement, effort, figures);
        }
    }
    Placement::Free.take();
}

fn measure_length(length: usize, placement: Placement, effort: Effort, figures: &mut Figures) {
    let time = Duration::from_secs_f64(effort.seconds);
    // The most that one datagram of ours holds; a larger message takes several.
    let datagram = length.min(1440);
    let mut flows: Vec<(String, Vec<Flow>)> = Vec::new();
    let mut copies = Vec::new();
    for _ in 0..effort.runs {
        let mut note = |name: String, flow| match flows.iter_mut().find(|(known, _)| *known == name)
        {
            Some((_, flows)) => flows.push(flow),
            None => flows.push((name, vec![flow])),
        };
        for (batching, how) in [(Batching::Single, ""), (Batching::Segments, ", segments")] {
            let raw = baseline::udp_one_way(datagram, time, batching, placement);
            let share = (length / datagram) as u64;
            let raw = Flow {
                sent: raw.sent / share,
                received: raw.received / share,
                ..raw
            };
            note(format!("raw UDP, datagrams of {datagram}{how}"), raw);
        }
        let stream = baseline::unix_one_way(length, time, placement);
        note("raw Unix stream".to_owned(), stream);
        for setting in Setting::ALL {
            for (manner, how) in Manner::ALL {
                if manner != Manner::Paced || length <= 64 {
                    let flow = flow(setting, length, manner, time, placement);
                    note(format!("{}{how}", setting.name()), flow);
                }
            }
        }
        copies.push(baseline::memcpy(length) / 1e6);
    }
    print(length, placement, &flows, &copies, figures);
}

fn print(
    length: usize,
    placement: Placement,
    flows: &[(String, Vec<Flow>)],
    copies: &[f64],
    figures: &mut Figures,
) {
    figures.table(
        &format!("One way, {length} octets, {}", placement.name()),
        [
            "between",
            "thousand/s",
            "MB/s",
            "lost",
            "rate to raw UDP",
            "to raw UDP, segments",
        ],
    );
    let rates = |flows: &[Flow]| flows.iter().map(|flow| flow.rate()).collect::<Vec<_>>();
    let (single, segments) = (rates(&flows[0].1), rates(&flows[1].1));
    for (name, flows) in flows {
        let rates = rates(flows);
        let thousands: Vec<_> = rates.iter().map(|rate| rate / 1e3).collect();
        let lost: Vec<_> = flows.iter().map(|flow| flow.lost()).collect();
        figures.row([
            name,
            &spread(&thousands, 1),
            &format!("{:.1}", median(&rates) * length as f64 / 1e6),
            &format!("{:.1} %", median(&lost)),
            &ratio(&rates, &single),
            &ratio(&rates, &segments),
        ]);
    }
    let copy = format!("{:.0}", median(copies));
    figures.row(["copy in memory", "", &copy, "", "", ""]);
    let own = flows
        .iter()
        .find(|(name, _)| name == Setting::OwnNodes.name());
    if let Some((name, flows)) = own.filter(|_| length == LENGTHS[0]) {
        let is_met = median(&rates(flows)) >= AIM;
        figures.aim("2000 thousand/s", [(name.as_str(), is_met)]);
    }
}

/// Sends for a given time to a child that counts.
fn flow(
    setting: Setting,
    length: usize,
    manner: Manner,
    time: Duration,
    placement: Placement,
) -> Flow {
    let (_nodes, [here, there]) = setting.start(placement);
    let [ours, theirs] = setting.ids();
    let sink = Role::Sink(theirs, there);
    let _sink = Process::start(&sink, &placement.of(Side::Theirs));
    let mut message = vec![0; length];
    message[..2].copy_from_slice(&CODE);
    let message = Outgoing::new(ours, theirs, message.into());
    roles::runtime().block_on(async {
        let mut component = here.attach(ours).await;
        send(&mut component.port, &message, manner, time).await
    })
}

/// Sends for a given time to a component that counts.
pub(crate) async fn send(
    port: &mut Port,
    message: &Outgoing,
    manner: Manner,
    time: Duration,
) -> Flow {
    let sink = message.destination;
    // Also makes the two components known to each other.
    assert_eq!(count(port, sink).await, 0);
    let start = Instant::now();
    let sent = match manner {
        Manner::AllOut => all_out(port, message, time).await,
        Manner::Paced => paced(port, message, time).await,
        Manner::Acknowledged => acknowledged(port, message, time).await,
    };
    let (received, seconds) = arrived(port, sink, sent, start).await;
    Flow {
        sent,
        received,
        seconds,
    }
}

async fn all_out(port: &Port, message: &Outgoing, time: Duration) -> u64 {
    let (mut sent, start) = (0, Instant::now());
    let sender = port.sender();
    while start.elapsed() < time {
        for _ in 0..32 {
            if port.send(message.clone()).is_err() {
                // The queue is full: let the node work.
                break;
            }
            sent += 1;
        }
        sender.flushed().await;
        tokio::task::yield_now().await;
    }
    sent
}

async fn paced(port: &Port, message: &Outgoing, time: Duration) -> u64 {
    let (mut sent, start) = (0, Instant::now());
    while start.elapsed() < time {
        let due = (start.elapsed().as_secs_f64() * PACE) as u64;
        while sent < due {
            port.send(message.clone()).expect("room");
            sent += 1;
        }
        sleep(Duration::from_millis(1)).await;
    }
    sent
}

/// The number of acknowledged messages.
async fn acknowledged(port: &Port, message: &Outgoing, time: Duration) -> u64 {
    let (octets, most) = UNDERWAY;
    let underway = (octets / message.payload.len()).clamp(1, most);
    let mut tasks = tokio::task::JoinSet::new();
    for _ in 0..underway {
        let (sender, message) = (port.sender(), message.clone());
        tasks.spawn(async move {
            let (mut sent, start) = (0, Instant::now());
            while start.elapsed() < time {
                match sender.deliver(message.clone()).await {
                    Ok(()) => sent += 1,
                    // The queue is full; nothing was sent.
                    Err(Undelivered::NotSent(_) | Undelivered::Rejected(_)) => {
                        sleep(Duration::from_millis(1)).await;
                    }
                    Err(lost) => panic!("{lost}"),
                }
            }
            sent
        });
    }
    tasks.join_all().await.into_iter().sum()
}

/// Waits until all messages have arrived or no more arrive; returns their number and the time until
/// the last.
async fn arrived(port: &mut Port, sink: JausId, sent: u64, start: Instant) -> (u64, f64) {
    let (mut received, mut unchanged) = (0, 0);
    let mut seconds = start.elapsed().as_secs_f64();
    loop {
        let now = count(port, sink).await;
        if now > received {
            (received, unchanged) = (now, 0);
            seconds = start.elapsed().as_secs_f64();
        } else {
            unchanged += 1;
        }
        if received >= sent || unchanged == 20 {
            return (received, seconds);
        }
        sleep(Duration::from_millis(10)).await;
    }
}

/// Queries the sink for the number of received messages.
async fn count(port: &mut Port, sink: JausId) -> u64 {
    for _ in 0..50 {
        let mut question = Outgoing::new(port.id(), sink, Bytes::from_static(&COUNT));
        // Sent with high priority, or it would be dropped with the other messages.
        question.priority = Priority::High;
        if port.send(question).is_ok()
            && let Ok(Some(answer)) = timeout(Duration::from_millis(300), port.recv()).await
            && let Some((code, count)) = answer.payload.split_first_chunk::<2>()
            && *code == COUNT
            && let Ok(count) = count.try_into()
        {
            return u64::from_le_bytes(count);
        }
        sleep(Duration::from_millis(10)).await;
    }
    panic!("the sink does not say how many came");
}
