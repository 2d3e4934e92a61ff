//! The outgoing messages of one component, queued until its driver sends them.

use std::collections::VecDeque;

use bytes::Bytes;

use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::{Outgoing, Received};
use crate::wire::{Broadcast, Priority};

/// Outgoing messages of one component.
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

    /// The component that sends these messages.
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

    /// Sends a message with a priority to one component.
    pub fn send_with<M: Message>(&mut self, destination: JausId, priority: Priority, message: &M) {
        self.push(destination, Broadcast::None, priority, false, message);
    }

    /// Sends a message with a priority to one component, with retransmission until its node
    /// acknowledges.
    pub fn send_acknowledged<M: Message>(
        &mut self,
        destination: JausId,
        priority: Priority,
        message: &M,
    ) {
        self.push(destination, Broadcast::None, priority, true, message);
    }

    /// Replies to the sender of a message alone, even to a broadcast, with the message's priority.
    pub fn reply<M: Message>(&mut self, to: &Received, message: &M) {
        self.push(to.source, Broadcast::None, to.priority, false, message);
    }

    /// Like [`reply`](Self::reply), with retransmission until the receiver acknowledges. For
    /// replies of many datagrams: the loss of one datagram would lose the whole reply.
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
        self.send_octets_with(destination, Priority::Standard, payload);
    }

    /// Sends octets that begin with a message code, with a priority.
    pub fn send_octets_with(&mut self, destination: JausId, priority: Priority, payload: Bytes) {
        self.queue.push_back(Outgoing {
            source: self.source,
            destination,
            priority,
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
            // A service built a message with more elements than its count field can hold.
            Err(error) => tracing::error!(%destination, %error, "cannot send the message"),
        }
    }
}
