//! An endpoint with a store for delivered messages, like a node's mailboxes.

use std::collections::{BTreeMap, VecDeque};
use std::ops::{Deref, DerefMut};
use std::time::Instant;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{self, Endpoint, Ingress, MessageHandle, Outgoing, Received, SendError, Sink};
use jaus::wire::Priority;

/// Limit of waiting messages per priority.
const ROOM: usize = 1024;

/// An endpoint's output for its owner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A message for a component.
    Received(Received),
    /// Any other event of the endpoint.
    News(endpoint::Event),
}

/// An endpoint with a queue of delivered messages for its owner.
#[derive(Debug)]
pub struct OwnedEndpoint {
    endpoint: Endpoint,
    inbox: Inbox,
}

#[derive(Debug, Default)]
struct Inbox {
    /// By priority.
    waiting: [VecDeque<Received>; Priority::ALL.len()],
    /// When a part of an unfinished message last arrived, by source and destination.
    parts: BTreeMap<(JausId, JausId), Instant>,
}

impl Sink for Inbox {
    fn has_room(&self, _: JausId, priority: Priority) -> bool {
        self.waiting[usize::from(priority.bits())].len() < ROOM / 2
    }

    /// The second half of the queue is for messages that cannot be refused. When it is full too,
    /// the oldest message is dropped.
    fn deliver(&mut self, message: Received) {
        let waiting = &mut self.waiting[usize::from(message.priority.bits())];
        waiting.push_back(message);
        if waiting.len() > ROOM {
            waiting.pop_front();
        }
    }

    fn progress(&mut self, now: Instant, source: JausId, to: JausId) {
        self.parts.insert((source, to), now);
    }
}

impl OwnedEndpoint {
    pub fn new(endpoint: Endpoint) -> Self {
        Self {
            endpoint,
            inbox: Inbox::default(),
        }
    }

    pub fn send(&mut self, now: Instant, message: Outgoing) -> Result<MessageHandle, SendError> {
        self.endpoint.send(now, message, &mut self.inbox)
    }

    pub fn handle_datagram(&mut self, now: Instant, from: impl Into<Ingress>, datagram: Bytes) {
        self.endpoint
            .handle_datagram(now, from, datagram, &mut self.inbox);
    }

    /// When a part of a large message last arrived.
    pub fn last_fragment(&self, source: JausId, to: JausId) -> Option<Instant> {
        self.inbox.parts.get(&(source, to)).copied()
    }

    /// The owner's next event: the endpoint's own events first, then the most urgent message.
    pub fn poll_event(&mut self) -> Option<Event> {
        let news = self.endpoint.poll_event().map(Event::News);
        news.or_else(|| {
            let mut most_urgent_first = self.inbox.waiting.iter_mut().rev();
            let message = most_urgent_first.find_map(VecDeque::pop_front);
            message.map(Event::Received)
        })
    }
}

impl Deref for OwnedEndpoint {
    type Target = Endpoint;

    fn deref(&self) -> &Endpoint {
        &self.endpoint
    }
}

impl DerefMut for OwnedEndpoint {
    fn deref_mut(&mut self) -> &mut Endpoint {
        &mut self.endpoint
    }
}
