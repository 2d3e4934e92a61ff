//! One subscription: the event of a peer that repeats a report. It is created, renewed, and created
//! again after an outage, until the application ends it.

#[cfg(test)]
mod tests;

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::Rejection;
use super::news::{Outage, SubscriptionEnd, SubscriptionNews};
use super::topic::{Topic, When};
use crate::address::JausId;
use crate::messages::core::{ConfirmEventRequest, Event, QueryEventTimeout};
use crate::service::{NoAnswer, Outbox, Patience, code_of};

/// State of a subscription.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Not yet confirmed.
    New,
    Up,
    Down,
}

/// The state machine of one subscription.
#[derive(Debug)]
pub(super) struct Subscription {
    pub(super) peer: JausId,
    /// The code of the expected report.
    report: u16,
    when: When,
    patience: Patience,
    /// The Create Event message. It never changes, so that a peer can recognise a retransmission.
    create: Bytes,
    pub(super) request: u8,
    query: Bytes,
    state: State,
    /// The peer's number of the event.
    pub(super) event: Option<u8>,
    hz: Option<f64>,
    /// Requests since the last answer, and when the first of them was sent.
    first_asked: Instant,
    asked: u32,
    /// How long the peer took for its last answer, at most.
    latency: Duration,
    /// Answers that may still come to repeated requests, and until when. Each may be to another event.
    owed: (u32, Instant),
    last_asked: Instant,
    /// When to send the next request: the first one, a repetition, or a renewal.
    next_ask: Option<Instant>,
    /// How long the peer keeps an event that is not renewed, once reported. Zero means for ever.
    lifetime: Option<Duration>,
    /// How often the peer was asked for its lifetime.
    lifetime_asked: u32,
    /// Time of the last sign of the event.
    heard: Instant,
    /// When the peer first confirmed the event, or another rate for it.
    begun: Instant,
    /// Time of the peer's last message of any kind.
    peer_heard: Instant,
    /// The sequence number of the last report since the last confirmation.
    sequence: Option<u8>,
    /// An event that arrived before its confirmation.
    early: Option<Event>,
    /// The last report on change.
    last: Option<Bytes>,
    /// Whether the event was renewed since the last report, so that the peer repeats that report.
    renewed: bool,
}

/// The parameters of a new [`Subscription`].
pub(super) struct Order {
    pub(super) peer: JausId,
    pub(super) report: u16,
    pub(super) when: When,
    pub(super) patience: Patience,
    pub(super) create: Bytes,
    pub(super) request: u8,
    pub(super) query: Bytes,
}

impl Subscription {
    /// The longest interval between renewals of an event on change. It bounds how late a restart of
    /// the peer is detected if nothing else shows it. It is a third of the shortest lifetime of
    /// events in version 1.1, which is given in whole minutes.
    const REFRESH: Duration = Duration::from_secs(20);
    /// How often a peer is asked for the lifetime of its events. Version 1.0 does not have this
    /// query.
    const LIFETIME_TRIES: u32 = 3;
    /// A periodic event is down when this many periods have brought no report …
    const SILENT_PERIODS: f64 = 4.0;
    /// … but not earlier than this after its last report …
    const LEAST_SILENCE: Duration = Duration::from_millis(500);
    /// … nor earlier than this after its first confirmation: JAUS++ sends a first report at once,
    /// and starts its periods some time later.
    const SETTLING: Duration = Duration::from_secs(2);
    /// How far sequence numbers may run ahead of the rate: JAUS++ sends at the fastest rate of all
    /// clients. A larger gap means that the peer has restarted its numbering.
    const UNEXPLAINED: f64 = 16.0;
    /// The longest pause between two attempts to restore an event.
    const LONGEST_PAUSE: Duration = Duration::from_secs(5);
    /// A peer that sends a message after this much silence may have been away.
    const ABSENCE: Duration = Duration::from_secs(1);

    pub(super) fn new(now: Instant, order: Order, out: &mut Outbox) -> Self {
        let mut new = Self {
            peer: order.peer,
            report: order.report,
            when: order.when,
            patience: order.patience,
            create: order.create,
            request: order.request,
            query: order.query,
            state: State::New,
            event: None,
            hz: None,
            first_asked: now,
            asked: 0,
            latency: Duration::ZERO,
            owed: (0, now),
            last_asked: now,
            next_ask: None,
            lifetime: None,
            lifetime_asked: 0,
            heard: now,
            begun: now,
            peer_heard: now,
            sequence: None,
            early: None,
            last: None,
            renewed: false,
        };
        new.ask(now, out);
        new
    }

    /// Whether this subscription waits for a confirmation, which an event with such a report may
    /// have overtaken.
    pub(super) fn expects(&self, event: &Event) -> bool {
        self.asked > 0 && code_of(&event.report_message) == Some(self.report)
    }

    /// Whether an event belongs to this subscription. Its number alone does not tell: JAUS++
    /// numbers events separately for each query.
    pub(super) fn owns(&self, event: &Event) -> bool {
        self.event == Some(event.event_id) && code_of(&event.report_message) == Some(self.report)
    }

    /// Whether a peer would treat the two as the same event.
    pub(super) fn equals(&self, topic: &Topic) -> bool {
        let same_type = matches!(
            (self.when, topic.when),
            (When::OnChange, When::OnChange) | (When::Periodic { .. }, When::Periodic { .. })
        );
        same_type && self.peer == topic.peer && self.query == topic.query
    }

    /// Whether the peer has just given this subscription's event number to `other`, so that only
    /// one of the two events can exist.
    pub(super) fn is_displaced_by(&self, other: &Self) -> bool {
        self.peer == other.peer
            && code_of(&self.query) == code_of(&other.query)
            && self.event.is_some()
            && self.event == other.event
    }

    /// Requests the event again: the peer has given its number to another event, or may have
    /// cancelled it together with another event.
    pub(super) fn doubt(&mut self, now: Instant) {
        self.event = None;
        // A peer that gives every event the same number must not cause endless requests.
        self.next_ask = Some(now.max(self.last_asked + self.pause()));
    }

    /// Whether an answer is one to a repetition of a request that was answered before.
    pub(super) fn is_to_repetition(&mut self, now: Instant) -> bool {
        let (count, until) = self.owed;
        let is_owed = self.asked == 0 && self.event.is_some() && count > 0 && now < until;
        self.owed.0 -= u32::from(is_owed);
        is_owed
    }

    /// Notes an answer to a request. Each of its repetitions may be answered, too.
    fn handle_answer(&mut self, now: Instant) {
        if self.asked > 0 {
            // After an outage it tells how long that lasted.
            if self.asked <= self.patience.tries {
                self.latency = now.saturating_duration_since(self.first_asked);
            }
            let until = self.last_asked + self.latency.max(self.patience.interval) * 2;
            self.owed = (self.asked - 1, until);
        }
        self.asked = 0;
    }

    /// How long to wait for an answer before the request is repeated.
    fn pause(&self) -> Duration {
        let usual = self.latency.saturating_mul(3) / 2;
        self.patience.interval.max(usual.min(Self::LONGEST_PAUSE))
    }

    pub(super) fn handle_confirm(
        &mut self,
        now: Instant,
        confirm: &ConfirmEventRequest,
        news: &mut Vec<SubscriptionNews>,
    ) {
        let confirmed = match self.when {
            When::Periodic { hz, .. } => {
                let confirmed = confirm.confirmed_periodic_rate_hz();
                Some(if confirmed > 0.0 { confirmed } else { hz })
            }
            When::OnChange => None,
        };
        self.renewed = self.state == State::Up;
        let unasked = self.asked == 0;
        let is_news = self.state != State::Up || self.hz != confirmed;
        self.state = State::Up;
        self.event = Some(confirm.event_id);
        self.hz = confirmed;
        self.handle_answer(now);
        self.heard = now;
        self.sequence = None;
        self.next_ask = self.refresh().map(|pause| now + pause);
        if unasked {
            // A duplicate, or the peer's notice that the event has ended because it was not
            // renewed.
            self.next_ask = Some(now.max(self.last_asked + self.pause()));
        }
        if let Some(end) = self.too_slow() {
            news.push(SubscriptionNews::Ended(end));
            return;
        }
        if is_news {
            self.begun = now;
            news.push(SubscriptionNews::Up { hz: confirmed });
        }
        let early = self.early.take();
        if let Some(early) = early.filter(|early| early.event_id == confirm.event_id) {
            self.handle_event(now, early, news);
        }
    }

    /// The interval between renewals. A periodic event needs none unless the peer lets it expire:
    /// silence shows its end, and a renewal causes an extra report.
    fn refresh(&self) -> Option<Duration> {
        let forgotten = self.lifetime.filter(|lifetime| !lifetime.is_zero());
        let third = forgotten.map(|lifetime| lifetime / 3);
        match self.when {
            When::Periodic { .. } => third,
            When::OnChange => Some(third.map_or(Self::REFRESH, |third| third.min(Self::REFRESH))),
        }
    }

    /// Handles the peer's report of how long it keeps an event that is not renewed.
    pub(super) fn handle_lifetime(&mut self, now: Instant, lifetime: Duration) {
        self.lifetime = Some(lifetime);
        if self.state == State::Up && self.asked == 0 {
            self.next_ask = self.refresh().map(|pause| now + pause);
        }
    }

    fn too_slow(&self) -> Option<SubscriptionEnd> {
        let (When::Periodic { least_hz, .. }, Some(hz)) = (self.when, self.hz) else {
            return None;
        };
        // The wire carries rates in steps of 1092/65535 Hz.
        let slow = hz < least_hz - 1092.0 / 65535.0;
        slow.then_some(SubscriptionEnd::TooSlow { hz, least_hz })
    }

    pub(super) fn handle_reject(
        &mut self,
        now: Instant,
        reason: Rejection,
        news: &mut Vec<SubscriptionNews>,
    ) {
        match self.state {
            State::New => news.push(SubscriptionNews::Ended(SubscriptionEnd::Rejected(reason))),
            State::Up => self.fall(now, Outage::Refused(reason), news),
            State::Down => {
                self.asked = 0;
                self.next_ask = Some(now + Self::LONGEST_PAUSE);
            }
        }
    }

    pub(super) fn handle_event(
        &mut self,
        now: Instant,
        event: Event,
        news: &mut Vec<SubscriptionNews>,
    ) {
        let ahead = self
            .sequence
            .map(|last| event.sequence_number.wrapping_sub(last));
        if ahead.is_some_and(|ahead| ahead == 0 || ahead > u8::MAX / 2) {
            // A duplicate, or overtaken by a newer report. Or it belongs to another event to which
            // a restarted peer gave this number, and is no sign of this one.
            return;
        }
        let lost = ahead.map_or(0, |ahead| self.lost(now, ahead));
        self.heard = now;
        self.sequence = Some(event.sequence_number);
        if self.state == State::Down {
            // Only the network was down.
            self.state = State::Up;
            self.next_ask = Some(now);
            news.push(SubscriptionNews::Up { hz: self.hz });
        }
        if self.when == When::OnChange {
            let last = self.last.replace(event.report_message.clone());
            let known = last.is_some_and(|last| last == event.report_message);
            if std::mem::take(&mut self.renewed) && known {
                return;
            }
        }
        news.push(SubscriptionNews::Report {
            report: event.report_message,
            lost,
        });
    }

    /// Keeps an event that may have overtaken its confirmation.
    pub(super) fn keep(&mut self, event: Event) {
        self.early = Some(event);
    }

    pub(super) fn handle_lost_peer(&mut self, now: Instant, news: &mut Vec<SubscriptionNews>) {
        if self.state == State::Up {
            self.fall(now, Outage::PeerLost, news);
        }
    }

    pub(super) fn handle_found_peer(&mut self, now: Instant) {
        if self.state == State::Down {
            self.asked = 0;
            self.next_ask = Some(now);
        }
    }

    /// Handles any message from the peer. If the peer was silent before, the next request is sent
    /// at once. Only then, because a peer may send all the time without answering.
    pub(super) fn handle_sign_of_life(&mut self, now: Instant) {
        let silence = now.saturating_duration_since(self.peer_heard);
        self.peer_heard = now;
        if self.state == State::Down && silence >= Self::ABSENCE {
            self.next_ask = self.next_ask.map(|next| next.min(now));
        }
    }

    pub(super) fn handle_timeout(
        &mut self,
        now: Instant,
        news: &mut Vec<SubscriptionNews>,
        out: &mut Outbox,
    ) {
        if self.silent_at().is_some_and(|silent| silent <= now) {
            self.fall(now, Outage::Silent, news);
        }
        if self.next_ask.is_none_or(|next| next > now) {
            return;
        }
        let exhausted = self.asked >= self.patience.tries.max(1);
        match self.state {
            State::New if exhausted => {
                let no_answer = NoAnswer {
                    peer: self.peer,
                    tries: self.asked,
                    waited: now.saturating_duration_since(self.first_asked),
                };
                news.push(SubscriptionNews::Ended(SubscriptionEnd::NoAnswer(
                    no_answer,
                )));
                return;
            }
            // Periodic reports that still arrive are confirmation enough.
            State::Up if exhausted && self.hz.is_none() => {
                self.fall(now, Outage::Unconfirmed, news);
            }
            _ => {}
        }
        self.ask(now, out);
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.silent_at().into_iter().chain(self.next_ask).min()
    }

    /// When a periodic event will have been silent for too long.
    fn silent_at(&self) -> Option<Instant> {
        let hz = self.hz.filter(|_| self.state == State::Up)?;
        let periods = Duration::try_from_secs_f64(Self::SILENT_PERIODS / hz).ok()?;
        let silent = self.heard.checked_add(periods.max(Self::LEAST_SILENCE))?;
        Some(silent.max(self.begun + Self::SETTLING))
    }

    /// The number of lost reports if the next sequence number is `ahead` of the last one. 0 if the
    /// rate cannot explain that many, because then the peer has restarted its numbering.
    fn lost(&self, now: Instant, ahead: u8) -> u8 {
        let passed = now.saturating_duration_since(self.heard).as_secs_f64();
        let explained = self.hz.map(|hz| hz * passed * 1.25 + Self::UNEXPLAINED);
        match explained {
            Some(most) if f64::from(ahead) > most => 0,
            _ => ahead - 1,
        }
    }

    fn fall(&mut self, now: Instant, why: Outage, news: &mut Vec<SubscriptionNews>) {
        let refused = matches!(why, Outage::Refused(_));
        self.state = State::Down;
        self.asked = 0;
        self.next_ask = Some(if refused {
            now + Self::LONGEST_PAUSE
        } else {
            now
        });
        let since = self.heard;
        news.push(SubscriptionNews::Down { since, why });
    }

    /// Requests the event. A peer that already has it takes the request as a renewal.
    fn ask(&mut self, now: Instant, out: &mut Outbox) {
        if self.lifetime.is_none() && self.lifetime_asked < Self::LIFETIME_TRIES {
            self.lifetime_asked += 1;
            out.send(self.peer, &QueryEventTimeout {});
        }
        out.send_octets(self.peer, self.create.clone());
        let pause = match self.state {
            State::New => self.patience.interval,
            // Exponential backoff, to spare a peer that does not answer.
            State::Up | State::Down => self
                .pause()
                .saturating_mul(1 << self.asked.min(8))
                .min(Self::LONGEST_PAUSE),
        };
        if self.asked == 0 {
            self.first_asked = now;
        }
        self.asked = self.asked.saturating_add(1);
        self.last_asked = now;
        self.next_ask = Some(now + pause);
    }
}
