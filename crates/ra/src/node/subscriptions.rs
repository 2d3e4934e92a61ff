//! Subscriptions of peers to our configuration.

use std::time::Instant;

use super::RaNode;
use crate::RaId;
use crate::counters::Counter;
use crate::message::Message;
use crate::messages::ra33::confirm_event_request::ResponseCode;
use crate::messages::ra33::query_configuration::QueryField;
use crate::messages::ra33::{
    CancelEvent, ConfirmEventRequest, CreateEvent, Event, QueryConfiguration, ReportConfiguration,
};
use jaus::codec::{EncodeError, Message as _};
use jaus::wire::ra::CODE_LEN;

/// Subscription of a peer component to configuration changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Subscription {
    client: RaId,
    /// Component that received the request and therefore sends the events.
    at: RaId,
    /// Scope: the subsystem, or the node of `at`.
    about: QueryField,
    /// Sequence number of the next event.
    sequence: u8,
}

impl Subscription {
    pub(super) fn client(&self) -> RaId {
        self.client
    }

    /// The subscribed query and the component that received it.
    pub(super) fn question(&self) -> (RaId, QueryConfiguration) {
        let query_field = self.about;
        (self.at, QueryConfiguration { query_field })
    }

    /// Builds the event that carries a report.
    pub(super) fn event(
        &mut self,
        event_id: u8,
        report: &ReportConfiguration,
    ) -> Result<Message, EncodeError> {
        let body = Event {
            event_id,
            report_code: ReportConfiguration::CODE,
            sequence_number: self.sequence,
            report_message: report.encode()?.slice(CODE_LEN..),
        };
        self.sequence = self.sequence.wrapping_add(1);
        Message::with_body(self.at, self.client, &body)
    }
}

/// The only event type on offer: every change, and once at the start.
pub(super) const EVERY_CHANGE: u8 = 1;

/// Whether a cancel request means configurations. OpenJAUS expects the code of the query there, the
/// standard that of the report.
fn means_configuration(code: u16) -> bool {
    [ReportConfiguration::CODE, QueryConfiguration::CODE].contains(&code)
}

impl RaNode {
    /// Handles Create Event. Returns whether the node is responsible: for configurations, and for
    /// any request to a node manager or communicator, which offer nothing else.
    pub(super) fn handle_create_event(&mut self, now: Instant, message: &Message) -> bool {
        let Ok(request) = message.body::<CreateEvent>() else {
            return self.refuse_malformed(message);
        };
        let wanted = &request.create_event_rec;
        let about_configuration = wanted.report_code == ReportConfiguration::CODE;
        if !about_configuration && !self.is_ours_alone(message.destination) {
            return false;
        }
        if !self.answers.take(now, message.source.subsystem) {
            self.carrier.count(Counter::AnswerRate);
            return true;
        }
        let granted = self.subscribe(message, &request);
        if granted.is_err() {
            self.carrier.count(Counter::EventRefused);
        }
        let confirmation = ConfirmEventRequest {
            request_id: wanted.request_id,
            report_code: wanted.report_code,
            event_id: granted.unwrap_or(0),
            confirmed_periodic_rate: Some(Default::default()),
            response_code: granted.err().unwrap_or(ResponseCode::SUCCESSFUL),
        };
        self.reply(message, &confirmation);
        true
    }

    /// Adds a subscription or finds the existing one; returns its event number.
    fn subscribe(&mut self, message: &Message, request: &CreateEvent) -> Result<u8, ResponseCode> {
        let wanted = &request.create_event_rec;
        if wanted.report_code != ReportConfiguration::CODE {
            return Err(ResponseCode::MESSAGE_NOT_SUPPORTED);
        }
        if wanted.event_type.0 != EVERY_CHANGE {
            return Err(ResponseCode::PERIODIC_NOT_SUPPORTED);
        }
        let at = message.destination;
        at.require_one().map_err(|_| ResponseCode::INVALID_EVENT)?;
        let query = request.query_rec.as_ref();
        let query = query.and_then(|query| query.query_message.first().copied());
        let about = match query {
            None => QueryField::SUBSYSTEM,
            Some(field @ (2 | 3)) => QueryField(field),
            Some(_) => return Err(ResponseCode::INVALID_EVENT),
        };
        let total: usize = self.own.values().map(|own| own.subscriptions.len()).sum();
        let has_room = total < self.settings.max_events;
        let own = self.own.get_mut(&at.subsystem);
        let own = own.ok_or(ResponseCode::INVALID_EVENT)?;
        let same = |known: &Subscription| {
            (known.client, known.at, known.about) == (message.source, at, about)
        };
        if let Some((&event, _)) = own.subscriptions.iter().find(|(_, known)| same(known)) {
            return Ok(event);
        }
        let free = (0..=u8::MAX).find(|event| !own.subscriptions.contains_key(event));
        let event = free.filter(|_| has_room);
        let event = event.ok_or(ResponseCode::CONNECTION_REFUSED)?;
        let subscription = Subscription {
            client: message.source,
            at,
            about,
            sequence: 0,
        };
        own.subscriptions.insert(event, subscription);
        Ok(event)
    }

    /// Handles Cancel Event. Returns whether the node was responsible.
    pub(super) fn handle_cancel_event(&mut self, message: &Message) -> bool {
        let Ok(request) = message.body::<CancelEvent>() else {
            return self.refuse_malformed(message);
        };
        let at = message.destination;
        let Some(own) = self.own.get_mut(&at.subsystem) else {
            return false;
        };
        let meant = |event: u8, known: &Subscription| {
            (known.client, known.at) == (message.source, at)
                && request.event_id.is_none_or(|id| id == event)
                && request.report_code.is_none_or(means_configuration)
        };
        let before = own.subscriptions.len();
        own.subscriptions
            .retain(|&event, known| !meant(event, known));
        let ended = own.subscriptions.len() < before;
        if !ended && !self.is_ours_alone(at) {
            return false;
        }
        let confirmation = ConfirmEventRequest {
            request_id: request.request_id,
            report_code: ReportConfiguration::CODE,
            event_id: request.event_id.unwrap_or(0),
            confirmed_periodic_rate: Some(Default::default()),
            response_code: if ended {
                ResponseCode::SUCCESSFUL
            } else {
                ResponseCode::INVALID_EVENT
            },
        };
        self.reply(message, &confirmation);
        true
    }

    fn refuse_malformed(&mut self, message: &Message) -> bool {
        self.carrier.count(Counter::Malformed);
        tracing::debug!(?message, "malformed request for an event");
        true
    }

    fn reply(&mut self, to: &Message, body: &ConfirmEventRequest) {
        if let Ok(reply) = Message::with_body(to.destination, to.source, body) {
            self.transmit(&reply);
        }
    }

    /// Whether a destination is a node manager or communicator, for which the node's owner answers
    /// no requests.
    fn is_ours_alone(&self, destination: RaId) -> bool {
        [RaId::NODE_MANAGER, RaId::COMMUNICATOR].contains(&destination.component)
    }

    /// Removes the subscriptions of a subsystem.
    pub(super) fn forget_subscriber(&mut self, subsystem: u8) {
        for own in self.own.values_mut() {
            own.subscriptions
                .retain(|_, known| known.client.subsystem != subsystem);
        }
    }
}
