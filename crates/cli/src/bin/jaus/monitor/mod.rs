//! `jaus monitor`: shows a live table of peers, links and drops.

mod sample;
mod table;

use std::time::Duration;

use bytes::Bytes;
use clap::{Args, ValueEnum};
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{Component, Kind, PeerClocks};
use jaus::endpoint::Outgoing;
use jaus::messages::core::QueryHeartbeatPulse;
use jaus::node::{Node, Sender};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::Network;
use jaus_cli::runtime::{self, RunFor};
use tokio::time::{MissedTickBehavior, interval};

use self::sample::{Sample, View};
use self::table::Screen;

/// Watch peers, links and losses live
///
/// Runs its own node and shows its peers, their addresses, message rates and round trips; its
/// links; and dropped messages with the reason. It receives broadcasts and messages to itself, not
/// traffic between other nodes: `jaus record` captures that. On a terminal the table is updated in
/// place; otherwise each one is printed below the last.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus monitor\n  \
    jaus monitor --sort received --interval 5s\n  \
    jaus monitor --probe                  measures round trips\n  \
    jaus monitor --clocks                 measures how far peers' clocks are ahead\n  \
    jaus monitor --once --json | jq '.peers[].id'\n  \
    jaus monitor --peer 192.168.7.2       for a host that multicast does not reach\n\n\
    Columns: messages and payload octets per second from a peer; messages per second to it; lost \
    (not acknowledged); rep (duplicates received); round trip (--probe) in ms; seconds since its \
    last message; with --clocks how far its clock is ahead.")]
pub(crate) struct Monitor {
    /// The interval between tables
    #[arg(long, short, default_value = "1s", value_parser = runtime::duration)]
    interval: Duration,

    /// Print one table after the first interval, with --probe after the second, and exit; exit
    /// status 1 means that there are no peers
    #[arg(long)]
    once: bool,

    /// Print each table as a JSON object
    #[arg(long)]
    json: bool,

    /// The sort order
    #[arg(long, value_enum, default_value_t = Sort::Id)]
    sort: Sort,

    /// The maximum number of peers to show [default: as many as fit the terminal, or 1000]
    #[arg(long, value_name = "NUMBER")]
    limit: Option<usize>,

    /// Query heartbeats of some peers in each interval, and measure the round trips
    #[arg(long)]
    probe: bool,

    /// Query the time of peers that offer the Time service, and measure how far their clocks are
    /// ahead of this host's
    #[arg(long)]
    clocks: bool,

    #[command(flatten)]
    run_for: RunFor,

    #[command(flatten)]
    network: Network,
}

/// What peers are sorted by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Sort {
    /// JAUS id
    Id,
    /// Messages received per second, highest first
    Received,
    /// Messages sent per second, highest first
    Sent,
    /// Lost and repeated messages, most first
    Lost,
    /// Round trip, longest first
    RoundTrip,
    /// Silence, longest first
    Heard,
}

/// Maximum number of peers probed per interval, to limit the network load.
const PROBES: usize = 20;

impl Monitor {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        runtime::run(async {
            let (id, config) = self.network.for_own_node("jaus monitor")?;
            let node = self.network.start(config)?;
            let port = node.attach(id.component()).map_err(Failure::of)?;
            let mut probe = self.probe.then(|| Probe::new(port.sender())).transpose()?;
            let component = Component::builder(Kind::OtherSubsystem, "jaus monitor")
                .live_on(port)
                .map_err(Failure::of)?;
            let clocks = PeerClocks::default();
            let mut screen = Screen::open(self.json, self.once, self.limit);
            let outcome = tokio::select! {
                outcome = self.watch(&node, &component, &mut probe, &clocks, &mut screen) => outcome,
                never = clocks.measure(&component), if self.clocks => match never {},
            };
            screen.close();
            drop((component, probe));
            node.shutdown().await;
            outcome
        })
    }

    async fn watch(
        &self,
        node: &Node,
        component: &Component,
        probe: &mut Option<Probe>,
        clocks: &PeerClocks,
        screen: &mut Screen,
    ) -> Result<Outcome, Failure> {
        let end = self.run_for.end();
        tokio::pin!(end);
        let mut turns = interval(self.interval);
        turns.set_missed_tick_behavior(MissedTickBehavior::Delay);
        turns.tick().await;
        let mut before = Sample::take(node);
        if !self.once {
            screen.show(&self.view(&before, &before, component, clocks))?;
        }
        // The only table waits for the answers to the probes.
        let mut waits_for_answers = self.once && (probe.is_some() || self.clocks);
        loop {
            tokio::select! {
                () = &mut end => return Ok(Outcome::Done),
                _ = turns.tick() => {}
            }
            let sample = Sample::take(node);
            if let Some(probe) = probe {
                probe.ask(&sample, component.id());
            }
            if std::mem::take(&mut waits_for_answers) {
                before = sample;
                continue;
            }
            let view = self.view(&before, &sample, component, clocks);
            screen.show(&view)?;
            if self.once {
                return Ok(Outcome::complete_if(!view.peers.is_empty()));
            }
            before = sample;
        }
    }

    fn view(
        &self,
        before: &Sample,
        now: &Sample,
        component: &Component,
        clocks: &PeerClocks,
    ) -> View {
        let mut view = now.since(before, &component.directory(), component.id());
        for peer in &mut view.peers {
            peer.clock = clocks.offset(peer.id);
        }
        view.peers.sort_by(|a, b| {
            let most = |one: f64, other: f64| other.total_cmp(&one);
            match self.sort {
                Sort::Id => a.id.cmp(&b.id),
                Sort::Received => most(a.received, b.received),
                Sort::Sent => most(a.sent, b.sent),
                Sort::Lost => (b.lost + b.repeated).cmp(&(a.lost + a.repeated)),
                Sort::RoundTrip => b.round_trip.cmp(&a.round_trip),
                Sort::Heard => b.silent.cmp(&a.silent),
            }
        });
        view
    }
}

/// Sends peers a query that wants an acknowledgement, so that the node measures round trips.
struct Probe {
    sender: Sender,
    question: Bytes,
    /// The last probed peer.
    latest: Option<JausId>,
}

impl Probe {
    fn new(sender: Sender) -> Result<Self, Failure> {
        Ok(Self {
            sender,
            question: QueryHeartbeatPulse.encode().map_err(Failure::of)?,
            latest: None,
        })
    }

    /// Probes the next peers in turn.
    fn ask(&mut self, sample: &Sample, own: JausId) {
        let ids: Vec<JausId> = sample.ids().filter(|&id| id != own).collect();
        let begin = ids.partition_point(|&id| Some(id) <= self.latest);
        let in_turn = ids.iter().cycle().skip(begin).take(PROBES.min(ids.len()));
        for &id in in_turn {
            self.latest = Some(id);
            let question = Outgoing {
                acknowledge: true,
                ..Outgoing::new(own, id, self.question.clone())
            };
            if let Err(error) = self.sender.send(question) {
                tracing::debug!(%id, %error, "not probed");
            }
        }
    }
}
