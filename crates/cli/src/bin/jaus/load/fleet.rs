//! Processes of a load test: nodes, and components attached to them.
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "finds free ports and waits for processes"
)]

use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::time::Duration;

use jaus::address::JausId;
use jaus::node::Address;
use jaus_cli::failure::Failure;

use super::components::{REST, WARM_UP};
use super::process::{Answer, NodeOrder, Order, Pace, Process, Run, Tally};
use super::report::Row;
use super::{LoadCommand, Rate, progress};

/// Timeout of a process, beyond the requested duration.
const PATIENCE: Duration = Duration::from_secs(30);

/// Maximum time that a step waits for the backlog of an earlier one.
const SETTLE: Duration = Duration::from_secs(10);

/// All processes of a load test. Dropped in this order: components end before their nodes.
pub(super) struct Fleet {
    clients: Vec<Process>,
    nodes: Vec<Process>,
    components: usize,
}

impl Fleet {
    /// Starts nodes on free ports of loopback, and attaches components to them.
    pub(super) fn start(command: &LoadCommand) -> Result<Self, Failure> {
        let directory = directory()?;
        let fleet = Self::start_in(&directory, command);
        if fleet.is_err() {
            let _ = std::fs::remove_dir_all(&directory);
        }
        fleet
    }

    fn start_in(directory: &Path, command: &LoadCommand) -> Result<Self, Failure> {
        progress(format_args!("starting {} nodes", command.nodes));
        let addresses = free_addresses(command.nodes)?;
        let (mut nodes, mut sockets) = (Vec::new(), Vec::new());
        for node in 1..=command.nodes {
            let socket = directory.join(format!("node-{node}.sock"));
            let mut process = Process::start(format!("node {node}"))?;
            process.order(&Order::Serve(NodeOrder {
                node,
                socket: socket.clone(),
                addresses: addresses.clone(),
                components: command.components,
            }))?;
            process.answer(PATIENCE)?;
            nodes.push(process);
            sockets.push(Address::Path(socket));
        }
        let mut fleet = Self::attach(&sockets, command)?;
        fleet.nodes = nodes;
        Ok(fleet)
    }

    /// Attaches components to running nodes.
    pub(super) fn attach(nodes: &[Address], command: &LoadCommand) -> Result<Self, Failure> {
        let components = usize::from(command.components);
        let processes = usize::from(command.processes);
        progress(format_args!("attaching {components} components"));
        let mut clients = Vec::with_capacity(processes);
        for first in 0..processes {
            let of_process = (first..components).step_by(processes);
            let place = |component: usize| {
                // Numbered from 1; the command has checked that each node has enough numbers.
                let number = (component / nodes.len() + 1) as u8;
                (nodes[component % nodes.len()].to_string(), number)
            };
            let mut client = Process::start(format!("component process {}", first + 1))?;
            client.order(&Order::Attach(of_process.map(place).collect()))?;
            clients.push(client);
        }
        let mut ids = Vec::with_capacity(processes);
        for client in &mut clients {
            match client.answer(PATIENCE)? {
                Answer::Attached(attached) => ids.push(attached),
                other => return Err(unexpected(&other)),
            }
        }
        let id = |component: usize| -> JausId { ids[component % processes][component / processes] };
        for (first, client) in clients.iter_mut().enumerate() {
            let of_process = (first..components).step_by(processes);
            let partners = of_process.map(|component| id((component + 1) % components));
            client.order(&Order::Partners(partners.collect()))?;
            client.answer(PATIENCE)?;
        }
        Ok(Self {
            clients,
            nodes: Vec::new(),
            components,
        })
    }

    /// Runs one step of the schedule in all component processes.
    pub(super) fn measure(
        &mut self,
        rate: Rate,
        window: u32,
        run: impl Fn(Pace) -> Run,
    ) -> Result<Row, Failure> {
        progress(match rate {
            Rate::PerSecond(rate) => format!("measuring {rate} messages/s"),
            Rate::Max => "measuring as many messages/s as possible".to_owned(),
        });
        self.settle();
        let before = self.processor_time();
        let processes = self.clients.len();
        let mut time = Duration::ZERO;
        for (first, client) in self.clients.iter_mut().enumerate() {
            let components = (first..self.components).step_by(processes).count();
            let share = components as f64 / self.components as f64;
            let run = run(match rate {
                Rate::PerSecond(rate) => Pace::PerSecond(f64::from(rate) * share),
                Rate::Max => Pace::Window(window),
            });
            time = run.time;
            client.order(&Order::Measure(run))?;
        }
        let mut tally = Tally::default();
        for client in &mut self.clients {
            match client.answer(WARM_UP + time + REST + PATIENCE)? {
                Answer::Measured(measured) => tally.merge(&measured),
                other => return Err(unexpected(&other)),
            }
        }
        let used = before.zip(self.processor_time());
        let used = used.map(|(before, after)| after.saturating_sub(before));
        Ok(Row::new(rate, &tally, time, used))
    }

    /// Waits until the processes have worked off the backlog of an earlier step.
    fn settle(&self) {
        let pause = Duration::from_millis(100);
        let mut before = self.processor_time();
        for _ in 0..SETTLE.as_millis() / pause.as_millis() {
            std::thread::sleep(pause);
            let now = self.processor_time();
            let used = before
                .zip(now)
                .map(|(before, now)| now.saturating_sub(before));
            if used.is_none_or(|used| used < pause / 5) {
                return;
            }
            before = now;
        }
    }

    /// Total of all processes.
    fn processor_time(&self) -> Option<Duration> {
        let processes = self.nodes.iter().chain(&self.clients);
        processes.map(Process::processor_time).sum()
    }
}

fn unexpected(answer: &Answer) -> Failure {
    Failure::new(format!("a process gave an unexpected answer: {answer:?}"))
}

/// Free UDP ports on loopback, one per node.
fn free_addresses(nodes: u8) -> Result<Vec<SocketAddr>, Failure> {
    let bind = |_| UdpSocket::bind("127.0.0.1:0");
    // All open at once, so that they differ.
    let sockets = (0..nodes).map(bind).collect::<Result<Vec<_>, _>>();
    let addresses = sockets.and_then(|all| all.iter().map(UdpSocket::local_addr).collect());
    addresses.map_err(|error| Failure::new(format!("no free ports on loopback: {error}")))
}

/// A directory for the sockets; the nodes remove it when they end.
fn directory() -> Result<PathBuf, Failure> {
    let directory = std::env::temp_dir().join(format!("jaus-load-{}", std::process::id()));
    std::fs::create_dir_all(&directory).map_err(|error| Failure::file(&directory, &error))?;
    Ok(directory)
}
