//! Our presence among RA systems: what we show to them, and what they show to us.

mod settings;
mod subsystem;

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::time::Instant;

use bytes::Bytes;

pub use settings::Settings;
pub use subsystem::{BadSubsystem, Command, Component, Node, Service, Subsystem};

use super::carrier::{SendError, Transmit};
use super::{Counters, Message};

/// Our presence among RA systems. See the [module](self).
#[derive(Debug)]
pub struct RaNode {
    settings: Settings,
    own: BTreeMap<u8, Subsystem>,
    events: VecDeque<Event>,
    transmits: VecDeque<Transmit>,
    counters: Counters,
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
        Self {
            settings,
            own: BTreeMap::new(),
            events: VecDeque::new(),
            transmits: VecDeque::new(),
            counters: Counters::default(),
        }
    }

    /// A datagram has come.
    pub fn handle_datagram(&mut self, _now: Instant, _from: SocketAddr, _datagram: Bytes) {}

    /// Time has passed. Call it when [`poll_timeout`](Self::poll_timeout) is reached.
    pub fn handle_timeout(&mut self, _now: Instant) {}

    /// Shows a subsystem, or tells that something about it has changed. Node managers (1.1 in each
    /// node) and the communicator (35.1 in the first) are added where they are missing, and
    /// answer by themselves.
    ///
    /// # Errors
    /// Ids that are none or twice there, more than fits the messages, or a subsystem that others
    /// speak for.
    pub fn announce(&mut self, _now: Instant, subsystem: Subsystem) -> Result<(), BadSubsystem> {
        self.own.insert(subsystem.id, subsystem);
        Ok(())
    }

    /// Shows a subsystem no more, and says so.
    pub fn withdraw(&mut self, _now: Instant, subsystem: u8) {
        self.own.remove(&subsystem);
    }

    /// Sends a message of a component that we show. Its number is given by the node.
    ///
    /// # Errors
    /// A source that is not ours, a destination whose address is not known, too much data, or too
    /// much to send at once.
    pub fn send(&mut self, _now: Instant, message: Message) -> Result<(), SendError> {
        Err(SendError::Unknown(message.destination.subsystem))
    }

    /// The next datagram to be sent.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        self.transmits.pop_front()
    }

    /// The next thing to know.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        None
    }

    /// What was seen, done and thrown away.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The settings.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The RA subsystems that are there now, in order of their numbers.
    pub fn subsystems(&self) -> impl Iterator<Item = &Subsystem> + '_ {
        std::iter::empty()
    }
}
