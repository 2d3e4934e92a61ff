//! Service connections of remote clients to our reports.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::{ConnectionId, Connections, Event, Request, ResponseCode, period};
use crate::counters::Counter;
use crate::message::Message;
use crate::messages::ra33::confirm_service_connection::ConfirmedPeriodicUpdateRate;
use crate::messages::ra33::{
    ActivateServiceConnection, ConfirmServiceConnection, CreateServiceConnection,
    SuspendServiceConnection, TerminateServiceConnection,
};
use jaus::codec::DecodeError;

/// A service connection of a remote client to a report of ours.
#[derive(Debug)]
pub(super) struct Provided {
    pub(super) request: Request,
    pub(super) instance: u8,
    priority: u8,
    /// The period between reports, once accepted.
    period: Option<Duration>,
    active: bool,
    report: Option<Bytes>,
    sequence: u16,
    next: Instant,
}

impl Provided {
    /// When the next report is due.
    pub(super) fn due(&self) -> Option<Instant> {
        let sends = self.active && self.report.is_some() && self.period.is_some();
        sends.then_some(self.next)
    }

    /// Takes the report if it is due.
    fn take_report(&mut self, now: Instant) -> Option<Message> {
        if self.due()? > now {
            return None;
        }
        let period = self.period?;
        // Keeps the phase, unless a whole period was missed.
        self.next = (self.next + period).max(now + period / 2);
        let sequence = self.sequence;
        self.sequence = self.sequence.wrapping_add(1);
        Some(Message {
            connection: true,
            priority: self.priority,
            sequence,
            ..Message::new(
                self.request.provider,
                self.request.client,
                self.request.code,
                self.report.clone()?,
            )
        })
    }
}

impl Connections {
    /// Handles Create Service Connection. A request for the same fields updates the existing
    /// connection, possibly at another rate; other fields create a new connection with the lowest
    /// free instance number, as in OpenJAUS.
    pub(super) fn handle_create(
        &mut self,
        now: Instant,
        message: &Message,
    ) -> Result<(), DecodeError> {
        let body: CreateServiceConnection = message.body()?;
        let request = Request {
            provider: message.destination,
            client: message.source,
            code: body.command_code,
            presence: body.presence_vector,
            rate: body.requested_periodic_update_rate.value(),
        };
        if request.provider.require_one().is_err() {
            self.counters.add(Counter::InvalidDestination);
            return Ok(());
        }
        if request.rate <= 0.0 {
            self.confirm(&request, 0, 0.0, ResponseCode::INVALID_PARAMETER);
            return Ok(());
        }
        let known = self.provided.iter_mut().find(|(_, known)| {
            let known = Request {
                rate: request.rate,
                ..known.request
            };
            known == request
        });
        if let Some((&id, known)) = known {
            known.active = true;
            let confirmed = known.period.filter(|_| known.request.rate == request.rate);
            known.request = request;
            match confirmed {
                Some(period) => {
                    let (instance, rate) = (known.instance, period.as_secs_f64().recip());
                    self.confirm(&request, instance, rate, ResponseCode::SUCCESSFUL);
                }
                None => self.tell(Event::Wanted(id, request)),
            }
            return Ok(());
        }
        let Some(instance) = self.free_instance(&request) else {
            self.confirm(&request, 0, 0.0, ResponseCode::CONNECTION_REFUSED);
            return Ok(());
        };
        let id = self.next_id();
        let provided = Provided {
            request,
            instance,
            priority: message.priority,
            period: None,
            active: true,
            report: None,
            sequence: 0,
            next: now,
        };
        self.provided.insert(id, provided);
        self.tell(Event::Wanted(id, request));
        Ok(())
    }

    fn free_instance(&self, request: &Request) -> Option<u8> {
        if self.provided.len() >= self.settings.max_provided {
            return None;
        }
        let same = |known: &Request| {
            (known.provider, known.client, known.code)
                == (request.provider, request.client, request.code)
        };
        let taken = self.provided.values().filter(|known| same(&known.request));
        let taken: Vec<_> = taken.map(|known| known.instance).collect();
        (0..=u8::MAX).find(|instance| !taken.contains(instance))
    }

    /// Accepts a request at the requested rate, limited to the maximum. Returns the rate in hertz;
    /// `None` if the request no longer exists.
    pub fn accept(&mut self, now: Instant, id: ConnectionId) -> Option<f64> {
        let max_rate = self.settings.max_rate;
        let provided = self.provided.get_mut(&id)?;
        let request = provided.request;
        let rate = request.rate.min(max_rate);
        provided.period = Some(period(rate));
        provided.next = now;
        let instance = provided.instance;
        self.confirm(&request, instance, rate, ResponseCode::SUCCESSFUL);
        self.report_due(now);
        Some(rate)
    }

    /// Refuses and removes a request.
    pub fn refuse(&mut self, id: ConnectionId, why: ResponseCode) {
        if let Some(provided) = self.provided.remove(&id) {
            self.confirm(&provided.request, 0, 0.0, why);
        }
    }

    fn confirm(&mut self, request: &Request, instance: u8, rate: f64, response: ResponseCode) {
        if response != ResponseCode::SUCCESSFUL {
            self.counters.add(Counter::ConnectionRefused);
        }
        let rate = rate.clamp(0.0, Self::MAX_RATE);
        let rate = ConfirmedPeriodicUpdateRate::new(rate).unwrap_or_default();
        let body = ConfirmServiceConnection {
            command_code: request.code,
            instance_id: instance,
            confirmed_periodic_update_rate: rate,
            response_code: response,
        };
        self.transmit(Message::with_body(request.provider, request.client, &body));
    }

    /// Sets the report: data with the fields of [`Request::presence`]. It is sent at once if the
    /// period has passed, and then repeated every period until it is replaced.
    pub fn set_report(&mut self, now: Instant, id: ConnectionId, data: Bytes) {
        let Some(provided) = self.provided.get_mut(&id) else {
            return;
        };
        if provided.report.is_none() {
            provided.next = provided.next.max(now);
        }
        provided.report = Some(data);
        self.report_due(now);
    }

    /// Clears the report; nothing is sent until it is set again.
    pub fn clear_report(&mut self, id: ConnectionId) {
        if let Some(provided) = self.provided.get_mut(&id) {
            provided.report = None;
        }
    }

    /// Sends all due reports.
    pub(super) fn report_due(&mut self, now: Instant) {
        let provided = self.provided.values_mut();
        let due: Vec<_> = provided
            .filter_map(|known| known.take_report(now))
            .collect();
        for report in due {
            self.transmit(Ok(report));
        }
    }

    fn meant(&mut self, message: &Message, code: u16, instance: u8) -> Option<ConnectionId> {
        let is_it = |known: &Provided| {
            let request = &known.request;
            (
                request.provider,
                request.client,
                request.code,
                known.instance,
            ) == (message.destination, message.source, code, instance)
        };
        let known = self.provided.iter().find(|(_, known)| is_it(known));
        known.map(|(&id, _)| id)
    }

    pub(super) fn handle_activate(
        &mut self,
        now: Instant,
        message: &Message,
    ) -> Result<(), DecodeError> {
        let body: ActivateServiceConnection = message.body()?;
        let id = self.meant(message, body.command_code, body.instance_id);
        if let Some(known) = id.and_then(|id| self.provided.get_mut(&id)) {
            known.active = true;
            known.next = known.next.max(now);
            self.report_due(now);
        }
        Ok(())
    }

    pub(super) fn handle_suspend(&mut self, message: &Message) -> Result<(), DecodeError> {
        let body: SuspendServiceConnection = message.body()?;
        let id = self.meant(message, body.command_code, body.instance_id);
        if let Some(known) = id.and_then(|id| self.provided.get_mut(&id)) {
            known.active = false;
        }
        Ok(())
    }

    /// Handles a termination, which either side may send.
    pub(super) fn handle_terminate(&mut self, message: &Message) -> Result<(), DecodeError> {
        let body: TerminateServiceConnection = message.body()?;
        let provided = self.meant(message, body.command_code, body.instance_id);
        let wanted = self.by_report(message.source, message.destination, body.command_code);
        for id in provided.into_iter().chain(wanted) {
            self.provided.remove(&id);
            self.wanted.remove(&id);
            self.tell(Event::Ended(id));
        }
        Ok(())
    }
}
