//! Service connections: periodic reports of the Reference Architecture.
//!
//! A client creates a connection (0008h) to a report of a provider at a rate; the provider confirms
//! it (0009h) with an instance number and then sends the report at that rate, marked as service
//! connection data and numbered from 0. The client may suspend (000Bh), activate (000Ah) and
//! terminate it (000Ch).
//!
//! [`Connections`] implements provider and client for all components of a node, independent of the
//! content of reports. It sends through [`RaNode::send`](super::node::RaNode::send); every message
//! from the node goes through [`Connections::handle_message`] first.
//!
//! * As a provider, the owner gets [requests](Event::Wanted), accepts or refuses them, and
//!   [sets the report](Connections::set_report); the latest report is repeated at the rate, because
//!   clients treat silence as a loss.
//! * As a client, it repeats requests until they are answered, and recreates a connection after a
//!   silence. Reports do not identify their connection, so there can be only one per report between
//!   two components.

mod client;
mod provider;
mod settings;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

pub use crate::messages::ra33::confirm_service_connection::ResponseCode;
pub use settings::Settings;

use super::RaId;
use super::counters::{Counter, Counters};
use super::message::Message;
use crate::messages::ra33::{
    ActivateServiceConnection, ConfirmServiceConnection, CreateServiceConnection,
    SuspendServiceConnection, TerminateServiceConnection,
};
use client::Wanted;
use jaus::codec::{self, Message as _};
use jaus::endpoint::{Buckets, Rate};
use provider::Provided;

/// Provider and client side of a node's service connections. See the [module](self).
#[derive(Debug)]
pub struct Connections {
    settings: Settings,
    provided: BTreeMap<ConnectionId, Provided>,
    wanted: BTreeMap<ConnectionId, Wanted>,
    created: u64,
    /// Rate limit of terminations of unknown reports.
    terminations: Buckets<(RaId, u16)>,
    transmits: VecDeque<Message>,
    events: VecDeque<Event>,
    counters: Counters,
}

/// Identifies a connection; never reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ConnectionId(u64);

/// Parameters of a connection: the report and its rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Sender of the report.
    pub provider: RaId,
    /// Receiver of the report.
    pub client: RaId,
    /// The code of the report.
    pub code: u16,
    /// Presence vector of the requested fields.
    pub presence: u32,
    /// Rate in hertz: above 0, up to 1092.
    pub rate: f64,
}

/// Notification for the owner of the connections.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A client requests a report of ours, or another rate: [accept](Connections::accept) or
    /// [refuse](Connections::refuse) it.
    Wanted(ConnectionId, Request),
    /// The client has ended the connection to our report, or the provider has ended ours.
    Ended(ConnectionId),
    /// A provider has accepted at this rate, in hertz.
    Established(ConnectionId, f64),
    /// A provider has refused; the connection is forgotten.
    Refused(ConnectionId, ResponseCode),
    /// A report has arrived.
    Report(ConnectionId, Message),
    /// A provider is silent. The connection is being recreated.
    Silent(ConnectionId),
}

/// Reason why no connection was created.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CannotConnect {
    /// A connection between the same two for the same report exists.
    #[error("there is a connection for this report between these two already: end it first")]
    Exists(ConnectionId),
    /// The rate is invalid.
    #[error("the rate is out of range: use more than 0 and at most 1092 hertz")]
    Rate,
    /// Too many connections.
    #[error("there are {0} connections already: end one, or raise the limit")]
    Full(usize),
}

impl Connections {
    /// The highest rate that the messages can encode, in hertz.
    pub const MAX_RATE: f64 = 1092.0;

    /// Creates an empty set of connections.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            provided: BTreeMap::new(),
            wanted: BTreeMap::new(),
            created: 0,
            terminations: Buckets::new(Rate::new(1, 1), settings.max_wanted),
            transmits: VecDeque::new(),
            events: VecDeque::new(),
            counters: Counters::default(),
            settings,
        }
    }

    /// Processes messages about service connections; returns whether the message was one.
    pub fn handle_message(&mut self, now: Instant, message: &Message) -> bool {
        let understood = match message.code {
            CreateServiceConnection::CODE => self.handle_create(now, message),
            ConfirmServiceConnection::CODE => self.handle_confirm(now, message),
            ActivateServiceConnection::CODE => self.handle_activate(now, message),
            SuspendServiceConnection::CODE => self.handle_suspend(message),
            TerminateServiceConnection::CODE => self.handle_terminate(message),
            _ if message.connection => {
                self.handle_report(now, message);
                Ok(())
            }
            _ => return false,
        };
        if let Err(error) = understood {
            tracing::debug!(?message, %error, "not understood");
            self.counters.add(Counter::Malformed);
        }
        true
    }

    /// Runs due timers. Call it when [`poll_timeout`](Self::poll_timeout) is reached.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.report_due(now);
        self.watch(now);
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let provided = self.provided.values().filter_map(Provided::due);
        let wanted = self.wanted.values().map(|wanted| wanted.next);
        provided.chain(wanted).min()
    }

    /// The next outgoing message.
    pub fn poll_transmit(&mut self) -> Option<Message> {
        self.transmits.pop_front()
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Ends a connection and notifies the other side.
    pub fn end(&mut self, id: ConnectionId) {
        if let Some(provided) = self.provided.remove(&id) {
            let (from, to) = (provided.request.provider, provided.request.client);
            self.terminate(from, to, provided.request.code, provided.instance);
        }
        if let Some(wanted) = self.wanted.remove(&id)
            && let Some(instance) = wanted.instance
        {
            let (from, to) = (wanted.request.client, wanted.request.provider);
            self.terminate(from, to, wanted.request.code, instance);
        }
    }

    /// Removes the connections with components for which `is_there` is false.
    pub fn forget(&mut self, is_there: impl Fn(RaId) -> bool) {
        let clients = self.provided.iter();
        let clients = clients.filter(|(_, provided)| !is_there(provided.request.client));
        let providers = self.wanted.iter();
        let providers = providers.filter(|(_, wanted)| !is_there(wanted.request.provider));
        let gone = clients.map(|(&id, _)| id);
        let gone: Vec<_> = gone.chain(providers.map(|(&id, _)| id)).collect();
        for id in gone {
            self.provided.remove(&id);
            self.wanted.remove(&id);
            self.tell(Event::Ended(id));
        }
    }

    /// Counters of events and drops.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Number of connections, as provider and as client.
    #[must_use]
    pub fn len(&self) -> (usize, usize) {
        (self.provided.len(), self.wanted.len())
    }

    fn next_id(&mut self) -> ConnectionId {
        self.created += 1;
        ConnectionId(self.created)
    }

    fn terminate(&mut self, from: RaId, to: RaId, command_code: u16, instance_id: u8) {
        let body = TerminateServiceConnection {
            command_code,
            instance_id,
        };
        self.transmit(Message::with_body(from, to, &body));
    }

    fn transmit(&mut self, message: Result<Message, codec::EncodeError>) {
        let Ok(message) = message else { return };
        if self.transmits.len() >= self.settings.queue_limit {
            self.counters.add(Counter::TransmitQueueFull);
            return;
        }
        self.transmits.push_back(message);
    }

    /// Queues an event for the owner. Reports may use only half of the queue.
    fn tell(&mut self, event: Event) {
        let limit = self.settings.queue_limit;
        let room = match event {
            Event::Report(..) => limit,
            _ => limit.saturating_mul(2),
        };
        if self.events.len() >= room {
            self.counters.add(Counter::EventQueueFull);
            return;
        }
        self.events.push_back(event);
    }
}

/// The period of a rate in hertz.
fn period(rate: f64) -> Duration {
    Duration::from_secs_f64(1.0 / rate.clamp(0.01, Connections::MAX_RATE))
}
