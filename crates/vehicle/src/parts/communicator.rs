//! The communicator: the vehicle's node. It passes messages on between the boards, the operator's
//! network and a radio, tells who comes and goes, keeps the log, and has the debug view.
//!
//! The routing itself is the node's ([`Config::routing`](jaus::node::Config)); here is what people
//! want of the node that everything passes.

use std::collections::BTreeSet;
use std::convert::Infallible;
use std::future::pending;
use std::net::SocketAddr;

use super::{Part, PartError, Slot};
use crate::messages;
use jaus::component::{Component, Watch};
use jaus::endpoint::{Event, Remote};
use jaus::node::{ComponentEvents, Events, Node};
use jaus_view::debug::{self, DebugView};
use jaus_view::{Dictionary, Journal, JournalSettings, tree};

/// Where the debug view is unless another address is chosen.
pub const DEBUG_ADDRESS: SocketAddr =
    SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 8794);

/// Components of the tree whose coming is told one by one; an attacker may invent more.
const MOST_CONFLICTS: usize = 256;

/// What the vehicle's node does besides being one.
#[derive(Debug, Clone, Default)]
pub struct Communicator {
    /// Where the debug view is served.
    pub debug: Option<SocketAddr>,
    /// Whether it is an error if that is not possible.
    pub debug_is_needed: bool,
    /// The log on disk.
    pub log: Option<JournalSettings>,
}

impl Part for Communicator {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let Some(node) = slot.node.clone() else {
            let words = "the communicator is the host's node itself: leave --attach out, and say \
                         --local for others to attach";
            return Err(PartError::Broken(words.to_owned()));
        };
        let news = (node.events(), node.component_events());
        let _journal = self.start_journal(&node)?;
        let component = slot.component("Communicator").live_on(slot.port)?;
        tell_place(&node, self.log.as_ref());
        let view = self.serve(&node, &component).await?;
        tokio::pin!(view);
        let told = tell(&component, news);
        tokio::select! {
            error = &mut view => Err(PartError::Broken(format!("the debug view has ended: {error}"))),
            end = told => Err(end),
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

    /// Opens the debug view, if there is to be one; the future serves it and ends with an error.
    async fn serve(
        &self,
        node: &Node,
        component: &Component,
    ) -> Result<impl Future<Output = std::io::Error> + use<>, PartError> {
        let listener = match self.debug {
            None => None,
            Some(address) => match debug::listen(address).await {
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
        if let Some(address) = listener.as_ref().and_then(|l| l.local_addr().ok()) {
            tracing::info!("debug view: ws://{address}/messages, http://{address}/tree");
        }
        let view = DebugView::new(node.clone(), component.clone(), dictionary());
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
    Dictionary::new().with_messages(messages::registry())
}

/// Tells what the node is and does.
fn tell_place(node: &Node, log: Option<&JournalSettings>) {
    let config = node.config();
    if config.routing.forward {
        tracing::info!("messages are passed on between all links");
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
        tracing::info!(
            "everything that passes is logged in {}",
            log.directory.display()
        );
    }
}

/// Tells who comes, changes and goes, until the node has stopped.
async fn tell(component: &Component, news: (Events, ComponentEvents)) -> PartError {
    let (mut events, mut arrivals) = news;
    let mut changes: Watch = component.watch();
    // A conflict is news with every message of the other; once is enough for people.
    let mut conflicts: BTreeSet<Remote> = BTreeSet::new();
    loop {
        let words = tokio::select! {
            Some(change) = changes.next() => tree::in_words(change, &component.directory()),
            Some(event) = events.recv() => match event {
                Event::IdConflict { id, path } => {
                    let is_new = conflicts.len() < MOST_CONFLICTS && conflicts.insert(path.peer);
                    is_new.then(|| format!(
                        "somebody at {} has our id {id} too: one of us must choose another",
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
