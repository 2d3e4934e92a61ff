//! Components of one process: each sends to its partner, acknowledges received messages, and
//! measures the time until its own messages are acknowledged.
#![expect(
    clippy::disallowed_methods,
    reason = "the load is paced and measured in real time"
)]

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::{BufMut, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received};
use jaus::node::{Port, Sender};
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;

use super::process::{Acknowledger, Pace, Run, Tally};

/// Code of a message that the receiving component acknowledges: user-defined, so that no service
/// acts on it.
const LOAD: u16 = 0xD7F1;
/// Code of a component's acknowledgement.
const ACKNOWLEDGEMENT: u16 = 0xD7F2;
/// Code of a message that only the receiving node acknowledges.
const LOAD_FOR_NODE: u16 = 0xD7F3;
/// Octets of a message before its padding: code, step number, send time in nanoseconds.
pub(super) const HEAD: usize = 2 + 4 + 8;
/// Messages sent during the warm-up do not count.
pub(super) const WARM_UP: Duration = Duration::from_millis(500);
/// Time for late acknowledgements after the last message.
pub(super) const REST: Duration = Duration::from_secs(2);
/// A component with a window discards its pending messages after this time without an
/// acknowledgement, and refills the window.
const GIVE_UP: Duration = Duration::from_secs(1);
/// Due messages are sent at each tick.
const TICK: Duration = Duration::from_millis(1);

/// The attached components of this process.
pub(super) struct Components {
    members: Vec<Member>,
    step: Mutex<Step>,
    /// Start of the send times.
    origin: Instant,
    receivers: Mutex<JoinSet<()>>,
}

/// Sender of one component.
struct Member {
    sender: Sender,
    partner: Mutex<Option<JausId>>,
}

/// The current or last step of the schedule.
#[derive(Default)]
struct Step {
    run: Option<Run>,
    /// Relative to the origin.
    begin: Duration,
    /// Relative to `begin`. Messages are sent until then.
    length: Duration,
    tally: Tally,
    windows: Vec<Window>,
}

/// Unacknowledged messages of a component.
#[derive(Clone, Copy, Default)]
struct Window {
    waiting: u32,
    /// Time of the last acknowledgement, relative to the origin.
    heard: Duration,
}

impl Components {
    /// Starts a task per component, which ends with its connection.
    pub(super) fn new(ports: Vec<Port>) -> Arc<Self> {
        let members = ports.iter().map(|port| Member {
            sender: port.sender(),
            partner: Mutex::default(),
        });
        let components = Arc::new(Self {
            members: members.collect(),
            step: Mutex::default(),
            origin: Instant::now(),
            receivers: Mutex::default(),
        });
        let mut receivers = locked(&components.receivers);
        for (member, port) in ports.into_iter().enumerate() {
            receivers.spawn(components.clone().receive(member, port));
        }
        drop(receivers);
        components
    }

    /// Detaches all components, and waits until their nodes have been notified: a node warns of
    /// connections that close without notice.
    pub(super) async fn detach(&self) {
        let mut receivers = std::mem::take(&mut *locked(&self.receivers));
        receivers.shutdown().await;
        for member in &self.members {
            member.sender.disconnected().await;
        }
    }

    /// Sets the partner of each component.
    pub(super) fn pair(&self, partners: Vec<JausId>) {
        for (member, partner) in self.members.iter().zip(partners) {
            *locked(&member.partner) = Some(partner);
        }
    }

    /// Runs one step: warm-up, measurement, and time for late acknowledgements.
    pub(super) async fn measure(self: &Arc<Self>, run: Run) -> Tally {
        *self.step() = Step {
            run: Some(run),
            begin: self.origin.elapsed(),
            length: WARM_UP + run.time,
            tally: Tally::default(),
            windows: vec![Window::default(); self.members.len()],
        };
        let end = WARM_UP + run.time;
        let begin = Instant::now();
        let mut ticks = tokio::time::interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let mut done = 0;
        while begin.elapsed() < end + REST {
            ticks.tick().await;
            let elapsed = begin.elapsed();
            if elapsed >= end {
                if self.is_everything_acknowledged() {
                    break;
                }
                continue;
            }
            match run.pace {
                Pace::PerSecond(rate) => {
                    let due = (elapsed.as_secs_f64() * rate) as u64;
                    let now = self.origin.elapsed();
                    for message in done..due {
                        let turn = message / u64::from(run.burst);
                        self.send((turn % self.members.len() as u64) as usize, now);
                    }
                    done = due;
                }
                Pace::Window(most) => self.fill_windows(most),
            }
        }
        let mut step = self.step();
        step.run = None;
        std::mem::take(&mut step.tally)
    }

    /// Receives the messages of one component until its connection ends.
    async fn receive(self: Arc<Self>, member: usize, mut port: Port) {
        while let Some(message) = port.recv().await {
            self.handle(member, &message);
        }
    }

    fn handle(self: &Arc<Self>, member: usize, message: &Received) {
        let Some((code, head)) = message.payload.split_first_chunk() else {
            return;
        };
        match (u16::from_le_bytes(*code), head.get(..HEAD - 2)) {
            (LOAD, Some(head)) => {
                let payload = [&ACKNOWLEDGEMENT.to_le_bytes(), head].concat();
                let sender = &self.members[member].sender;
                let answer = Outgoing::new(sender.id(), message.source, payload.into());
                // An unsent acknowledgement counts as a lost message of the partner.
                let _ = sender.send(answer);
            }
            (ACKNOWLEDGEMENT, Some(head)) => {
                if let Some((number, sent)) = head.split_first_chunk()
                    && let Ok(sent) = sent.try_into()
                {
                    let sent = Duration::from_nanos(u64::from_le_bytes(sent));
                    self.acknowledged(member, u32::from_le_bytes(*number), sent);
                }
            }
            _ => {}
        }
    }

    /// Counts an acknowledgement; a component with a window sends the next message.
    fn acknowledged(self: &Arc<Self>, member: usize, number: u32, sent: Duration) {
        let now = self.origin.elapsed();
        let mut step = self.step();
        let Some(run) = step.run.filter(|run| run.number == number) else {
            return;
        };
        step.tally.all += 1;
        if step.counts(sent) {
            step.tally.latencies.add(now.saturating_sub(sent));
        }
        let window = &mut step.windows[member];
        window.waiting = window.waiting.saturating_sub(1);
        window.heard = now;
        let is_over = now >= step.begin + step.length;
        drop(step);
        if matches!(run.pace, Pace::Window(_)) && !is_over {
            self.send(member, now);
        }
    }

    /// Fills the windows that are empty or have timed out.
    fn fill_windows(self: &Arc<Self>, most: u32) {
        let now = self.origin.elapsed();
        for member in 0..self.members.len() {
            let mut step = self.step();
            let window = &mut step.windows[member];
            if window.waiting > 0 && now.saturating_sub(window.heard) < GIVE_UP {
                continue;
            }
            *window = Window {
                waiting: 0,
                heard: now,
            };
            drop(step);
            (0..most).for_each(|_| self.send(member, now));
        }
    }

    fn send(self: &Arc<Self>, member: usize, now: Duration) {
        let Member { sender, partner } = &self.members[member];
        let Some((run, partner)) = self.step().run.zip(*locked(partner)) else {
            return;
        };
        let message = Outgoing::new(sender.id(), partner, payload(run, now));
        let result = match run.acknowledged_by {
            Acknowledger::Component => sender.send(message).map(drop).is_ok(),
            Acknowledger::Node => {
                let (components, sender) = (self.clone(), sender.clone());
                tokio::spawn(async move {
                    if sender.deliver(message).await.is_ok() {
                        components.acknowledged(member, run.number, now);
                    }
                });
                true
            }
        };
        let mut step = self.step();
        let counts = u64::from(step.counts(now));
        if result {
            step.tally.sent += counts;
            step.windows[member].waiting += 1;
        } else {
            step.tally.refused += counts;
        }
    }

    fn is_everything_acknowledged(&self) -> bool {
        self.step().windows.iter().all(|window| window.waiting == 0)
    }

    fn step(&self) -> MutexGuard<'_, Step> {
        locked(&self.step)
    }
}

impl Step {
    /// Whether a message sent at this time counts.
    fn counts(&self, sent: Duration) -> bool {
        sent >= self.begin + WARM_UP
    }
}

fn payload(run: Run, now: Duration) -> Bytes {
    let mut payload = BytesMut::with_capacity(run.size);
    payload.put_u16_le(match run.acknowledged_by {
        Acknowledger::Component => LOAD,
        Acknowledger::Node => LOAD_FOR_NODE,
    });
    payload.put_u32_le(run.number);
    payload.put_u64_le(now.as_nanos() as u64);
    payload.resize(run.size, 0);
    payload.freeze()
}

/// Locks a mutex. No code panics while it holds a lock here.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
