//! Service connections: the Reference Architecture's way to be told something regularly.
//!
//! A client creates a connection (0008h) to a report of a provider at a rate; the provider
//! confirms it (0009h) under an instance number and sends the report at that rate from then on,
//! marked as of a service connection and numbered from 0. The client may suspend (000Bh),
//! activate (000Ah) and terminate it (000Ch).
//!
//! [`Connections`] plays both parts for all components of a node, without knowing what reports
//! mean. What it sends goes through [`RaNode::send`](super::node::RaNode::send); what the node gives
//! out goes through [`Connections::handle_message`] first.
//!
//! * As a provider the owner is told what is [wanted](Event::Wanted), accepts or refuses it, and
//!   says [what the report is now](Connections::set_report); the latest is sent at the rate, again
//!   and again, because clients take silence for a loss.
//! * As a client it asks again until there is an answer, watches for silence, and creates the
//!   connection anew then. Reports do not name their connection, so that there can be one for each
//!   report between the same two.

mod client;
mod provider;
mod settings;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

pub use crate::messages::ra33::confirm_service_connection::ResponseCode;
pub use settings::Settings;

use super::{Counter, Counters, Message, RaId};
use crate::messages::ra33::{
    ActivateServiceConnection, ConfirmServiceConnection, CreateServiceConnection,
    SuspendServiceConnection, TerminateServiceConnection,
};
use client::Wanted;
use jaus::codec::{self, Message as _};
use jaus::endpoint::{Buckets, Rate};
use provider::Provided;

/// The service connections of a node, in both parts. See the [module](self).
#[derive(Debug)]
pub struct Connections {
    settings: Settings,
    provided: BTreeMap<ConnectionId, Provided>,
    wanted: BTreeMap<ConnectionId, Wanted>,
    created: u64,
    /// For telling senders of unwanted reports to stop.
    terminations: Buckets<(RaId, u16)>,
    transmits: VecDeque<Message>,
    events: VecDeque<Event>,
    counters: Counters,
}

/// Names a connection; never given twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ConnectionId(u64);

/// What somebody wants to be told, and how often.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Who reports.
    pub provider: RaId,
    /// Who is reported to.
    pub client: RaId,
    /// The code of the report.
    pub code: u16,
    /// Which of its optional fields.
    pub presence: u32,
    /// How often, in hertz: above 0, up to 1092.
    pub rate: f64,
}

/// What the owner of connections is to know.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Somebody wants a report of ours, or wants it at another rate: to be
    /// [accepted](Connections::accept) or [refused](Connections::refuse).
    Wanted(ConnectionId, Request),
    /// Our report is not wanted any more, or the provider of one of others has ended it.
    Ended(ConnectionId),
    /// A provider has accepted at this rate, in hertz.
    Established(ConnectionId, f64),
    /// A provider has refused; the connection is forgotten.
    Refused(ConnectionId, ResponseCode),
    /// A report has come.
    Report(ConnectionId, Message),
    /// A provider has been silent for too long. The connection is being created anew.
    Silent(ConnectionId),
}

/// Why no connection was created.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CannotConnect {
    /// There is one between the same two for the same report already.
    #[error("there is a connection for this report between these two already: end it first")]
    Exists(ConnectionId),
    /// The rate is none.
    #[error("the rate is out of range: use more than 0 and at most 1092 hertz")]
    Rate,
    /// There are too many.
    #[error("there are {0} connections already: end one, or raise the limit")]
    Full(usize),
}

impl Connections {
    /// The highest rate that a message can state, in hertz.
    pub const MAX_RATE: f64 = 1092.0;

    /// No connections yet.
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

    /// Takes in what is about service connections; says whether the message was.
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

    /// Time has passed. Call it when [`poll_timeout`](Self::poll_timeout) is reached.
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

    /// The next message to be sent.
    pub fn poll_transmit(&mut self) -> Option<Message> {
        self.transmits.pop_front()
    }

    /// The next thing to know.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Ends a connection, and tells the other side.
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

    /// Forgets the connections with components that are gone: `is_there` says who is not.
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

    /// What was seen and thrown away.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// How many connections there are, as a provider and as a client.
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

    /// Puts an event behind what waits for the owner. Reports leave half of the room to the others.
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

/// The time between two reports at a rate in hertz.
fn period(rate: f64) -> Duration {
    Duration::from_secs_f64(1.0 / rate.clamp(0.01, Connections::MAX_RATE))
}
