//! What services want to say, until somebody sends it.

use std::collections::VecDeque;

use bytes::Bytes;

use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::{Outgoing, Received};
use crate::wire::{Broadcast, Priority};

/// Messages of one component on their way out.
#[derive(Debug)]
pub struct Outbox {
    source: JausId,
    queue: VecDeque<Outgoing>,
}

impl Outbox {
    /// An empty outbox of a component.
    #[must_use]
    pub const fn new(source: JausId) -> Self {
        Self {
            source,
            queue: VecDeque::new(),
        }
    }

    /// The component whose messages these are.
    #[must_use]
    pub const fn source(&self) -> JausId {
        self.source
    }

    /// Sends a message to one component.
    pub fn send<M: Message>(&mut self, destination: JausId, message: &M) {
        self.push(
            destination,
            Broadcast::None,
            Priority::Standard,
            false,
            message,
        );
    }

    /// Sends a message to one component with a priority, until its node acknowledges it.
    pub fn send_acknowledged<M: Message>(
        &mut self,
        destination: JausId,
        priority: Priority,
        message: &M,
    ) {
        self.push(destination, Broadcast::None, priority, true, message);
    }

    /// Answers a message: to its sender alone, however many it went to, with its priority.
    pub fn reply<M: Message>(&mut self, to: &Received, message: &M) {
        self.push(to.source, Broadcast::None, to.priority, false, message);
    }

    /// The same, until the receiver has acknowledged it: for answers of many datagrams, of which one
    /// that is lost would cost all.
    pub fn reply_until_acknowledged<M: Message>(&mut self, to: &Received, message: &M) {
        self.push(to.source, Broadcast::None, to.priority, true, message);
    }

    /// Sends a message to every component of every subsystem.
    pub fn broadcast<M: Message>(&mut self, message: &M) {
        self.push(
            JausId::EVERYONE,
            Broadcast::Global,
            Priority::Standard,
            false,
            message,
        );
    }

    /// Sends a message to every component of the own subsystem.
    pub fn broadcast_local<M: Message>(&mut self, message: &M) {
        self.push(
            self.source.whole_subsystem(),
            Broadcast::Local,
            Priority::Standard,
            false,
            message,
        );
    }

    /// Sends octets that begin with a message code.
    pub fn send_octets(&mut self, destination: JausId, payload: Bytes) {
        self.queue.push_back(Outgoing {
            source: self.source,
            destination,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            acknowledge: false,
            payload,
        });
    }

    /// The next message to send.
    pub fn pop(&mut self) -> Option<Outgoing> {
        self.queue.pop_front()
    }

    fn push<M: Message>(
        &mut self,
        destination: JausId,
        broadcast: Broadcast,
        priority: Priority,
        acknowledge: bool,
        message: &M,
    ) {
        match message.encode() {
            Ok(payload) => self.queue.push_back(Outgoing {
                source: self.source,
                destination,
                priority,
                broadcast,
                acknowledge,
                payload,
            }),
            // A service built a message with more elements than its count can say.
            Err(error) => tracing::error!(%destination, %error, "message cannot be sent"),
        }
    }
}
