//! Our presence among RA systems: what we show to them, and what they show to us.
//!
//! Each subsystem that is [announced](RaNode::announce) sends a heartbeat to the group, each second
//! and from its communicator; names, configuration and services are answered for all of its
//! components; who asked for it is told of changes. The other way round, a subsystem whose
//! heartbeat is heard is asked what it is, in the order in which OpenJAUS asks: its name at the
//! communicator, then nodes and components and to be told of their changes, then each name and the
//! services. What was asked is asked again until it is answered or was asked often enough. When all
//! is answered, the owner is told that the subsystem [appeared](Event::Appeared).
//!
//! All questions come from the node manager of our first subsystem. While we show nothing, nobody is
//! asked.
//!
//! [Hosts that multicast does not reach](super::carrier::Settings::peers) are heard by whatever they
//! send, for their heartbeats go to the group: while nothing comes from one, it is asked for its
//! pulse.
//!
//! Everything else that is for a component of ours comes out as [`Event::Message`].

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
pub use subsystem::{BadSubsystem, Command, Component, Node, Service, Subsystem, Where};

use super::carrier::{Carrier, SendError, Transmit};
use super::{Counter, Counters, Message};
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
    /// By number, like the peers.
    own: BTreeMap<u8, Own>,
    peers: BTreeMap<u8, Peer>,
    answers: Buckets<u8>,
    questions: Buckets<u8>,
    /// Subsystems about which there is news.
    news: BTreeSet<u8>,
    /// Those that the owner was told of.
    shown: BTreeSet<u8>,
    messages: VecDeque<Message>,
}

/// What the owner of a node is to know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A subsystem is there, and has said what it is and what is in it: names and services as far
    /// as it answered.
    Appeared(Subsystem),
    /// It says other things than before.
    Changed(Subsystem),
    /// It has said goodbye, or nothing for too long.
    Lost(u8),
    /// A message for one of our components, or for several of them (its destination tells), that
    /// the node does not answer itself.
    Message(Message),
}

impl RaNode {
    /// A node that shows nothing yet.
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

    /// A datagram has come.
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

    /// Time has passed. Call it when [`poll_timeout`](Self::poll_timeout) is reached.
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

    /// Shows a subsystem, or tells that something about it has changed. Node managers (1.1 in each
    /// node) and the communicator (35.1 in the first) are added where they are missing, and
    /// answer by themselves.
    ///
    /// # Errors
    /// Ids that are none or twice there, more than fits the messages, or a subsystem that others
    /// speak for.
    pub fn announce(&mut self, now: Instant, subsystem: Subsystem) -> Result<(), BadSubsystem> {
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

    /// Shows a subsystem no more, and says so.
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

    /// Sends a message of a component that we show. Its number is kept, but for large messages.
    ///
    /// # Errors
    /// A source that is not ours, a destination whose address is not known, too much data, or too
    /// much to send at once.
    pub fn send(&mut self, now: Instant, message: &Message) -> Result<(), SendError> {
        self.carrier.send(message)?;
        self.carrier.settle(now);
        Ok(())
    }

    /// The next datagram to be sent.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        self.carrier.poll_transmit()
    }

    /// The next thing to know: who came and went before what was said.
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

    /// What was seen, done and thrown away.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        self.carrier.counters()
    }

    /// How datagrams are read and written, and where others are.
    #[must_use]
    pub const fn carrier(&self) -> &Carrier {
        &self.carrier
    }

    /// The settings.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The RA subsystems that are heard now, in order of their numbers, with what they have told so
    /// far.
    pub fn subsystems(&self) -> impl Iterator<Item = &Subsystem> + '_ {
        self.peers.values().map(|peer| &peer.subsystem)
    }

    /// When anything of an RA subsystem was heard last; `None` if it is not known now.
    #[must_use]
    pub fn heard(&self, subsystem: u8) -> Option<Instant> {
        self.peers.get(&subsystem).map(|peer| peer.heard)
    }

    /// What we show, node managers and communicators included.
    pub fn own(&self) -> impl Iterator<Item = &Subsystem> + '_ {
        self.own.values().map(|own| &own.subsystem)
    }
}
