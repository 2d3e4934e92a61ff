//! An event producer that imitates known peers: some number their events per query, some create a
//! duplicate event, some drop an event that is not renewed.

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Outgoing, Received};
use jaus::messages::core::{
    CancelEvent, ConfirmEventRequest, CreateEvent, Event, QueryEventTimeout, RejectEventRequest,
    ReportEventTimeout, create_event,
};

use crate::sim::{Event as EndpointEvent, OwnedEndpoint, Owner, Random};

/// A peer's treatment of events.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Habits {
    /// It numbers events per query, like JAUS++.
    numbers_by_query: bool,
    /// It treats a repeated Create Event as a new one.
    pub(crate) multiplies: bool,
    /// It drops an event that is not renewed for a minute, as version 1.1 does.
    forgets: bool,
}

impl Habits {
    pub(crate) fn choose(random: &mut Random) -> Self {
        // No known peer does both: a client that cancels an event with a duplicate id and
        // re-creates the other one would loop forever.
        let numbers_by_query = random.happens(300);
        Self {
            numbers_by_query,
            multiplies: !numbers_by_query && random.happens(300),
            forgets: random.happens(500),
        }
    }
}

pub(crate) struct Producer {
    id: JausId,
    habits: Habits,
    running: Vec<Running>,
}

struct Running {
    client: JausId,
    query: Bytes,
    number: u8,
    sequence: u8,
    kind: create_event::EventType,
    period: Duration,
    next: Instant,
    renewed: Instant,
}

impl Producer {
    /// How long a producer that `forgets` keeps an event.
    const LIFETIME: Duration = Duration::from_secs(60);
    /// Interval between changes, for subscriptions on change.
    const CHANGE: Duration = Duration::from_secs(3);

    pub(crate) const fn new(id: JausId, habits: Habits) -> Self {
        Self {
            id,
            habits,
            running: Vec::new(),
        }
    }

    /// Number of a client's events.
    pub(crate) fn events_of(&self, client: JausId) -> usize {
        self.running.iter().filter(|it| it.client == client).count()
    }

    fn say<M: Message>(&self, endpoint: &mut OwnedEndpoint, now: Instant, to: JausId, message: &M) {
        let payload = message.encode().expect("a message");
        // The client may be gone, or there may be no route to it yet.
        let _ = endpoint.send(now, Outgoing::new(self.id, to, payload));
    }

    fn create(
        &mut self,
        now: Instant,
        endpoint: &mut OwnedEndpoint,
        from: JausId,
        create: &CreateEvent,
    ) {
        let same = |it: &&mut Running| {
            it.client == from && it.kind == create.event_type && it.query == create.query_message
        };
        let known = self.running.iter_mut().find(same);
        let number = match known.filter(|_| !self.habits.multiplies) {
            Some(known) => {
                known.renewed = now;
                known.period = period(create);
                known.number
            }
            None => self.begin(now, from, create),
        };
        let mut confirm = ConfirmEventRequest {
            request_id: create.request_id,
            event_id: number,
            ..ConfirmEventRequest::default()
        };
        let hz = create.requested_periodic_rate_hz();
        let set = confirm.set_confirmed_periodic_rate_hz(hz);
        set.expect("a rate that was asked for");
        self.say(endpoint, now, from, &confirm);
    }

    fn begin(&mut self, now: Instant, client: JausId, create: &CreateEvent) -> u8 {
        let rival = |it: &&Running| {
            !self.habits.numbers_by_query || it.query[..2] == create.query_message[..2]
        };
        let taken = |number: &u8| {
            self.running
                .iter()
                .filter(rival)
                .any(|it| it.number == *number)
        };
        let number = (0..=u8::MAX)
            .find(|number| !taken(number))
            .unwrap_or(u8::MAX);
        self.running.push(Running {
            client,
            query: create.query_message.clone(),
            number,
            sequence: 0,
            kind: create.event_type,
            period: period(create),
            next: now,
            renewed: now,
        });
        number
    }

    fn cancel(
        &mut self,
        now: Instant,
        endpoint: &mut OwnedEndpoint,
        from: JausId,
        cancel: &CancelEvent,
    ) {
        let same = |it: &Running| it.client == from && it.number == cancel.event_id;
        let request_id = cancel.request_id;
        match self.running.iter().position(same) {
            Some(found) => {
                self.running.remove(found);
                let confirm = ConfirmEventRequest {
                    request_id,
                    event_id: cancel.event_id,
                    ..ConfirmEventRequest::default()
                };
                self.say(endpoint, now, from, &confirm);
            }
            None => {
                let reject = RejectEventRequest {
                    request_id,
                    response_code: Some(6.into()),
                    error_message: None,
                };
                self.say(endpoint, now, from, &reject);
            }
        }
    }
}

fn period(create: &CreateEvent) -> Duration {
    match create.event_type {
        create_event::EventType::PERIODIC_SC => {
            Duration::from_secs_f64(1.0 / create.requested_periodic_rate_hz())
        }
        _ => Producer::CHANGE,
    }
}

impl Owner for Producer {
    fn handle_event(&mut self, now: Instant, endpoint: &mut OwnedEndpoint, event: EndpointEvent) {
        let EndpointEvent::Received(Received {
            source, payload, ..
        }) = event
        else {
            return;
        };
        if let Ok(create) = CreateEvent::decode(&payload) {
            self.create(now, endpoint, source, &create);
        } else if let Ok(cancel) = CancelEvent::decode(&payload) {
            self.cancel(now, endpoint, source, &cancel);
        } else if self.habits.forgets && QueryEventTimeout::decode(&payload).is_ok() {
            let report = ReportEventTimeout { timeout: 1.into() };
            self.say(endpoint, now, source, &report);
        }
    }

    fn handle_timeout(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        let forgets = self.habits.forgets;
        self.running
            .retain(|it| !forgets || now < it.renewed + Self::LIFETIME);
        let mut due = Vec::new();
        for running in self.running.iter_mut().filter(|it| it.next <= now) {
            running.next += running.period;
            let mut report = running.query.to_vec();
            // From a query's code to its report's: 2402h to 4402h.
            report[1] += 0x20;
            // Makes each report different.
            report.push(running.sequence);
            let event = Event {
                event_id: running.number,
                sequence_number: running.sequence,
                report_message: report.into(),
            };
            running.sequence = running.sequence.wrapping_add(1);
            due.push((running.client, event));
        }
        for (client, event) in due {
            self.say(endpoint, now, client, &event);
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let next = |it: &Running| match self.habits.forgets {
            true => it.next.min(it.renewed + Self::LIFETIME),
            false => it.next,
        };
        self.running.iter().map(next).min()
    }
}
