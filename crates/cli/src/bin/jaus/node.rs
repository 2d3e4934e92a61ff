//! `jaus node`: a discoverable node that prints its observations.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus::component::{Change, Component, Kind};
use jaus::endpoint::Event;
use jaus::node::{ComponentEvents, Events, LinkReport, Local, Node, units};
use jaus_cli::exposure;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::logging::{self, LevelRequests};
use jaus_cli::metrics::{Metrics, MetricsFlags};
use jaus_cli::network::{Network, SubsystemKind};
use jaus_cli::runtime::{self, RunFor};
use jaus_cli::statistics::{self, DropWatch};
use jaus_cli::tree;
use jaus_vehicle::parts::Telemetry;
use serde_json::json;
use tokio::time::{MissedTickBehavior, interval};

use crate::events::{EventFormat, EventPrinter};

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
    jaus node --loopback                  for trying it on one computer\n\n\
    Events of --json: \"started\" with \"id\" and \"links\"; \"discovery\" with the object of `jaus \
    discover --watch --json`; \"moved\" and \"conflict\" of peers' addresses; \"component\" for \
    processes that attach; \"statistics\" with counters by name.")]
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
    format: EventFormat,

    #[command(flatten)]
    network: Network,

    #[command(flatten)]
    metrics: MetricsFlags,
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
        logging::use_level(identity.log_level);
        runtime::run(async {
            let levels = LevelRequests::accept(self.network.file());
            let metrics = Metrics::open(self.metrics, identity.metrics).await?;
            let node = self.network.start_service(config)?;
            let events = (node.events(), node.component_events());
            let component = Component::builder(kind, name)
                .attach(&node, id.component())
                .map_err(Failure::of)?;
            let mut printer = self.format.printer();
            introduce(&node, &component, &mut printer)?;
            let telemetry = Telemetry::default();
            telemetry.attach(&component);
            let outcome = tokio::select! {
                outcome = self.watch(&node, &component, events, &mut printer) => outcome,
                () = metrics.run(Some(node.clone()), telemetry.clone()) => Ok(Outcome::Done),
                () = levels.follow() => Ok(Outcome::Done),
            };
            telemetry.release();
            if self.stats.is_some() {
                print_statistics(&node, &mut printer)?;
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
        printer: &mut EventPrinter,
    ) -> Result<Outcome, Failure> {
        let mut changes = component.watch();
        let end = self.run_for.end();
        tokio::pin!(end);
        // Every message of the other component repeats the conflict; report it once.
        let mut conflicts = BTreeSet::new();
        let mut turns = interval(self.stats.filter(|time| !time.is_zero()).unwrap_or(LOG));
        turns.set_missed_tick_behavior(MissedTickBehavior::Delay);
        turns.tick().await;
        let mut drops = DropWatch::default();
        loop {
            tokio::select! {
                () = &mut end => return Ok(Outcome::Done),
                _ = turns.tick() => {
                    drops.log(node);
                    if self.stats.is_some_and(|time| !time.is_zero()) {
                        print_statistics(node, printer)?;
                    }
                }
                Some(change) = changes.next() => print_change(change, component, printer)?,
                Some(event) = events.recv() => match event {
                    Event::IdConflict { path, .. } if !conflicts.insert(path.peer) => {}
                    event => print_event(&event, printer)?,
                },
                Some(event) = arrivals.recv() => {
                    if let Some(words) = event.in_words() {
                        printer.timed("component", json!({ "text": words }), &words)?;
                    }
                }
                else => return Err(Failure::new("the node has stopped")),
            }
        }
    }
}

/// Prints a change that discovery has found.
pub(crate) fn print_change(
    change: Change,
    component: &Component,
    printer: &mut EventPrinter,
) -> Result<(), Failure> {
    let directory = component.directory();
    match tree::in_words(change, &directory) {
        Some(words) => printer.timed("discovery", tree::change_json(change, &directory), words),
        None => Ok(()),
    }
}

fn print_statistics(node: &Node, printer: &mut EventPrinter) -> Result<(), Failure> {
    match printer.output() {
        Some(output) => statistics::print(node, output),
        None => {
            let counters = node.counters();
            let counted = counters.iter().filter(|&(_, count)| count > 0);
            let counters: BTreeMap<_, _> = counted.map(|(it, count)| (it.name(), count)).collect();
            printer.plain("statistics", json!({ "counters": counters }), "")
        }
    }
}

/// Prints the node's id and links.
pub(crate) fn introduce(
    node: &Node,
    component: &Component,
    printer: &mut EventPrinter,
) -> Result<(), Failure> {
    exposure::tell(node);
    let Some(output) = printer.output() else {
        let link = |it: &LinkReport| {
            json!({
                "interface": it.interface.name,
                "address": it.local.to_string(),
                "group": it.group.map(|group| group.to_string()),
            })
        };
        let links: Vec<_> = node.links().iter().map(link).collect();
        let details = json!({ "id": component.id().to_string(), "links": links });
        return printer.plain("started", details, "");
    };
    let directory = component.directory();
    for line in tree::lines(&directory, None, false) {
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

/// Prints endpoint events that discovery does not report.
fn print_event(event: &Event, printer: &mut EventPrinter) -> Result<(), Failure> {
    match event {
        Event::PeerMoved { id, from, to } => {
            let (from, to) = (from.peer.to_string(), to.peer.to_string());
            printer.timed(
                "moved",
                json!({ "component": id.to_string(), "from": from, "to": to }),
                format_args!("{id} has moved from {from} to {to}"),
            )
        }
        Event::IdConflict { id, path } => printer.timed(
            "conflict",
            json!({ "component": id.to_string(), "address": path.peer.to_string() }),
            format_args!(
                "the node at {} also has our id {id}: choose another for one of them (--id)",
                path.peer
            ),
        ),
        _ => Ok(()),
    }
}
