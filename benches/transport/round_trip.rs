//! Round-trip times between two components in separate processes.

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::Port;
use jaus_test_kit::figures::Figures;
use tokio::runtime::Runtime;
use tokio::time::timeout;

use crate::Effort;
use crate::baseline::UdpEcho;
use crate::child::Process;
use crate::place::Component;
use crate::placement::{Placement, Side};
use crate::relay::StreamEcho;
use crate::report::{median, micros, percentile, quotient, ratio, spread};
use crate::roles::{self, CODE, Role};
use crate::setting::Setting;

const LENGTHS: [usize; 2] = [64, 1024];
/// The aim: the greatest ratio to the baseline. Without fixed processors it depends on chance.
const AIM: f64 = 1.3;

/// Two ends that exchange messages.
trait Pair {
    /// Times of `count` consecutive round trips.
    fn round_trips(&mut self, message: &Bytes, count: usize) -> Vec<Duration>;
}

impl Pair for UdpEcho {
    fn round_trips(&mut self, message: &Bytes, count: usize) -> Vec<Duration> {
        (0..count).map(|_| self.round_trip(message)).collect()
    }
}

impl Pair for StreamEcho {
    fn round_trips(&mut self, message: &Bytes, count: usize) -> Vec<Duration> {
        (0..count).map(|_| self.round_trip(message)).collect()
    }
}

/// A local component, and an echo component in another process.
struct Components {
    runtime: Runtime,
    ours: Option<Component>,
    theirs: JausId,
    _others: Vec<Process>,
}

impl Components {
    fn start(setting: Setting, placement: Placement) -> Self {
        let (mut others, [here, there]) = setting.start(placement);
        let [ours, theirs] = setting.ids();
        let echo = Role::Echo(theirs, there);
        others.push(Process::start(&echo, &placement.of(Side::Theirs)));
        let runtime = roles::runtime();
        let ours = runtime.block_on(here.attach(ours));
        Self {
            runtime,
            ours: Some(ours),
            theirs,
            _others: others,
        }
    }
}

impl Pair for Components {
    fn round_trips(&mut self, message: &Bytes, count: usize) -> Vec<Duration> {
        let mut component = self.ours.take().expect("given back after each run");
        let (theirs, message) = (self.theirs, message.clone());
        // In its own task, like a real component.
        let run = self.runtime.spawn(async move {
            let mut times = Vec::with_capacity(count);
            while times.len() < count {
                times.push(round_trip(&mut component.port, theirs, &message).await);
            }
            (component, times)
        });
        let (component, times) = self.runtime.block_on(run).expect("a run");
        self.ours = Some(component);
        times
    }
}

async fn round_trip(port: &mut Port, theirs: JausId, message: &Bytes) -> Duration {
    loop {
        let start = Instant::now();
        port.send(Outgoing::new(port.id(), theirs, message.clone()))
            .expect("sent");
        // The first message may be lost before the two know each other.
        if let Ok(answer) = timeout(Duration::from_secs(1), port.recv()).await {
            assert!(answer.is_some(), "the node has stopped");
            return start.elapsed();
        }
    }
}

/// The first of the compared pairs that is not a baseline.
const OURS: usize = 4;

/// The compared pairs: name, index of the baseline in this list, and the pair.
fn pairs(placement: Placement) -> Vec<(&'static str, usize, Box<dyn Pair>)> {
    let stream = |relays| Box::new(StreamEcho::start(relays, placement));
    let components = |setting| Box::new(Components::start(setting, placement));
    let [own, one, two] = Setting::ALL;
    vec![
        ("raw UDP", 0, Box::new(UdpEcho::start(placement))),
        ("raw Unix stream", 0, stream(0)),
        ("bare relay, one process", 2, stream(1)),
        ("bare relay, two processes", 3, stream(2)),
        (own.name(), 0, components(own)),
        (one.name(), 2, components(one)),
        (two.name(), 3, components(two)),
    ]
}

pub(crate) fn measure(effort: Effort, figures: &mut Figures) {
    for placement in Placement::all() {
        placement.take();
        let mut pairs = pairs(placement);
        for length in LENGTHS {
            measure_pairs(&mut pairs, length, placement, effort, figures);
        }
    }
    Placement::Free.take();
}

fn measure_pairs(
    pairs: &mut [(&str, usize, Box<dyn Pair>)],
    length: usize,
    placement: Placement,
    effort: Effort,
    figures: &mut Figures,
) {
    let mut message = vec![0; length];
    message[..2].copy_from_slice(&CODE);
    let message = Bytes::from(message);
    let mut medians = vec![Vec::new(); pairs.len()];
    let mut tails = vec![Vec::new(); pairs.len()];
    for run in 0..=effort.runs {
        for ((_, _, pair), (medians, tails)) in
            pairs.iter_mut().zip(medians.iter_mut().zip(&mut tails))
        {
            let times = pair.round_trips(&message, effort.round_trips);
            let times: Vec<_> = times.into_iter().map(micros).collect();
            // The first run only warms up.
            if run > 0 {
                medians.push(median(&times));
                tails.push(percentile(&times, 99));
            }
        }
    }
    figures.table(
        &format!("Round trip, {length} octets, {} (µs)", placement.name()),
        [
            "between",
            "median",
            "p99",
            "median to its baseline",
            "baseline",
        ],
    );
    for (index, (name, baseline, _)) in pairs.iter().enumerate() {
        figures.row([
            name,
            &spread(&medians[index], 1),
            &spread(&tails[index], 1),
            &ratio(&medians[index], &medians[*baseline]),
            pairs[*baseline].0,
        ]);
    }
    if placement != Placement::Free {
        let ours = pairs.iter().enumerate().skip(OURS);
        let results = ours.map(|(index, (name, baseline, _))| {
            let ratio = quotient(&medians[index], &medians[*baseline]);
            (*name, ratio <= AIM)
        });
        figures.aim("at most 1.3 × the baseline", results);
    }
}
