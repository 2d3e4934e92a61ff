//! How many messages a component can send to another, and how many arrive.

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::Port;
use jaus::wire::Priority;
use tokio::time::{sleep, timeout};

use crate::child::Process;
use crate::place::Setting;
use crate::report::{self, median, ratio, spread};
use crate::roles::{self, CODE, COUNT, Role};
use crate::{Effort, baseline};

/// Octets of a message, and of all messages that may be on their way without acknowledgement.
const LENGTHS: [usize; 5] = [8, 64, 1024, 64 << 10, 1 << 20];

/// What one run gave.
#[derive(Clone, Copy)]
struct Flow {
    sent: u64,
    received: u64,
    /// From the first message sent to the last received.
    seconds: f64,
}

impl Flow {
    fn rate(self) -> f64 {
        self.received as f64 / self.seconds
    }

    fn lost(self) -> f64 {
        100.0 * self.sent.saturating_sub(self.received) as f64 / self.sent.max(1) as f64
    }
}

pub(crate) fn measure(effort: Effort) {
    let time = Duration::from_secs_f64(effort.seconds);
    for length in LENGTHS {
        let mut flows: Vec<(String, Vec<Flow>)> = Vec::new();
        let mut copies = Vec::new();
        for _ in 0..effort.runs {
            let mut note =
                |name: String, flow| match flows.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, flows)) => flows.push(flow),
                    None => flows.push((name, vec![flow])),
                };
            // What a datagram of ours holds at most; a larger message takes several.
            let datagram = length.min(1440);
            let (sent, received, seconds) = baseline::udp_one_way(datagram, time);
            let share = (length / datagram) as u64;
            let raw = Flow {
                sent: sent / share,
                received: received / share,
                seconds,
            };
            note(format!("raw UDP, datagrams of {datagram}"), raw);
            for setting in Setting::ALL {
                for acknowledge in [false, true] {
                    let how = if acknowledge { ", acknowledged" } else { "" };
                    let flow = flow(setting, length, acknowledge, time);
                    note(format!("{}{how}", setting.name()), flow);
                }
            }
            copies.push(baseline::memcpy(length) / 1e6);
        }
        print(length, &flows, &copies);
    }
}

fn print(length: usize, flows: &[(String, Vec<Flow>)], copies: &[f64]) {
    report::head(
        &format!("One way, {length} octets"),
        ["between", "thousand/s", "MB/s", "lost", "rate to raw UDP"],
    );
    let rates = |flows: &[Flow]| flows.iter().map(|flow| flow.rate()).collect::<Vec<_>>();
    let raw = rates(&flows[0].1);
    for (name, flows) in flows {
        let rates = rates(flows);
        let thousands: Vec<_> = rates.iter().map(|rate| rate / 1e3).collect();
        let lost: Vec<_> = flows.iter().map(|flow| flow.lost()).collect();
        report::row([
            name,
            &spread(&thousands, 1),
            &format!("{:.1}", median(&rates) * length as f64 / 1e6),
            &format!("{:.1} %", median(&lost)),
            &ratio(&rates, &raw),
        ]);
    }
    let copy = format!("{:.0}", median(copies));
    report::row(["copy in memory", "", &copy, "", ""]);
}

/// Sends for a time from here to a child that counts.
fn flow(setting: Setting, length: usize, acknowledge: bool, time: Duration) -> Flow {
    let (_nodes, [here, there]) = setting.start();
    let [ours, theirs] = setting.ids();
    let _sink = Process::start(&Role::Sink(theirs, there));
    let mut message = vec![0; length];
    message[..2].copy_from_slice(&CODE);
    let message = Bytes::from(message);
    roles::runtime().block_on(async {
        let mut component = here.attach(ours).await;
        let port = &mut component.port;
        // Also makes the two known to each other.
        assert_eq!(count(port, theirs).await, 0);
        let start = Instant::now();
        let mut sent = 0;
        while start.elapsed() < time {
            // A sink that answers has a say now and then.
            for _ in 0..32 {
                let mut outgoing = Outgoing::new(port.id(), theirs, message.clone());
                outgoing.acknowledge = acknowledge;
                if port.send(outgoing).is_err() {
                    // Full: let the node work.
                    break;
                }
                sent += 1;
            }
            tokio::task::yield_now().await;
        }
        let (mut received, mut unchanged) = (0, 0);
        let mut seconds = start.elapsed().as_secs_f64();
        loop {
            let now = count(port, theirs).await;
            if now > received {
                received = now;
                unchanged = 0;
                seconds = start.elapsed().as_secs_f64();
            } else {
                unchanged += 1;
            }
            if received == sent || unchanged == 20 {
                break;
            }
            sleep(Duration::from_millis(10)).await;
        }
        Flow {
            sent,
            received,
            seconds,
        }
    })
}

/// Asks the sink how many messages came.
async fn count(port: &mut Port, sink: JausId) -> u64 {
    for _ in 0..50 {
        let mut question = Outgoing::new(port.id(), sink, Bytes::from_static(&COUNT));
        // Before the crowd, or it would be dropped with it.
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
