//! `jaus node`: a discoverable node that prints its observations.

use std::collections::BTreeSet;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::endpoint::Event;
use jaus::node::{ComponentEvents, Events, Local, Node, units};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::{Network, SubsystemKind};
use jaus_cli::output::Output;
use jaus_cli::runtime::{self, Clock, RunFor};
use jaus_cli::statistics::{self, DropWatch};
use jaus_cli::tree;
use tokio::time::{MissedTickBehavior, interval};

/// Run a node with one component that others can find
///
/// It offers the core services Transport, Discovery and Liveness, and prints the arrivals, changes
/// and losses of others.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus node --id 101.1.1 --name Rover --kind vehicle\n  \
    jaus node --id 102.1 --interface eth0 --port 3795\n  \
    jaus node --id 101.1 --local          component processes of this host may attach\n  \
    jaus node --config node.toml --stats\n  \
    jaus node --id 101.1 --stats=10s      prints counters every 10 s\n  \
    jaus node --loopback                  for trying it on one computer")]
pub(crate) struct NodeCommand {
    /// Print counters of received, sent and dropped messages at the end; with =TIME, such as =10s,
    /// also at that interval
    #[arg(
        long,
        value_name = "TIME",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "0s",
        value_parser = units::duration,
    )]
    stats: Option<Duration>,

    #[command(flatten)]
    run_for: RunFor,

    /// Our subsystem's name [default: jaus node]
    #[arg(long)]
    name: Option<String>,

    /// Our subsystem's kind [default: other]
    #[arg(long, value_enum)]
    kind: Option<SubsystemKind>,

    /// Let component processes of this host attach to the node; ADDRESS is a socket path or a
    /// loopback port such as 127.0.0.1:37940 [default: the usual place]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = "default")]
    local: Option<Local>,

    #[command(flatten)]
    network: Network,
}

/// Interval of drop reports in the log.
const LOG: Duration = Duration::from_secs(10);

/// Default id.
const ID: JausId = JausId::new(101, 1, 1);

impl NodeCommand {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let (id, identity, mut config) = self.network.for_node(ID)?;
        if let Some(local) = &self.local {
            config.local = local.clone();
        }
        let kind = self.kind.or(identity.kind);
        let kind = kind.map_or(Kind::OtherSubsystem, Kind::from);
        let name = self.name.clone().or(identity.name);
        let name = name.unwrap_or_else(|| "jaus node".to_owned());
        runtime::run(async {
            let node = self.network.start(config)?;
            let events = (node.events(), node.component_events());
            let component = Component::builder(kind, name)
                .attach(&node, id.component())
                .map_err(Failure::of)?;
            let mut output = Output::new();
            introduce(&node, &component, &mut output)?;
            let outcome = self.watch(&node, &component, events, &mut output).await;
            if self.stats.is_some() {
                statistics::print(&node, &mut output)?;
            }
            drop(component);
            node.shutdown().await;
            outcome
        })
    }

    /// Prints events until the end.
    async fn watch(
        &self,
        node: &Node,
        component: &Component,
        (mut events, mut arrivals): (Events, ComponentEvents),
        output: &mut Output,
    ) -> Result<Outcome, Failure> {
        let mut changes = component.watch();
        let end = self.run_for.end();
        tokio::pin!(end);
        let clock = Clock::start();
        // Every message of the other component repeats the conflict; report it once.
        let mut conflicts = BTreeSet::new();
        let mut turns = interval(self.stats.filter(|time| !time.is_zero()).unwrap_or(LOG));
        turns.set_missed_tick_behavior(MissedTickBehavior::Delay);
        turns.tick().await;
        let mut drops = DropWatch::default();
        loop {
            let words = tokio::select! {
                () = &mut end => return Ok(Outcome::Done),
                _ = turns.tick() => {
                    drops.log(node);
                    if self.stats.is_some_and(|time| !time.is_zero()) {
                        statistics::print(node, output)?;
                    }
                    continue;
                }
                Some(change) = changes.next() => tree::in_words(change, &component.directory()),
                Some(event) = events.recv() => match event {
                    Event::IdConflict { path, .. } if !conflicts.insert(path.peer) => None,
                    event => in_words(&event),
                },
                Some(event) = arrivals.recv() => event.in_words(),
                else => return Err(Failure::new("the node has stopped")),
            };
            if let Some(words) = words {
                output.line(format_args!("{clock}  {words}"))?;
            }
        }
    }
}

/// Prints the node's id and links.
pub(crate) fn introduce(
    node: &Node,
    component: &Component,
    output: &mut Output,
) -> Result<(), Failure> {
    let directory = component.directory();
    for line in tree::lines(&directory, None) {
        output.line(line)?;
    }
    for link in node.links() {
        let group = link.group.map_or("no multicast".to_owned(), |group| {
            format!("multicast group {group}")
        });
        output.line(format_args!(
            "on {}: UDP {}, {group}",
            link.interface.name, link.local
        ))?;
    }
    if let Some(tcp) = node.tcp() {
        let listening = tcp.listening.map_or_else(
            || "outgoing connections only".to_owned(),
            |address| format!("listening on {address}"),
        );
        output.line(format_args!("TCP connections: {listening}"))?;
    }
    #[cfg(unix)]
    if let Some(junior) = node.junior() {
        let folder = junior.folder.display();
        output.line(format_args!("through Junior's node manager at {folder}"))?;
    }
    for line in node.serial_lines() {
        let settings = line.settings;
        output.line(format_args!(
            "on {}: serial line, {} baud",
            settings.device, settings.baud
        ))?;
    }
    if let Some(place) = node.local_place() {
        output.line(format_args!(
            "components of this host may attach at {place}"
        ))?;
    }
    output.line("Press Ctrl-C to end.\n")
}

/// Describes endpoint events that discovery does not report.
fn in_words(event: &Event) -> Option<String> {
    match event {
        Event::PeerMoved { id, from, to } => {
            Some(format!("{id} has moved from {} to {}", from.peer, to.peer))
        }
        Event::IdConflict { id, path } => Some(format!(
            "the node at {} also has our id {id}: choose another for one of them (--id)",
            path.peer
        )),
        _ => None,
    }
}
