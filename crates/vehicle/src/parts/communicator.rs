//! The communicator: the vehicle's node. It routes messages between the boards, the operator's
//! network and a radio, logs component arrivals and departures, keeps the journal, and serves the
//! debug view.
//!
//! The node itself does the routing ([`Config::routing`](jaus::node::Config)). This module adds
//! what operators expect of the node that all messages pass.

use std::collections::BTreeSet;
use std::convert::Infallible;
use std::future::pending;

use super::{Part, PartError, Slot};
use crate::messages;
use jaus::component::{Component, Watch};
use jaus::endpoint::{Event, Remote};
use jaus::node::{ComponentEvents, Events, Node};
use jaus_view::debug::{DebugAddress, DebugListener, DebugView};
use jaus_view::{Dictionary, Journal, JournalSettings, tree};

/// Limit of hosts whose ID conflicts are logged, one for each, since an attacker may invent any number.
const MOST_CONFLICTS: usize = 256;

/// Settings of the vehicle's node beyond routing.
///
/// It offers Time, so that other hosts can measure the clock of this one, with Access Control.
#[derive(Debug, Clone, Default)]
pub struct Communicator {
    /// Address of the debug view, if it is served.
    pub debug: Option<DebugAddress>,
    /// Other nodes of this process, whose messages the debug view shows too.
    pub beside: Vec<Node>,
    /// Whether failure to open the debug view is an error.
    pub debug_is_needed: bool,
    /// The journal on disk.
    pub log: Option<JournalSettings>,
}

impl Part for Communicator {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let Some(node) = slot.node.clone() else {
            let words = "the communicator is the host's node itself: omit --attach, and add \
                --local for others to attach";
            return Err(PartError::Broken(words.to_owned()));
        };
        let news = (node.events(), node.component_events());
        let _journal = self.start_journal(&node)?;
        let component = slot.timed_component("Communicator").live_on(slot.port)?;
        slot.telemetry.attach(&component);
        tell_place(&node, self.log.as_ref());
        let view = self.serve(&node, &component).await?;
        tokio::pin!(view);
        let notified = tell(&component, news);
        tokio::select! {
            error = &mut view => Err(PartError::Broken(format!("the debug view failed: {error}"))),
            end = notified => Err(end),
        }
    }
}

impl Communicator {
    fn start_journal(&self, node: &Node) -> Result<Option<Journal>, PartError> {
        let Some(settings) = &self.log else {
            return Ok(None);
        };
        let journal = Journal::start(node, settings, dictionary());
        journal
            .map(Some)
            .map_err(|error| PartError::Broken(error.to_string()))
    }

    /// Opens the debug view, if enabled. The future serves it and ends with an error.
    async fn serve(
        &self,
        node: &Node,
        component: &Component,
    ) -> Result<impl Future<Output = std::io::Error> + use<>, PartError> {
        let listener = match &self.debug {
            None => None,
            Some(address) => match address.listen().await {
                Ok(listener) => Some(listener),
                Err(error) if self.debug_is_needed => {
                    return Err(PartError::Broken(format!(
                        "no debug view at {address}: {error}; choose another address, or off"
                    )));
                }
                Err(error) => {
                    tracing::info!("no debug view at {address}: {error}");
                    None
                }
            },
        };
        match listener.as_ref().and_then(DebugListener::address) {
            Some(DebugAddress::Tcp(address)) => {
                tracing::info!("debug view: ws://{address}/messages, http://{address}/tree");
                tracing::warn!("everyone who reaches {address} can read all messages");
            }
            Some(address) => tracing::info!("debug view: {address}"),
            None => {}
        }
        let nodes = std::iter::once(node).chain(&self.beside).cloned();
        let view = DebugView::new(nodes, component.clone(), dictionary());
        Ok(async move {
            let Some(listener) = listener else {
                return pending().await;
            };
            let Err(error) = view.serve(listener).await;
            error
        })
    }
}

/// The messages that the log and the debug view show with their fields.
fn dictionary() -> Dictionary {
    Dictionary::of(messages::registry())
}

/// Logs the node's addresses and services.
fn tell_place(node: &Node, log: Option<&JournalSettings>) {
    let config = node.config();
    if config.routing.forward {
        tracing::info!("routing between all links");
    }
    #[cfg(feature = "serial")]
    for line in node.serial_lines() {
        let settings = line.settings;
        tracing::info!("serial line {}, {} baud", settings.device, settings.baud);
    }
    if let Some(tcp) = node.tcp().and_then(|tcp| tcp.listening) {
        tracing::info!("TCP connections at {tcp}");
    }
    if let Some(place) = node.local_place() {
        tracing::info!("components of this host may attach at {place}");
    }
    if let Some(log) = log {
        tracing::info!("traffic log in {}", log.directory.display());
    }
}

/// Logs arrivals, changes and departures until the node has stopped.
async fn tell(component: &Component, news: (Events, ComponentEvents)) -> PartError {
    let (mut events, mut arrivals) = news;
    let mut changes: Watch = component.watch();
    // Every message of the other component repeats the conflict event. Log it once for each host, which
    // has any number of ports.
    let mut conflicts: BTreeSet<Remote> = BTreeSet::new();
    loop {
        let words = tokio::select! {
            Some(change) = changes.next() => tree::in_words(change, &component.directory()),
            Some(event) = events.recv() => match event {
                Event::IdConflict { id, path } => {
                    let is_new = conflicts.len() < MOST_CONFLICTS && conflicts.insert(path.peer.origin());
                    is_new.then(|| format!(
                        "the node at {} also has our id {id}: choose another for one of them",
                        path.peer
                    ))
                }
                Event::PeerMoved { id, from, to } => {
                    Some(format!("{id} has moved from {} to {}", from.peer, to.peer))
                }
                _ => None,
            },
            Some(arrival) = arrivals.recv() => arrival.in_words(),
            else => return PartError::NodeStopped,
        };
        if let Some(words) = words {
            tracing::info!("{words}");
        }
    }
}
