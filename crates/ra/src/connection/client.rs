//! Our service connections to reports of remote providers.

use std::time::Instant;

use super::{CannotConnect, ConnectionId, Connections, Event, Request, ResponseCode, period};
use crate::RaId;
use crate::counters::Counter;
use crate::message::Message;
use crate::messages::ra33::create_service_connection::RequestedPeriodicUpdateRate;
use crate::messages::ra33::{
    ActivateServiceConnection, ConfirmServiceConnection, CreateServiceConnection,
    SuspendServiceConnection,
};
use jaus::codec::DecodeError;

/// Our service connection to a remote report.
#[derive(Debug)]
pub(super) struct Wanted {
    pub(super) request: Request,
    /// Instance number at the provider, once confirmed.
    pub(super) instance: Option<u8>,
    /// Confirmed rate, in hertz.
    rate: f64,
    suspended: bool,
    /// Unsuccessful attempts.
    tries: u32,
    /// When to repeat the request, or to consider the provider silent.
    pub(super) next: Instant,
}

impl Connections {
    /// Requests a report; repeats the request until it is confirmed or refused.
    ///
    /// # Errors
    /// See [`CannotConnect`].
    pub fn create(
        &mut self,
        now: Instant,
        request: Request,
    ) -> Result<ConnectionId, CannotConnect> {
        if !(request.rate > 0.0 && request.rate <= Self::MAX_RATE) {
            return Err(CannotConnect::Rate);
        }
        if let Some(id) = self.by_report(request.provider, request.client, request.code) {
            return Err(CannotConnect::Exists(id));
        }
        if self.wanted.len() >= self.settings.max_wanted {
            return Err(CannotConnect::Full(self.wanted.len()));
        }
        let id = self.next_id();
        let wanted = Wanted {
            request,
            instance: None,
            rate: request.rate,
            suspended: false,
            tries: 0,
            next: now,
        };
        self.wanted.insert(id, wanted);
        self.watch(now);
        Ok(id)
    }

    /// The connection of a report.
    pub(super) fn by_report(
        &self,
        provider: RaId,
        client: RaId,
        code: u16,
    ) -> Option<ConnectionId> {
        let is_it = |known: &Request| {
            (known.provider, known.client, known.code) == (provider, client, code)
        };
        let known = self.wanted.iter().find(|(_, known)| is_it(&known.request));
        known.map(|(&id, _)| id)
    }

    /// Handles a confirmation. Terminates connections that we did not request.
    pub(super) fn handle_confirm(
        &mut self,
        now: Instant,
        message: &Message,
    ) -> Result<(), DecodeError> {
        let body: ConfirmServiceConnection = message.body()?;
        let (provider, client) = (message.source, message.destination);
        let accepted = body.response_code == ResponseCode::SUCCESSFUL;
        let Some(id) = self.by_report(provider, client, body.command_code) else {
            if accepted && client.require_one().is_ok() {
                self.terminate(client, provider, body.command_code, body.instance_id);
            }
            return Ok(());
        };
        if !accepted {
            self.wanted.remove(&id);
            self.tell(Event::Refused(id, body.response_code));
            return Ok(());
        }
        let rate = body.confirmed_periodic_update_rate.value();
        let Some(wanted) = self.wanted.get_mut(&id) else {
            return Ok(());
        };
        wanted.instance = Some(body.instance_id);
        wanted.rate = if rate > 0.0 {
            rate
        } else {
            wanted.request.rate
        };
        wanted.tries = 0;
        let rate = wanted.rate;
        self.hear(now, id);
        self.tell(Event::Established(id, rate));
        Ok(())
    }

    /// Handles a report of a connection. The sender of an unknown report is sent a termination with
    /// the first instance number, at most once per second.
    pub(super) fn handle_report(&mut self, now: Instant, message: &Message) {
        let (provider, client, code) = (message.source, message.destination, message.code);
        if let Some(id) = self.by_report(provider, client, code) {
            self.hear(now, id);
            self.tell(Event::Report(id, message.clone()));
            return;
        }
        self.counters.add(Counter::UnwantedReport);
        if client.require_one().is_ok() && self.terminations.take(now, (provider, code)) {
            self.terminate(client, provider, code, 0);
        }
    }

    /// Restarts the silence timeout after a message of the provider. It tolerates three lost
    /// reports.
    fn hear(&mut self, now: Instant, id: ConnectionId) {
        let silence = self.settings.silence;
        if let Some(wanted) = self.wanted.get_mut(&id)
            && wanted.instance.is_some()
        {
            wanted.next = now + silence.max(period(wanted.rate) * 4);
        }
    }

    /// Repeats unconfirmed requests, and restarts silent connections.
    pub(super) fn watch(&mut self, now: Instant) {
        let mut silent = Vec::new();
        let mut asked = Vec::new();
        for (&id, wanted) in &mut self.wanted {
            if wanted.next > now {
                continue;
            }
            if wanted.suspended && wanted.instance.is_some() {
                wanted.next = now + self.settings.retry;
                continue;
            }
            if wanted.instance.take().is_some() || wanted.tries == self.settings.tries {
                silent.push(id);
            }
            wanted.tries = wanted.tries.saturating_add(1);
            wanted.next = now
                + if wanted.tries <= self.settings.tries {
                    self.settings.patience
                } else {
                    self.settings.retry
                };
            asked.push(wanted.request);
        }
        for request in asked {
            self.ask(&request);
        }
        for id in silent {
            self.tell(Event::Silent(id));
        }
    }

    fn ask(&mut self, request: &Request) {
        let rate = RequestedPeriodicUpdateRate::new(request.rate).unwrap_or_default();
        let body = CreateServiceConnection {
            command_code: request.code,
            requested_periodic_update_rate: rate,
            presence_vector: request.presence,
        };
        self.transmit(Message::with_body(request.client, request.provider, &body));
    }

    /// Suspends or activates a connection at the provider.
    pub fn set_active(&mut self, now: Instant, id: ConnectionId, active: bool) {
        let Some(wanted) = self.wanted.get_mut(&id) else {
            return;
        };
        wanted.suspended = !active;
        let Request {
            provider,
            client,
            code: command_code,
            ..
        } = wanted.request;
        let Some(instance_id) = wanted.instance else {
            return;
        };
        self.transmit(if active {
            let body = ActivateServiceConnection {
                command_code,
                instance_id,
            };
            Message::with_body(client, provider, &body)
        } else {
            let body = SuspendServiceConnection {
                command_code,
                instance_id,
            };
            Message::with_body(client, provider, &body)
        });
        self.hear(now, id);
    }
}
