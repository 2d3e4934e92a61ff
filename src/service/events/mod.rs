//! The Events service (AS5710): a client subscribes to a query, and gets its report periodically or
//! on every change.
//!
//! A client can subscribe to any query that the component answers. The [`Stack`](super::Stack)
//! passes the query to the component's own services as if the client had sent it, and the answer
//! becomes the event. This module keeps the subscriptions, and determines which report is due.
//!
//! # Design choices
//!
//! * Each client has its own numbering of events, so that a component can have more than the 256
//!   that one octet can number. Clients identify an event by producer and number.
//! * The first report follows the confirmation at once, for both types. So the client knows the
//!   current state without a separate query.
//! * A query is answered once for all clients whose report is due at the same time. So the answer
//!   must not depend on the client.
//! * Creating an event that exists (same client, type and query) changes its rate and confirms the
//!   same number. So a client that repeats its request, after a lost answer or a restart, does not
//!   multiply streams. At the same rate a periodic event keeps its schedule, without an extra
//!   report. An event on change is reported again, because a report may have been lost.
//! * Query Events by number lists that event first, and then the client's other events. JAUS++
//!   checks each of its events with such a query, and assumes that all events missing from the
//!   answer are lost. It would recreate them every five seconds, at 1 Hz.
//! * Events do not expire unless [`EventSettings::timeout`] is set, because clients of version 1.0
//!   do not know about expiry. Events of a client that discovery has lost end.
//! * Command events (1.1) are available for commands whose end a service
//!   [reports](super::Service::tells_end_of), and to clients that may send those commands. Other
//!   requests are rejected before the command runs.

mod commands;
mod rejecting;
mod table;
#[cfg(test)]
mod tests;

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::share::Share;
use super::{Outbox, code_of, read};
use crate::address::JausId;
use crate::codec::{Message, ServiceId};
use crate::endpoint::Received;
use crate::messages::core::query_events::QueryEventsVar;
use crate::messages::core::reject_event_request::ResponseCode;
use crate::messages::core::{
    self, CancelEvent, ConfirmEventRequest, CreateCommandEvent, CreateEvent, Event,
    QueryEventTimeout, QueryEvents, ReportEventTimeout, ReportEvents, UpdateEvent,
    report_event_timeout, report_events,
};
use commands::Commands;
pub(super) use commands::{CommandTrial, Refusal};
use rejecting::{INVALID_EVENT, reject, rejection};
pub(super) use table::Due;
use table::{Kind, Name, Subscriber, Table};

const PERIODIC: u8 = 0;
const EVERY_CHANGE: u8 = 1;

/// The rates that Create Event can carry, in hertz.
const RATES: std::ops::RangeInclusive<f64> = 0.01..=1092.0;
/// The longest query of a subscription, in octets. Each subscription keeps its query; the queries
/// of the standards have a few dozen octets.
const LONGEST_QUERY: usize = 1024;

/// Limits of the Events service.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventSettings {
    /// Subscriptions per client; event numbers allow up to 256.
    pub per_client: usize,
    /// Subscriptions per network address. The limit for all addresses together is twice this, with
    /// the second half reserved for newcomers.
    pub total: usize,
    /// The highest rate of one subscription, in hertz. A higher request is confirmed at this rate.
    /// Changes in faster succession are reported together.
    pub fastest: f64,
    /// Limit of periodic reports per second to one network address. The limit for all addresses
    /// together is twice this.
    pub reports_per_second: f64,
    /// Minutes after which an event ends unless its client renews it; 0 disables this.
    pub timeout: u8,
}

impl Default for EventSettings {
    /// 256 per client and 4096 per network address, up to 250 Hz each and 20 000 reports per
    /// second.
    fn default() -> Self {
        Self {
            per_client: 256,
            total: 4096,
            fastest: 250.0,
            reports_per_second: 20_000.0,
            timeout: 0,
        }
    }
}

/// The subscriptions of all clients.
#[derive(Debug)]
pub(super) struct Events {
    settings: EventSettings,
    table: Table,
    commands: Commands,
}

/// Result of handling a message.
#[derive(Debug)]
pub(super) enum Outcome {
    /// Not a message of this service.
    NotOurs,
    /// Handled.
    Done,
    /// The event is created if the component answers its query.
    Try(Trial),
    /// The command runs if a service reports its end and the client may send it.
    TryCommand(CommandTrial),
}

/// A requested subscription.
#[derive(Debug)]
pub(super) struct Trial {
    request: Received,
    request_id: u8,
    /// The number of the event to change, if the request gives one.
    event_id: Option<u8>,
    kind: u8,
    hertz: f64,
    pub(super) query: Bytes,
}

impl Trial {
    pub(super) const fn client(&self) -> JausId {
        self.request.source
    }
}

impl Events {
    pub(super) fn new(settings: EventSettings) -> Self {
        Self {
            settings,
            table: Table::new(settings.total, settings.reports_per_second),
            commands: Commands::default(),
        }
    }

    pub(super) fn offers(&self) -> [ServiceId; 2] {
        [core::events::V1_1, core::events::V1_0]
    }

    pub(super) fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        is_query: impl Fn(u16) -> bool,
        out: &mut Outbox,
    ) -> Outcome {
        match code_of(&message.payload) {
            Some(CreateEvent::CODE) => {
                read(message).map_or(Outcome::Done, |it| create(message, &it, is_query, out))
            }
            Some(UpdateEvent::CODE) => {
                read(message).map_or(Outcome::Done, |it| self.update(message, &it, is_query, out))
            }
            Some(CancelEvent::CODE) => {
                if let Some(cancel) = read(message) {
                    self.cancel(message, &cancel, out);
                }
                Outcome::Done
            }
            Some(QueryEvents::CODE) => {
                if let Some(query) = read::<QueryEvents>(message) {
                    self.table.renew(message.source, self.expiry(now));
                    out.reply(
                        message,
                        &self.report(message.source, &query.query_events_var),
                    );
                }
                Outcome::Done
            }
            Some(QueryEventTimeout::CODE) => {
                let report = ReportEventTimeout {
                    timeout: report_event_timeout::Timeout(self.settings.timeout),
                };
                out.reply(message, &report);
                Outcome::Done
            }
            Some(CreateCommandEvent::CODE) => {
                read(message).map_or(Outcome::Done, |it| create_command(message, it, out))
            }
            _ => Outcome::NotOurs,
        }
    }

    /// Whether a client has a subscription.
    pub(super) fn has(&self, client: JausId) -> bool {
        self.table.of(client).next().is_some()
    }

    fn update(
        &self,
        message: &Received,
        update: &UpdateEvent,
        is_query: impl Fn(u16) -> bool,
        out: &mut Outbox,
    ) -> Outcome {
        let name = (message.source, update.event_id);
        if self.table.get(name).is_none() {
            reject(message, update.request_id, INVALID_EVENT, out);
            return Outcome::Done;
        }
        let trial = Trial {
            request: message.clone(),
            request_id: update.request_id,
            event_id: Some(update.event_id),
            kind: update.event_type.0,
            hertz: update.requested_periodic_rate_hz(),
            query: own(&update.query_message),
        };
        check(trial, is_query, out)
    }

    fn cancel(&mut self, message: &Received, cancel: &CancelEvent, out: &mut Outbox) {
        let name = (message.source, cancel.event_id);
        match self.table.remove(name) {
            Some(ended) => confirm(message, cancel.request_id, name, &ended, out),
            None if self.commands.remove(name) => {
                // The command continues; its end is no longer reported.
                out.reply(message, &confirmation(cancel.request_id, cancel.event_id));
            }
            None => reject(message, cancel.request_id, INVALID_EVENT, out),
        }
    }

    fn report(&self, client: JausId, which: &QueryEventsVar) -> ReportEvents {
        let wanted = |id: u8, subscription: &Subscriber| match which {
            QueryEventsVar::MessageIdRec(wanted) => {
                code_of(&subscription.query) == Some(wanted.message_code)
            }
            QueryEventsVar::EventTypeRec(wanted) => wanted.event_type.0 == type_of(subscription),
            QueryEventsVar::EventIdRec(wanted) => wanted.event_id == id,
            QueryEventsVar::AllEventsRec(_) => true,
        };
        let listed = self.table.of(client).filter(|&(id, it)| wanted(id, it));
        // See "Design choices" above.
        let beside = match which {
            QueryEventsVar::EventIdRec(one) if self.table.get((client, one.event_id)).is_some() => {
                Some(one.event_id)
            }
            _ => None,
        };
        let others = self.table.of(client);
        let others = others.filter(|&(id, _)| beside.is_some_and(|listed| id != listed));
        let listed = listed.chain(others);
        let entry = |(event_id, subscription): (u8, &Subscriber)| report_events::ReportEventRec {
            event_type: report_events::EventType(type_of(subscription)),
            event_id,
            query_message: subscription.query.clone(),
        };
        // The count field is one octet.
        let event_list = listed.take(usize::from(u8::MAX)).map(entry).collect();
        ReportEvents { event_list }
    }

    /// Completes a trial with the report that answers its query; `None` if there is no answer.
    pub(super) fn conclude(
        &mut self,
        now: Instant,
        trial: &Trial,
        report: Option<Bytes>,
        out: &mut Outbox,
    ) {
        let Some(report) = report else {
            let why = ResponseCode::MESSAGE_NOT_SUPPORTED;
            return reject(&trial.request, trial.request_id, why, out);
        };
        let kind = self.kind(trial);
        let client = trial.client();
        let known = trial
            .event_id
            .or_else(|| self.table.find(client, type_number(kind), &trial.query));
        let before = known.and_then(|id| self.table.get((client, id)));
        let share = Share::of(&trial.request);
        if !self.has_room_for((client, share), kind, before) {
            let why = ResponseCode::CONNECTION_REFUSED;
            return reject(&trial.request, trial.request_id, why, out);
        }
        let Some(id) = known.or_else(|| self.free_id(client)) else {
            let why = ResponseCode::CONNECTION_REFUSED;
            return reject(&trial.request, trial.request_id, why, out);
        };
        let sequence = before.map_or(0, |before| before.sequence);
        let mut subscription = Subscriber {
            kind,
            query: trial.query.clone(),
            sequence,
            reported: None,
            next: None,
            expires: self.expiry(now),
            request_id: trial.request_id,
            share: before.map_or(share, |before| before.share),
        };
        let name = (client, id);
        confirm(&trial.request, trial.request_id, name, &subscription, out);
        let beat = before.filter(|before| is_the_same(before, &subscription));
        match (kind, beat.and_then(|before| before.next)) {
            (Kind::Periodic { .. }, Some(next)) => subscription.next = Some(next),
            (kind, _) => {
                send(now, &mut subscription, name, report, out);
                if let Kind::Periodic { period, .. } = kind {
                    subscription.next = Some(now + period);
                }
            }
        }
        self.table.insert(name, subscription);
    }

    /// A number that the client does not use for an event.
    fn free_id(&self, client: JausId) -> Option<u8> {
        let taken = |name| self.commands.contains(name);
        self.table.free_id(client, taken)
    }

    /// The kind of event that the client gets, within the limits.
    fn kind(&self, trial: &Trial) -> Kind {
        let fastest = self.settings.fastest.clamp(*RATES.start(), *RATES.end());
        if trial.kind == EVERY_CHANGE {
            return Kind::EveryChange {
                pause: Duration::from_secs_f64(1.0 / fastest),
            };
        }
        // At least the smallest step of the field, as `check` has ensured.
        let hertz = trial.hertz.clamp(*RATES.start(), fastest);
        Kind::Periodic {
            hertz,
            period: Duration::from_secs_f64(1.0 / hertz),
        }
    }

    fn has_room_for(
        &self,
        (client, share): (JausId, Share),
        kind: Kind,
        before: Option<&Subscriber>,
    ) -> bool {
        let before = before.map(|before| before.kind);
        (before.is_some() || self.table.of(client).count() < self.settings.per_client)
            && self.table.has_room(share, kind, before)
    }

    fn expiry(&self, now: Instant) -> Option<Instant> {
        let minutes = u64::from(self.settings.timeout);
        (minutes > 0).then(|| now + Duration::from_secs(60 * minutes))
    }

    /// Handles a change of the answer to the query with this code.
    pub(super) fn handle_change(&mut self, now: Instant, query: u16) {
        self.table.touch(now, query);
    }

    /// Removes the events of a client that is gone, as far as discovery can tell.
    pub(super) fn forget(&mut self, client: JausId) {
        self.table.remove_client(client);
        self.commands.remove_client(client);
    }

    /// Ends events that their clients have not renewed, and notifies the clients.
    pub(super) fn expire(&mut self, now: Instant, out: &mut Outbox) {
        self.expire_commands(now, out);
        for (name, ended) in self.table.take_expired(now) {
            let mut confirmed = confirmation(ended.request_id, name.1);
            set_rate(&mut confirmed, &ended);
            out.send(name.0, &confirmed);
        }
    }

    /// The next subscription whose report is due, to be [reported](Self::report_due).
    pub(super) fn poll_due(&mut self, now: Instant) -> Option<Due> {
        self.table.poll_due(now)
    }

    /// Sends a due report. `None` if the component no longer answers the query, which ends the
    /// event.
    pub(super) fn report_due(
        &mut self,
        now: Instant,
        due: &Due,
        report: Option<Bytes>,
        out: &mut Outbox,
    ) {
        let Some(report) = report else {
            if let Some(ended) = self.table.remove(due.name) {
                let reject = rejection(ended.request_id, ResponseCode::MESSAGE_NOT_SUPPORTED);
                out.send(due.name.0, &reject);
            }
            return;
        };
        self.table.reschedule(due, now, |subscription| {
            let news = matches!(subscription.kind, Kind::Periodic { .. })
                || subscription.reported.as_ref().map(|(_, last)| last) != Some(&report);
            if news {
                send(now, subscription, due.name, report, out);
            }
        });
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let commands = self.commands.poll_timeout();
        self.table.poll_timeout().into_iter().chain(commands).min()
    }

    pub(super) fn len(&self) -> usize {
        self.table.len()
    }

    /// The queries of all subscriptions, with their rates in hertz if they are periodic.
    pub(super) fn wanted(&self) -> impl Iterator<Item = (&Bytes, Option<f64>)> {
        self.table.iter().map(|it| match it.kind {
            Kind::Periodic { hertz, .. } => (&it.query, Some(hertz)),
            Kind::EveryChange { .. } => (&it.query, None),
        })
    }
}

/// The trial of a new event.
fn create(
    message: &Received,
    create: &CreateEvent,
    is_query: impl Fn(u16) -> bool,
    out: &mut Outbox,
) -> Outcome {
    let trial = Trial {
        request: message.clone(),
        request_id: create.request_id,
        event_id: None,
        kind: create.event_type.0,
        hertz: create.requested_periodic_rate_hz(),
        query: own(&create.query_message),
    };
    check(trial, is_query, out)
}

fn create_command(message: &Received, create: CreateCommandEvent, out: &mut Outbox) -> Outcome {
    let request_id = create.request_id;
    match CommandTrial::new(message, create) {
        Ok(trial) => Outcome::TryCommand(trial),
        Err(why) => {
            reject(message, request_id, why, out);
            Outcome::Done
        }
    }
}

/// A copy of a query, to free the datagram that contained it. A query that is too long is
/// truncated, and [rejected](check).
fn own(query: &Bytes) -> Bytes {
    Bytes::copy_from_slice(&query[..query.len().min(LONGEST_QUERY + 1)])
}

/// Whether two subscriptions look the same to the client.
fn is_the_same(one: &Subscriber, other: &Subscriber) -> bool {
    one.kind == other.kind && one.query == other.query
}

/// Rejects requests that are invalid whatever the services answer.
fn check(trial: Trial, is_query: impl Fn(u16) -> bool, out: &mut Outbox) -> Outcome {
    let why = match code_of(&trial.query) {
        // A client may put a command in place of the query: nothing obeys it.
        Some(code) if !is_query(code) => ResponseCode::MESSAGE_NOT_SUPPORTED,
        Some(_) if trial.query.len() > LONGEST_QUERY => ResponseCode::INVALID_EVENT_SETUP,
        // Events about events never have a report.
        Some(QueryEvents::CODE | QueryEventTimeout::CODE) => ResponseCode::MESSAGE_NOT_SUPPORTED,
        Some(_) if trial.kind == EVERY_CHANGE || (trial.kind == PERIODIC && trial.hertz > 0.0) => {
            return Outcome::Try(trial);
        }
        _ => ResponseCode::INVALID_EVENT_SETUP,
    };
    reject(&trial.request, trial.request_id, why, out);
    Outcome::Done
}

const fn type_number(kind: Kind) -> u8 {
    match kind {
        Kind::Periodic { .. } => PERIODIC,
        Kind::EveryChange { .. } => EVERY_CHANGE,
    }
}

const fn type_of(subscription: &Subscriber) -> u8 {
    type_number(subscription.kind)
}

fn confirm(
    request: &Received,
    request_id: u8,
    (_, event_id): Name,
    subscription: &Subscriber,
    out: &mut Outbox,
) {
    let mut confirm = confirmation(request_id, event_id);
    set_rate(&mut confirm, subscription);
    out.reply(request, &confirm);
}

/// A confirmation without a rate.
fn confirmation(request_id: u8, event_id: u8) -> ConfirmEventRequest {
    ConfirmEventRequest {
        request_id,
        event_id,
        ..ConfirmEventRequest::default()
    }
}

fn set_rate(confirm: &mut ConfirmEventRequest, subscription: &Subscriber) {
    if let Kind::Periodic { hertz, .. } = subscription.kind
        && let Err(error) = confirm.set_confirmed_periodic_rate_hz(hertz)
    {
        // The settings exceed the range of the field.
        tracing::debug!(%error, "rate cannot be confirmed");
    }
}

fn send(now: Instant, subscription: &mut Subscriber, name: Name, report: Bytes, out: &mut Outbox) {
    let event = Event {
        event_id: name.1,
        sequence_number: subscription.sequence,
        report_message: report.clone(),
    };
    subscription.sequence = subscription.sequence.wrapping_add(1);
    if matches!(subscription.kind, Kind::EveryChange { .. }) {
        subscription.reported = Some((now, report));
    }
    out.send(name.0, &event);
}
