//! Child processes of the load test: this program again, which reads orders from standard input and
//! answers on standard output, as lines of JSON. A child ends when its input closes, even if the
//! parent was killed.
#![expect(clippy::disallowed_methods, reason = "waits for processes")]

use std::io::{BufRead, BufReader, Write};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use jaus::address::JausId;
use jaus_cli::failure::Failure;
use serde::{Deserialize, Serialize};

use super::latencies::Latencies;

/// The hidden subcommand that a child runs.
pub(crate) const SUBCOMMAND: &str = "load-child";
/// Timeout of a child after its input was closed.
const END: Duration = Duration::from_secs(3);

/// Order from the parent to a child.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Order {
    /// Run a node that serves component processes.
    Serve(NodeOrder),
    /// Attach components, each with its own connection, to the nodes at these addresses.
    Attach(Vec<(String, u8)>),
    /// Set the partner of each attached component.
    Partners(Vec<JausId>),
    /// Send, and measure.
    Measure(Run),
}

/// A node of the load test. It finds the others by address, without multicast, so that it disturbs
/// no other node of this host.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct NodeOrder {
    pub(super) node: u8,
    /// Socket for component processes.
    pub(super) socket: PathBuf,
    /// UDP addresses of all nodes of the load test; the first is node 1.
    pub(super) addresses: Vec<SocketAddr>,
    /// Number of components on all nodes.
    pub(super) components: u16,
}

/// One step of the schedule in one process.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Run {
    /// Distinguishes the messages of this step from late ones of earlier steps.
    pub(super) number: u32,
    /// Messages per second of this process.
    pub(super) pace: Pace,
    /// Messages that a component sends at once, if the pace is a rate.
    pub(super) burst: u32,
    /// Duration of the measurement, after the warm-up.
    pub(super) time: Duration,
    /// Octets of a message.
    pub(super) size: usize,
    pub(super) acknowledged_by: Acknowledger,
}

/// Schedule of the messages.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) enum Pace {
    /// This many per second, whether or not earlier ones are acknowledged.
    PerSecond(f64),
    /// As fast as possible, with this many unacknowledged messages per component.
    Window(u32),
}

/// What acknowledges a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(super) enum Acknowledger {
    /// The receiving component sends a message back
    Component,
    /// The receiving component's node acknowledges (AS5669A); lost messages are retransmitted
    Node,
}

/// A child's answer to an order.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Answer {
    Ready,
    Attached(Vec<JausId>),
    Measured(Tally),
    Failed(String),
}

/// Results of one step, for the components of one or several processes.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Tally {
    /// Acknowledged messages, including the warm-up.
    pub(super) all: u64,
    /// Sent messages that count.
    pub(super) sent: u64,
    /// Messages refused by the sender's connection.
    pub(super) refused: u64,
    /// Round trips of all acknowledged messages that count.
    pub(super) latencies: Latencies,
}

impl Tally {
    pub(super) fn merge(&mut self, other: &Self) {
        self.all += other.all;
        self.sent += other.sent;
        self.refused += other.refused;
        self.latencies.merge(&other.latencies);
    }

    /// Unacknowledged messages that count.
    pub(super) fn lost(&self) -> u64 {
        self.sent.saturating_sub(self.latencies.count())
    }
}

/// Handle of a running child.
pub(super) struct Process {
    name: String,
    child: Child,
    /// `None` once closed, which ends the child.
    orders: Option<ChildStdin>,
    answers: Receiver<String>,
}

impl Process {
    /// Starts a child; `name` identifies it in errors.
    pub(super) fn start(name: String) -> Result<Self, Failure> {
        let failed = |error| Failure::new(format!("cannot start the {name}: {error}"));
        let program = std::env::current_exe().map_err(failed)?;
        let mut command = Command::new(program);
        command.arg(SUBCOMMAND);
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        // Ctrl-C reaches only the parent; the child then sees the end of its input, and cleans up.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(failed)?;
        let (sender, answers) = channel();
        if let Some(output) = child.stdout.take() {
            std::thread::spawn(move || {
                let lines = BufReader::new(output).lines().map_while(Result::ok);
                lines.for_each(|line| drop(sender.send(line)));
            });
        }
        let orders = child.stdin.take();
        Ok(Self {
            name,
            child,
            orders,
            answers,
        })
    }

    /// Sends an order without waiting for the answer.
    pub(super) fn order(&mut self, order: &Order) -> Result<(), Failure> {
        let line = serde_json::to_string(order).map_err(Failure::of)?;
        let written = self
            .orders
            .as_mut()
            .is_some_and(|pipe| writeln!(pipe, "{line}").is_ok());
        written.then_some(()).ok_or_else(|| self.ended())
    }

    /// Waits for the answer to the oldest pending order.
    pub(super) fn answer(&mut self, patience: Duration) -> Result<Answer, Failure> {
        let line = self
            .answers
            .recv_timeout(patience)
            .map_err(|error| match error {
                RecvTimeoutError::Timeout => {
                    let seconds = patience.as_secs_f64();
                    Failure::new(format!(
                        "the {} did not answer within {seconds} s",
                        self.name
                    ))
                }
                RecvTimeoutError::Disconnected => self.ended(),
            })?;
        match serde_json::from_str(&line).map_err(Failure::of)? {
            Answer::Failed(why) => Err(Failure::new(format!("the {}: {why}", self.name))),
            answer => Ok(answer),
        }
    }

    /// Processor time of its main thread, which does all the work. Linux only.
    pub(super) fn processor_time(&self) -> Option<Duration> {
        let path = format!("/proc/{}/schedstat", self.child.id());
        let text = std::fs::read_to_string(path).ok()?;
        let nanoseconds = text.split_whitespace().next()?.parse().ok()?;
        Some(Duration::from_nanos(nanoseconds))
    }

    fn ended(&self) -> Failure {
        Failure::new(format!("the {} has ended unexpectedly", self.name))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        drop(self.orders.take());
        let step = Duration::from_millis(10);
        for _ in 0..END.as_millis() / step.as_millis() {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(step);
        }
        // An error means that it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
