//! Load: a number of components on one communicator, each of which sends messages to the next one
//! at a steady rate, and the time that each message takes.
#![expect(
    clippy::disallowed_methods,
    reason = "a load has its pace, and a latency its times"
)]

use std::time::{Duration, Instant};

use bytes::{BufMut, Bytes, BytesMut};
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;

use super::Latencies;
use crate::address::JausId;
use crate::endpoint::Outgoing;
use crate::node::{Host, HostError, Port};
use crate::service::code_of;

/// The code of the messages: user-defined, so that no service acts on them.
const LOAD: u16 = 0xD7F1;
/// Octets of a message before its padding: code, and when it was sent.
const HEAD: usize = 2 + 8;
/// How long messages may still arrive when nothing is sent any more.
const REST: Duration = Duration::from_millis(500);
/// What is sent before this has passed does not count.
const WARM_UP: Duration = Duration::from_millis(300);

/// A load on one communicator.
#[derive(Debug, Clone)]
pub struct Load {
    /// How many components take part, each on a connection of its own.
    pub components: u8,
    /// How many messages each of them sends in a second.
    pub rate: u32,
    /// For how long they are counted.
    pub time: Duration,
    /// Octets of a message.
    pub size: usize,
}

/// Why there is no load.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// Something is beyond what can be done or counted.
    #[error("{0}")]
    Mistaken(String),
    /// A component can not be attached.
    #[error(transparent)]
    Host(#[from] HostError),
    /// A component's task has ended.
    #[error("a component of the load has ended: {0}")]
    Ended(#[from] tokio::task::JoinError),
}

/// What came of a load.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// What was asked for.
    pub load: Load,
    /// Messages that were sent and counted.
    pub sent: u64,
    /// Messages that the sender's own node connection would not take.
    pub refused: u64,
    /// For how long they were sent.
    pub took: Duration,
    /// How long those that arrived have taken.
    pub latencies: Latencies,
}

impl Outcome {
    /// Messages that were sent and did not arrive.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.sent.saturating_sub(self.latencies.len() as u64)
    }

    /// Messages in a second, all components together, as they were sent.
    #[must_use]
    pub fn per_second(&self) -> f64 {
        self.sent as f64 / self.took.as_secs_f64().max(f64::MIN_POSITIVE)
    }
}

impl Load {
    /// The most components: what a node has numbers for.
    pub const MOST_COMPONENTS: u8 = 254;

    /// Attaches the components to a communicator and lets them send to each other in a ring.
    ///
    /// # Errors
    /// If the load is mistaken, or a component can not be attached.
    pub async fn run(&self, communicator: &Host) -> Result<Outcome, LoadError> {
        self.check()?;
        let mut ports = Vec::with_capacity(usize::from(self.components));
        for number in 1..=self.components {
            ports.push(communicator.attach(number).await?);
        }
        let ids: Vec<JausId> = ports.iter().map(Port::id).collect();
        let begin = Instant::now();
        let mut tasks = JoinSet::new();
        for (index, port) in ports.into_iter().enumerate() {
            let to = ids[(index + 1) % ids.len()];
            let component = Sender {
                load: self.clone(),
                begin,
                offset: self.gap() * index as u32 / u32::from(self.components),
                to,
                tally: Tally::default(),
            };
            tasks.spawn(component.run(port));
        }
        let mut outcome = Outcome {
            load: self.clone(),
            sent: 0,
            refused: 0,
            took: self.time,
            latencies: Latencies::new(),
        };
        while let Some(tally) = tasks.join_next().await {
            let tally = tally?;
            outcome.sent += tally.sent;
            outcome.refused += tally.refused;
            outcome.latencies.merge(tally.latencies);
        }
        Ok(outcome)
    }

    /// Between two messages of a component.
    fn gap(&self) -> Duration {
        Duration::from_secs(1) / self.rate.max(1)
    }

    fn check(&self) -> Result<(), LoadError> {
        let mistaken = |words: String| Err(LoadError::Mistaken(words));
        if !(2..=Self::MOST_COMPONENTS).contains(&self.components) {
            return mistaken(format!(
                "{} components can not send to each other through one node: choose from 2 to {}",
                self.components,
                Self::MOST_COMPONENTS
            ));
        }
        if !(1..=1_000_000).contains(&self.rate) || !(HEAD..=1400).contains(&self.size) {
            return mistaken(format!(
                "{} messages/s of {} octets: choose a rate from 1 to 1000000 and a size from {HEAD} \
                 to 1400",
                self.rate, self.size
            ));
        }
        let messages = f64::from(self.components) * f64::from(self.rate) * self.time.as_secs_f64();
        if messages > Latencies::MOST as f64 {
            return mistaken(format!(
                "{} components x {} messages/s x {} s are {messages:.0} messages, and {} can be \
                 counted: choose less of one",
                self.components,
                self.rate,
                self.time.as_secs_f64(),
                Latencies::MOST
            ));
        }
        Ok(())
    }
}

/// What one component has seen.
#[derive(Default)]
struct Tally {
    sent: u64,
    refused: u64,
    latencies: Latencies,
}

/// One component of the load.
struct Sender {
    load: Load,
    begin: Instant,
    /// So that not all send at the same moment.
    offset: Duration,
    to: JausId,
    tally: Tally,
}

impl Sender {
    async fn run(mut self, mut port: Port) -> Tally {
        let start = self.begin + self.offset;
        // Timers tick in milliseconds: at each tick goes what is due by then.
        let tick = self.load.gap().max(Duration::from_millis(1));
        let mut ticks = tokio::time::interval_at(start.into(), tick);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let last = WARM_UP + self.load.time;
        let end = tokio::time::sleep_until((self.begin + self.offset + last + REST).into());
        tokio::pin!(end);
        let mut done = 0;
        loop {
            tokio::select! {
                biased;
                message = port.recv() => match message {
                    Some(message) => self.count(&message.payload),
                    None => break,
                },
                _ = ticks.tick() => {
                    let elapsed = start.elapsed().min(last);
                    let due = (elapsed.as_secs_f64() * f64::from(self.load.rate)) as u64;
                    while done < due {
                        self.send(&port);
                        done += 1;
                    }
                }
                () = &mut end => break,
            }
        }
        self.tally
    }

    fn send(&mut self, port: &Port) {
        let now = self.begin.elapsed();
        let mut payload = BytesMut::with_capacity(self.load.size);
        payload.put_u16_le(LOAD);
        payload.put_u64_le(now.as_nanos() as u64);
        payload.resize(self.load.size, 0);
        let message = Outgoing::new(port.id(), self.to, payload.freeze());
        let counts = self.is_counted(now);
        match port.send(message) {
            Ok(_) => self.tally.sent += u64::from(counts),
            Err(_) => self.tally.refused += u64::from(counts),
        }
    }

    /// Whether what was sent then is counted: not what warms up.
    fn is_counted(&self, sent: Duration) -> bool {
        sent >= WARM_UP
    }

    fn count(&mut self, payload: &Bytes) {
        let sent = payload.get(2..HEAD).and_then(|octets| octets.first_chunk());
        if let Some(&sent) = sent
            && code_of(payload) == Some(LOAD)
        {
            let sent = Duration::from_nanos(u64::from_le_bytes(sent));
            if self.is_counted(sent) {
                let time = self.begin.elapsed().saturating_sub(sent);
                self.tally.latencies.add(time);
            }
        }
    }
}
