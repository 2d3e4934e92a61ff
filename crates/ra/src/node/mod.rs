//! RA node: announces our subsystems to RA systems and discovers theirs.
//!
//! Each [announced](RaNode::announce) subsystem sends a heartbeat to the group every second, from
//! its communicator. The node answers queries for names, configuration and services of all its
//! components and notifies subscribers of changes. A heartbeat of an unknown subsystem starts
//! discovery, in the query order of OpenJAUS: its name from the communicator, then nodes and
//! components and a subscription to their changes, then each name and the services. A query is
//! repeated until it is answered or the attempts are used up. When no query is open, the owner
//! learns that the subsystem [appeared](Event::Appeared).
//!
//! All queries come from the node manager of our first subsystem. Without an announced subsystem
//! the node sends no queries.
//!
//! Heartbeats go to the group, so [hosts beyond multicast](super::carrier::Settings::peers) are
//! discovered by any message they send. A silent one is queried for its heartbeat pulse.
//!
//! Every other message for our components is returned as [`Event::Message`].

mod answer;
mod learn;
mod own;
mod peer;
mod settings;
mod subscriptions;
mod subsystem;
mod tell;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::net::SocketAddr;
use std::time::Instant;

use bytes::Bytes;

pub use settings::Settings;
pub use subsystem::{
    BadSubsystem, Command, RaComponentEntry, RaNodeEntry, RaServiceEntry, RaSubsystemEntry, Where,
};

use super::carrier::{Carrier, SendError, Transmit};
use super::counters::{Counter, Counters};
use super::message::Message;
use crate::messages::ra33::{
    CancelEvent, CreateEvent, QueryConfiguration, QueryHeartbeatPulse, QueryIdentification,
    QueryServices, ReportHeartbeatPulse,
};
use jaus::codec::Message as _;
use jaus::endpoint::Buckets;
use own::Own;
use peer::{Peer, Question};

/// Our presence among RA systems. See the [module](self).
#[derive(Debug)]
pub struct RaNode {
    settings: Settings,
    carrier: Carrier,
    /// Local subsystems by number, like the peers.
    own: BTreeMap<u8, Own>,
    peers: BTreeMap<u8, Peer>,
    answers: Buckets<u8>,
    questions: Buckets<u8>,
    /// Subsystems with pending notifications.
    news: BTreeSet<u8>,
    /// Subsystems reported to the owner.
    shown: BTreeSet<u8>,
    messages: VecDeque<Message>,
}

/// Notification for the owner of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A subsystem was discovered, with the names and services that it reported.
    Appeared(RaSubsystemEntry),
    /// A known subsystem reports a different configuration.
    Changed(RaSubsystemEntry),
    /// It has shut down or timed out.
    Lost(u8),
    /// A message for one or several of our components (see its destination) that the node does not
    /// handle itself.
    Message(Message),
}

impl RaNode {
    /// A node without local subsystems.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        const ALL: usize = 256;
        Self {
            carrier: Carrier::new(settings.carrier.clone()),
            own: BTreeMap::new(),
            peers: BTreeMap::new(),
            answers: Buckets::new(settings.answers, ALL),
            questions: Buckets::new(settings.questions, ALL),
            news: BTreeSet::new(),
            shown: BTreeSet::new(),
            messages: VecDeque::new(),
            settings,
        }
    }

    /// Processes a received datagram.
    pub fn handle_datagram(&mut self, now: Instant, from: SocketAddr, datagram: Bytes) {
        let is_out_of_reach = self.settings.carrier.peers.contains(&from.ip());
        for message in self.carrier.handle_datagram(now, from, datagram) {
            if is_out_of_reach && !self.peers.contains_key(&message.source.subsystem) {
                self.handle_heartbeat(now, message.source);
            }
            self.handle_message(now, message);
        }
    }

    fn handle_message(&mut self, now: Instant, message: Message) {
        if let Some(peer) = self.peers.get_mut(&message.source.subsystem) {
            peer.heard = now;
        }
        let handled = match message.code {
            ReportHeartbeatPulse::CODE => {
                self.handle_heartbeat(now, message.source);
                true
            }
            QueryIdentification::CODE
            | QueryConfiguration::CODE
            | QueryServices::CODE
            | QueryHeartbeatPulse::CODE => {
                self.answer(now, &message);
                true
            }
            CreateEvent::CODE => self.handle_create_event(now, &message),
            CancelEvent::CODE => self.handle_cancel_event(&message),
            _ => self.handle_report(now, &message),
        };
        if handled {
            return;
        }
        if self.messages.len() >= self.settings.queue_limit {
            self.carrier.count(Counter::EventQueueFull);
            return;
        }
        self.messages.push_back(message);
    }

    /// Runs due timers. Call it when [`poll_timeout`](Self::poll_timeout) is reached.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.carrier.handle_timeout(now);
        let due = self.peers.iter().filter(|(_, peer)| peer.next <= now);
        let due: Vec<_> = due.map(|(&subsystem, _)| subsystem).collect();
        for subsystem in due {
            self.serve(now, subsystem);
        }
        let own: Vec<_> = self.own.keys().copied().collect();
        for subsystem in own {
            self.heartbeat(now, subsystem);
            self.tell_changes(now, subsystem);
        }
    }

    /// Announces a subsystem, or its changed configuration. Missing node managers (1.1 in each
    /// node) and a missing communicator (35.1 in the first node) are added; the node answers for
    /// them.
    ///
    /// # Errors
    /// Invalid or duplicate ids, more than fits the messages, or a subsystem number in use by a
    /// peer.
    pub fn announce(
        &mut self,
        now: Instant,
        subsystem: RaSubsystemEntry,
    ) -> Result<(), BadSubsystem> {
        let subsystem = own::complete(subsystem)?;
        let id = subsystem.id;
        if self.peers.contains_key(&id) {
            let at = self.carrier.address(id).map(|address| address.ip());
            return Err(BadSubsystem::Taken(id, Where(at)));
        }
        match self.own.get_mut(&id) {
            Some(own) if own.subsystem == subsystem => return Ok(()),
            Some(own) => {
                own.subsystem = subsystem;
                own.tell.get_or_insert(now + self.settings.gather);
            }
            None => {
                self.own.insert(id, Own::new(now, subsystem));
            }
        }
        if let Some(own) = self.own.get(&id) {
            self.carrier.set_components(id, own.ids());
        }
        self.heartbeat(now, id);
        for peer in self.peers.values_mut() {
            peer.next = now;
        }
        Ok(())
    }

    /// Withdraws a subsystem and notifies the peers.
    pub fn withdraw(&mut self, now: Instant, subsystem: u8) {
        let asker = self.asker();
        self.tell_all(subsystem, true);
        self.own.remove(&subsystem);
        self.carrier.set_components(subsystem, []);
        if asker == self.asker() {
            return;
        }
        let peers: Vec<_> = self.peers.keys().copied().collect();
        for id in peers {
            if let Some(peer) = self.peers.get_mut(&id) {
                peer.subscribed = false;
                peer.wonder(now, Question::Subscription);
            }
            self.serve(now, id);
        }
    }

    /// Sends a message of one of our components. Its sequence number is kept, except for large
    /// messages.
    ///
    /// # Errors
    /// A foreign source, a destination without known address, too much data, or a full transmit
    /// queue.
    pub fn send(&mut self, now: Instant, message: &Message) -> Result<(), SendError> {
        self.carrier.send(message)?;
        self.carrier.settle(now);
        Ok(())
    }

    /// The next outgoing datagram.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        self.carrier.poll_transmit()
    }

    /// The next event: subsystem changes before messages.
    pub fn poll_event(&mut self) -> Option<Event> {
        while let Some(id) = self.news.pop_first() {
            let was_shown = self.shown.contains(&id);
            let peer = self.peers.get(&id).filter(|peer| peer.configured);
            let settled = peer.filter(|peer| was_shown || peer.is_settled());
            match settled {
                Some(peer) if was_shown => return Some(Event::Changed(peer.subsystem.clone())),
                Some(peer) => {
                    self.shown.insert(id);
                    return Some(Event::Appeared(peer.subsystem.clone()));
                }
                None if self.shown.remove(&id) => return Some(Event::Lost(id)),
                None => {}
            }
        }
        self.messages.pop_front().map(Event::Message)
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let own = self.own.values();
        let own = own.flat_map(|own| [Some(own.next_heartbeat), own.tell]);
        let peers = self.peers.values().map(|peer| Some(peer.next));
        let all = own.chain(peers).chain([self.carrier.poll_timeout()]);
        all.flatten().min()
    }

    /// Counters of traffic and drops.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        self.carrier.counters()
    }

    /// The datagram layer, with peer addresses.
    #[must_use]
    pub const fn carrier(&self) -> &Carrier {
        &self.carrier
    }

    /// The settings.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The RA subsystems present, ordered by number, with what is known of them so far.
    pub fn subsystems(&self) -> impl Iterator<Item = &RaSubsystemEntry> + '_ {
        self.peers.values().map(|peer| &peer.subsystem)
    }

    /// Time of the last message of an RA subsystem; `None` if it is unknown.
    #[must_use]
    pub fn heard(&self, subsystem: u8) -> Option<Instant> {
        self.peers.get(&subsystem).map(|peer| peer.heard)
    }

    /// Our subsystems, including node managers and communicators.
    pub fn own(&self) -> impl Iterator<Item = &RaSubsystemEntry> + '_ {
        self.own.values().map(|own| &own.subsystem)
    }
}
