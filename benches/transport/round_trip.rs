//! The time from a component to another and back, in processes of their own.

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::Port;
use tokio::runtime::Runtime;
use tokio::time::timeout;

use crate::Effort;
use crate::baseline::{UdpEcho, UnixEcho};
use crate::child::Process;
use crate::place::Component;
use crate::report::{self, median, micros, percentile, ratio, spread};
use crate::roles::{self, CODE, Role};
use crate::setting::Setting;

const LENGTHS: [usize; 2] = [64, 1024];

/// Something that goes to and fro.
trait Pair {
    fn name(&self) -> &str;
    /// So many round trips, one after the other.
    fn round_trips(&mut self, message: &Bytes, count: usize) -> Vec<Duration>;
}

impl Pair for UdpEcho {
    fn name(&self) -> &str {
        "raw UDP echo"
    }

    fn round_trips(&mut self, message: &Bytes, count: usize) -> Vec<Duration> {
        (0..count).map(|_| self.round_trip(message)).collect()
    }
}

impl Pair for UnixEcho {
    fn name(&self) -> &str {
        "raw Unix socket echo"
    }

    fn round_trips(&mut self, message: &Bytes, count: usize) -> Vec<Duration> {
        (0..count).map(|_| self.round_trip(message)).collect()
    }
}

/// A component here and one in another process, which sends back what it gets.
struct Components {
    name: &'static str,
    runtime: Runtime,
    ours: Option<Component>,
    theirs: JausId,
    _others: Vec<Process>,
}

impl Components {
    fn start(setting: Setting) -> Self {
        let (mut others, [here, there]) = setting.start();
        let [ours, theirs] = setting.ids();
        others.push(Process::start(&Role::Echo(theirs, there)));
        let runtime = roles::runtime();
        let ours = runtime.block_on(here.attach(ours));
        Self {
            name: setting.name(),
            runtime,
            ours: Some(ours),
            theirs,
            _others: others,
        }
    }
}

impl Pair for Components {
    fn name(&self) -> &str {
        self.name
    }

    fn round_trips(&mut self, message: &Bytes, count: usize) -> Vec<Duration> {
        let mut component = self.ours.take().expect("given back after each run");
        let (theirs, message) = (self.theirs, message.clone());
        // A task of its own, as a component is.
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
        // The first may go astray while the two do not know each other.
        if let Ok(answer) = timeout(Duration::from_secs(1), port.recv()).await {
            assert!(answer.is_some(), "the node has stopped");
            return start.elapsed();
        }
    }
}

pub(crate) fn measure(effort: Effort) {
    for length in LENGTHS {
        let mut message = vec![0; length];
        message[..2].copy_from_slice(&CODE);
        let message = Bytes::from(message);
        let mut pairs: Vec<Box<dyn Pair>> =
            vec![Box::new(UdpEcho::start()), Box::new(UnixEcho::start())];
        for setting in Setting::ALL {
            pairs.push(Box::new(Components::start(setting)));
        }
        let mut medians = vec![Vec::new(); pairs.len()];
        let mut tails = vec![Vec::new(); pairs.len()];
        for run in 0..=effort.runs {
            for (pair, (medians, tails)) in pairs.iter_mut().zip(medians.iter_mut().zip(&mut tails))
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
        report::head(
            &format!("Round trip, {length} octets (µs)"),
            [
                "between",
                "median",
                "p99",
                "median to raw UDP",
                "p99 to median",
            ],
        );
        for (pair, (medians_of, tails)) in pairs.iter().zip(medians.iter().zip(&tails)) {
            report::row([
                pair.name(),
                &spread(medians_of, 1),
                &spread(tails, 1),
                &ratio(medians_of, &medians[0]),
                &ratio(tails, medians_of),
            ]);
        }
    }
}
