//! All services of one component behind one door.

use std::collections::{BTreeSet, VecDeque};
use std::time::Instant;

use bytes::Bytes;

use super::inquiries::Inquiries;
use super::{
    Change, Context, Directory, Discovery, Handled, Inquiry, NoAnswer, Outbox, Patience, Service,
    Standing,
};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::{Outgoing, Received};

/// A component without a network: its services, its view of the others, and its open questions.
pub struct Stack {
    discovery: Discovery,
    services: Vec<Box<dyn Service>>,
    standing: Standing,
    changed: BTreeSet<u16>,
    inquiries: Inquiries,
    out: Outbox,
    events: VecDeque<Event>,
}

/// What a component should know.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// Somebody came, changed or went.
    Change(Change),
    /// A question has been answered, or nobody will.
    Answer(Inquiry, Result<Bytes, NoAnswer>),
    /// A message that no service wanted.
    Message(Received),
}

impl Stack {
    /// A component with its discovery and what else it offers.
    #[must_use]
    pub fn new(mut discovery: Discovery, services: Vec<Box<dyn Service>>) -> Self {
        let mut out = Outbox::new(discovery.id());
        let offers = services.iter().flat_map(|service| service.offers());
        discovery.set_offers(offers, &mut out);
        Self {
            discovery,
            services,
            standing: Standing::default(),
            changed: BTreeSet::new(),
            inquiries: Inquiries::default(),
            out,
            events: VecDeque::new(),
        }
    }

    /// The component's id.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.out.source()
    }

    /// Everybody who is known.
    #[must_use]
    pub const fn directory(&self) -> &Directory {
        self.discovery.directory()
    }

    /// Begins to live: the services get their first wake-up.
    pub fn start(&mut self, now: Instant) {
        self.wake(now);
    }

    /// A message for this component has arrived.
    pub fn handle_message(&mut self, now: Instant, message: &Received) {
        self.discovery.hear(now, message.source);
        let answered = self.inquiries.handle_message(now, message, &mut self.out);
        let mut handled = self.discovery.handle_message(now, message, &mut self.out);
        for service in &mut self.services {
            if handled == Handled::Yes {
                break;
            }
            let mut context = Context::new(&mut self.out, &self.standing, &mut self.changed);
            handled = service.handle_message(now, message, &mut context);
        }
        self.collect();
        match answered {
            Some(inquiry) => {
                self.events
                    .push_back(Event::Answer(inquiry, Ok(message.payload.clone())));
            }
            None if handled == Handled::No => {
                self.events.push_back(Event::Message(message.clone()));
            }
            None => {}
        }
    }

    /// The time of [`poll_timeout`](Self::poll_timeout) has come; earlier does no harm.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.wake(now);
    }

    /// Sends a message, and forgets it.
    pub fn send<M: Message>(&mut self, destination: JausId, message: &M) {
        self.out.send(destination, message);
    }

    /// Sends octets that begin with a message code, and forgets them.
    pub fn send_octets(&mut self, destination: JausId, payload: Bytes) {
        self.out.send_octets(destination, payload);
    }

    /// Asks a peer and waits for the first message with the code `report` from it. A peer with
    /// wildcards stands for whoever answers first.
    pub fn ask(
        &mut self,
        now: Instant,
        peer: JausId,
        query: Bytes,
        report: u16,
        patience: Patience,
    ) -> Inquiry {
        self.inquiries
            .ask(now, peer, query, report, patience, &mut self.out)
    }

    /// Gives a question up.
    pub fn cancel(&mut self, now: Instant, inquiry: Inquiry) {
        self.inquiries.cancel(now, inquiry, &mut self.out);
    }

    /// Adds a service while the component runs, and tells the peers.
    pub fn offer(&mut self, now: Instant, service: Box<dyn Service>) {
        self.services.push(service);
        self.publish_offers();
        self.wake(now);
    }

    /// Takes a service back, whatever its version, and tells the peers. Says whether it was there.
    pub fn withdraw(&mut self, urn: &str) -> bool {
        let before = self.services.len();
        self.services
            .retain(|service| service.offers().iter().all(|id| id.urn != urn));
        self.publish_offers();
        self.services.len() < before
    }

    fn publish_offers(&mut self) {
        let offers = self.services.iter().flat_map(|service| service.offers());
        self.discovery.set_offers(offers, &mut self.out);
        self.collect();
    }

    /// The next message to send.
    pub fn poll_transmit(&mut self) -> Option<Outgoing> {
        self.out.pop()
    }

    /// The next thing to know.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let services = self
            .services
            .iter()
            .filter_map(|service| service.poll_timeout());
        services
            .chain(self.discovery.poll_timeout())
            .chain(self.inquiries.poll_timeout())
            .min()
    }

    fn wake(&mut self, now: Instant) {
        self.discovery.handle_timeout(now, &mut self.out);
        for service in &mut self.services {
            let mut context = Context::new(&mut self.out, &self.standing, &mut self.changed);
            service.handle_timeout(now, &mut context);
        }
        self.inquiries.handle_timeout(now, &mut self.out);
        self.collect();
    }

    fn collect(&mut self) {
        while let Some(change) = self.discovery.poll_change() {
            self.events.push_back(Event::Change(change));
        }
        while let Some((inquiry, failure)) = self.inquiries.poll_failure() {
            self.events.push_back(Event::Answer(inquiry, Err(failure)));
        }
    }
}
