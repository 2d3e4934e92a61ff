//! Subscriptions of an RA component to events of JAUS components.
//!
//! Periodic and every-change reports exist on both sides. Conditions on a field, periodic reports
//! on change only, and single reports are refused with the code for it. The RA node handles
//! configuration events; they do not arrive here.

use std::time::Instant;

use bytes::Bytes;

use super::ra_client::RaClient;
use super::ra_event::RaEvent;
use super::target::{RaRequest, Target};
use crate::gateway::convert::{self, Words};
use crate::gateway::counters::{Counter, Tally};
use crate::gateway::pairs;
use crate::message::Message;
use crate::messages::ra33::confirm_event_request::ResponseCode;
use crate::messages::ra33::create_event::{CreateEventRec, EventType};
use crate::messages::ra33::{
    CancelEvent, ConfirmEventRequest, CreateEvent, QueryEvents, RejectEventRequest, ReportEvents,
    UpdateEvent, report_events, update_event,
};
use jaus::codec::Message as _;
use jaus::service::{Stack, SubscriptionId, SubscriptionNews, Topic, When, code_of};

impl RaClient {
    /// Handles an event request of the RA component.
    pub(super) fn handle_event_request(&mut self, request: &mut RaRequest<'_>) -> bool {
        let RaRequest { now, message, .. } = *request;
        let read = match message.code {
            CreateEvent::CODE => message.body().map(|create: CreateEvent| {
                self.create_event(request, None, &create);
            }),
            UpdateEvent::CODE => message.body().map(|update: UpdateEvent| {
                let id = update.event_id_rec.event_id;
                self.create_event(request, Some(id), &as_create(update));
            }),
            CancelEvent::CODE => message.body().map(|cancel: CancelEvent| {
                self.cancel_events(now, message, &cancel, request.stack);
            }),
            QueryEvents::CODE => message.body().map(|query: QueryEvents| {
                self.tell_events(message, &query);
            }),
            _ => return false,
        };
        if let Err(why) = read {
            convert::refuse(now, request.tally, message.code, &why.into());
        }
        true
    }

    /// Creates an event; with a number, replaces that one.
    fn create_event(
        &mut self,
        request: &mut RaRequest<'_>,
        replaced: Option<u8>,
        create: &CreateEvent,
    ) {
        let wanted = create.create_event_rec;
        let made = self.subscribe_event(request, replaced, create);
        if let Err(code) = made {
            let counter = match code {
                ResponseCode::MESSAGE_NOT_SUPPORTED => Counter::NoCounterpart,
                ResponseCode::CONNECTION_REFUSED => Counter::TooManyConnections,
                _ => Counter::NotConverted,
            };
            let why = format_args!("event of type {}: {code:?}", wanted.event_type.0);
            let RaRequest { now, message, .. } = *request;
            request.tally.refuse(now, counter, wanted.report_code, why);
            let id = replaced.unwrap_or_default();
            self.answer_event(message, (wanted, id), None, code);
        }
    }

    fn subscribe_event(
        &mut self,
        request: &mut RaRequest<'_>,
        replaced: Option<u8>,
        create: &CreateEvent,
    ) -> Result<(), ResponseCode> {
        let RaRequest {
            now, message, peer, ..
        } = *request;
        let at = message.destination;
        let words = self.words(at, peer.minor);
        let topic = topic(create, peer, &words)?;
        let same = |it: &RaEvent| it.at == at && it.topic == topic;
        let known = self.events.values_mut().find(|it| same(it));
        if let Some(known) = known.filter(|it| replaced.is_none_or(|id| id == it.id)) {
            // Repeated, because the answer got lost.
            known.request = message.clone();
            known.wanted = create.create_event_rec;
            let (wanted, id, confirmed) = (known.wanted, known.id, known.confirmed);
            if confirmed {
                let hz = hz_of(&topic);
                self.answer_event(message, (wanted, id), hz, ResponseCode::SUCCESSFUL);
            }
            return Ok(());
        }
        let of_number = |id: u8| move |it: &RaEvent| it.at == at && it.id == id;
        if let Some(id) = replaced
            && !self.end_events(now, of_number(id), request.stack)
        {
            return Err(ResponseCode::INVALID_EVENT);
        }
        let is_free = |id: &u8| self.events.values().all(|it| it.id != *id);
        let free = replaced.or_else(|| (0..=u8::MAX).find(is_free));
        let free = free.filter(|_| self.events.len() < Self::MOST_EVENTS);
        let id = free.ok_or(ResponseCode::CONNECTION_REFUSED)?;
        let subscription = request.stack.subscribe(now, &topic, self.patience);
        let subscription = subscription.map_err(|_| ResponseCode::CONNECTION_REFUSED)?;
        let event = RaEvent {
            id,
            at,
            request: message.clone(),
            wanted: create.create_event_rec,
            topic,
            words,
            sequence: 0,
            confirmed: false,
        };
        self.events.insert(subscription, event);
        Ok(())
    }

    /// Maximum number of events of one RA component.
    const MOST_EVENTS: usize = 64;

    /// Handles news of a subscription, if it belongs to an event.
    pub(super) fn handle_event_news(
        &mut self,
        now: Instant,
        id: SubscriptionId,
        news: &SubscriptionNews,
        tally: &mut Tally,
    ) -> bool {
        let Some(event) = self.events.get_mut(&id) else {
            return false;
        };
        match news {
            SubscriptionNews::Up { hz } => {
                if !std::mem::replace(&mut event.confirmed, true) {
                    let request = event.request.clone();
                    let about = (event.wanted, event.id);
                    self.answer_event(&request, about, *hz, ResponseCode::SUCCESSFUL);
                }
            }
            SubscriptionNews::Report { report, .. } => match event.words.to_ra(report) {
                Ok((_, data)) => {
                    tally.add(Counter::ReportsToRa);
                    let answer = event.tell(data);
                    self.said.extend(answer);
                }
                Err(refusal) => {
                    let code = code_of(report).unwrap_or_default();
                    convert::refuse(now, tally, code, &refusal);
                }
            },
            // The subscription recovers by itself.
            SubscriptionNews::Down { .. } => {}
            SubscriptionNews::Ended(why) => {
                tally.refuse(now, Counter::Unanswered, CreateEvent::CODE, why);
                if let Some(event) = self.events.remove(&id) {
                    self.end_unasked(&event);
                }
            }
        }
        true
    }

    /// Notifies the RA component that it does not get, or no longer has, an event.
    fn end_unasked(&mut self, event: &RaEvent) {
        let code = ResponseCode::CONNECTION_REFUSED;
        if !event.confirmed {
            return self.answer_event(&event.request, (event.wanted, event.id), None, code);
        }
        let reject = RejectEventRequest {
            request_id: event.wanted.request_id,
            response_code: code,
            error_message: None,
        };
        let (from, to) = (event.at, event.request.source);
        self.said.extend(Message::with_body(from, to, &reject).ok());
    }

    fn cancel_events(
        &mut self,
        now: Instant,
        request: &Message,
        cancel: &CancelEvent,
        stack: &mut Stack,
    ) {
        let at = request.destination;
        let meant = |it: &RaEvent| {
            it.at == at
                && cancel.event_id.is_none_or(|id| id == it.id)
                && cancel
                    .report_code
                    .is_none_or(|code| code == it.wanted.report_code)
        };
        let code = match self.end_events(now, meant, stack) {
            true => ResponseCode::SUCCESSFUL,
            false => ResponseCode::INVALID_EVENT,
        };
        let about = CreateEventRec {
            request_id: cancel.request_id,
            report_code: cancel.report_code.unwrap_or_default(),
            ..CreateEventRec::default()
        };
        let id = cancel.event_id.unwrap_or_default();
        self.answer_event(request, (about, id), None, code);
    }

    /// Ends these events; returns whether there were any.
    fn end_events(
        &mut self,
        now: Instant,
        meant: impl Fn(&RaEvent) -> bool,
        stack: &mut Stack,
    ) -> bool {
        let ended = self.events.iter().filter(|(_, it)| meant(it));
        let ended: Vec<SubscriptionId> = ended.map(|(&id, _)| id).collect();
        for &id in &ended {
            self.events.remove(&id);
            stack.unsubscribe(now, id);
        }
        !ended.is_empty()
    }

    fn tell_events(&mut self, request: &Message, query: &QueryEvents) {
        let meant = |it: &&RaEvent| {
            it.at == request.destination
                && query.event_id.is_none_or(|id| id == it.id)
                && query
                    .report_code
                    .is_none_or(|code| code == it.wanted.report_code)
                && query
                    .event_type
                    .is_none_or(|it_is| it_is.0 == it.wanted.event_type.0)
        };
        let seq = |it: &RaEvent| report_events::EventSeq {
            event_rec: report_events::EventRec {
                report_code: it.wanted.report_code,
                event_type: it.wanted.event_type,
            },
            event_id_rec: Some(update_event::EventIdRec { event_id: it.id }),
            ..report_events::EventSeq::default()
        };
        let event_list = self.events.values().filter(meant).map(seq).collect();
        let report = ReportEvents { event_list };
        let (from, to) = (request.destination, request.source);
        self.said.extend(Message::with_body(from, to, &report).ok());
    }

    /// Answers an event request.
    fn answer_event(
        &mut self,
        request: &Message,
        (wanted, event_id): (CreateEventRec, u8),
        hz: Option<f64>,
        response_code: ResponseCode,
    ) {
        let mut confirm = ConfirmEventRequest {
            request_id: wanted.request_id,
            report_code: wanted.report_code,
            event_id,
            confirmed_periodic_rate: None,
            response_code,
        };
        // The requested rate is in range, and the confirmed one is not higher.
        let _ = confirm.set_confirmed_periodic_rate_hz(hz.unwrap_or_default());
        let (from, to) = (request.destination, request.source);
        self.said
            .extend(Message::with_body(from, to, &confirm).ok());
    }
}

const fn hz_of(topic: &Topic) -> Option<f64> {
    match topic.when {
        When::Periodic { hz, .. } => Some(hz),
        When::OnChange => None,
    }
}

/// The JAUS topic of an event.
fn topic(create: &CreateEvent, peer: Target, words: &Words) -> Result<Topic, ResponseCode> {
    let when = when(create)?;
    let code = create.create_event_rec.report_code;
    let unsupported = ResponseCode::MESSAGE_NOT_SUPPORTED;
    let query = pairs::query_of(code).ok_or(unsupported)?;
    let data = match &create.query_rec {
        Some(given) => given.query_message.clone(),
        None => pairs::state(code).map_or_else(Bytes::new, pairs::State::query_for_all),
    };
    let query = words.to_jaus(query, &data).map_err(|_| unsupported)?;
    let report = code_of(&query).and_then(pairs::report_of);
    Ok(Topic {
        peer: peer.id,
        report: report.ok_or(unsupported)?,
        query,
        when,
    })
}

/// The trigger of an event, if ours support it.
fn when(create: &CreateEvent) -> Result<When, ResponseCode> {
    let is_conditional = create.event_boundary_rec.is_some()
        || create.limit_data_field_rec.is_some()
        || create.lower_limit.is_some()
        || create.upper_limit.is_some()
        || create.state_limit.is_some();
    let rate = create.periodic_rate_rec.as_ref();
    let hz = rate.map_or(0.0, |it| it.requested_periodic_rate_hz());
    let least = create.minimum_periodic_rate_rec.as_ref();
    let least = least.map_or(0.0, |it| it.requested_minimum_periodic_rate_hz());
    match create.create_event_rec.event_type {
        EventType::EVERY_CHANGE if !is_conditional => Ok(When::OnChange),
        EventType::PERIODIC if hz > 0.0 && !is_conditional => {
            Ok(When::hz(hz).at_least(least.min(hz)))
        }
        EventType::PERIODIC | EventType::PERIODIC_WITHOUT_REPETITION => {
            Err(ResponseCode::PERIODIC_NOT_SUPPORTED)
        }
        EventType::EVERY_CHANGE | EventType::FIRST_CHANGE | EventType::FIRST_CHANGE_IN_AND_OUT => {
            Err(ResponseCode::CHANGE_BASED_NOT_SUPPORTED)
        }
        _ => Err(ResponseCode::INVALID_EVENT),
    }
}

/// The update of an event as a new request.
fn as_create(update: UpdateEvent) -> CreateEvent {
    let wanted = update.update_event_rec;
    CreateEvent {
        create_event_rec: CreateEventRec {
            request_id: wanted.request_id,
            report_code: wanted.report_code,
            event_type: wanted.event_type,
        },
        event_boundary_rec: update.event_boundary_rec,
        limit_data_field_rec: update.limit_data_field_rec,
        lower_limit: update.lower_limit,
        upper_limit: update.upper_limit,
        state_limit: update.state_limit,
        minimum_periodic_rate_rec: update.minimum_periodic_rate_rec,
        periodic_rate_rec: update.periodic_rate_rec,
        query_rec: update.query_rec,
    }
}
