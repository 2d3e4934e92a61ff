//! One subscription: the event of a peer that brings a report again and again. It is created,
//! renewed, found to be down and created again, until the application has had enough of it.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::Rejection;
use super::news::{Outage, SubscriptionEnd, SubscriptionNews};
use super::topic::{Topic, When};
use crate::address::JausId;
use crate::messages::core::{ConfirmEventRequest, Event, QueryEventTimeout};
use crate::service::{NoAnswer, Outbox, Patience, code_of};

/// Where a subscription stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Never confirmed yet.
    New,
    Up,
    Down,
}

/// The state machine of one subscription.
#[derive(Debug)]
pub(super) struct Subscription {
    pub(super) peer: JausId,
    /// The code of the report that is waited for.
    report: u16,
    when: When,
    patience: Patience,
    /// The Create Event, always the same, so that a peer can tell a repetition.
    create: Bytes,
    pub(super) request: u8,
    query: Bytes,
    state: State,
    /// The number that the peer gave to the event.
    pub(super) event: Option<u8>,
    hz: Option<f64>,
    first_asked: Instant,
    /// Requests without an answer so far.
    asked: u32,
    last_asked: Instant,
    /// When to ask, be it for the first time, in vain, or to renew what is there.
    next_ask: Option<Instant>,
    /// How long the peer keeps an event that nobody renews, once it has told; zero is for ever.
    lifetime: Option<Duration>,
    /// How often it was asked for that.
    lifetime_asked: u32,
    /// When the last sign of the event came.
    heard: Instant,
    /// When the peer first confirmed the event, or another rate for it.
    begun: Instant,
    /// When the peer said anything last.
    peer_heard: Instant,
    /// The last report's number, since the last confirmation.
    sequence: Option<u8>,
    /// An event that came before its confirmation.
    early: Option<Event>,
    /// The last report on change.
    last: Option<Bytes>,
    /// Whether the event was renewed since, which brings the last report once more.
    renewed: bool,
}

/// What a new [`Subscription`] is made of.
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
    /// The longest time between two renewals of what is sent on change: so late a restart of the
    /// peer is noticed that nobody else has noticed. Events of version 1.1 end after a time that is
    /// told in whole minutes; it is a third of the shortest.
    const REFRESH: Duration = Duration::from_secs(20);
    /// How often a peer is asked how long its events last. Version 1.0 does not know the question.
    const LIFETIME_TRIES: u32 = 3;
    /// A periodic event is down when so many periods have brought nothing …
    const SILENT_PERIODS: f64 = 4.0;
    /// … but not sooner than this after its last report.
    const LEAST_SILENCE: Duration = Duration::from_millis(500);
    /// … nor sooner than this after it was first confirmed: JAUS++ sends a first report at once, and begins
    /// with its periods some time later.
    const SETTLING: Duration = Duration::from_secs(2);
    /// Numbers may be so far ahead of what the rate explains: JAUS++ sends at the fastest rate of all
    /// clients. A greater gap is another numbering.
    const UNEXPLAINED: f64 = 16.0;
    /// The longest pause between two attempts to bring an event back.
    const LONGEST_PAUSE: Duration = Duration::from_secs(5);
    /// A peer that says something after so long a silence may have been away.
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

    /// Whether this subscription waits for a confirmation that an event with such a report may be
    /// ahead of.
    pub(super) fn expects(&self, event: &Event) -> bool {
        self.asked > 0 && code_of(&event.report_message) == Some(self.report)
    }

    /// Whether an event is this subscription's. Its number alone does not say so: JAUS++ counts
    /// them anew for each query.
    pub(super) fn owns(&self, event: &Event) -> bool {
        self.event == Some(event.event_id) && code_of(&event.report_message) == Some(self.report)
    }

    /// Whether a peer that tells its events apart would take the two for the same.
    pub(super) fn equals(&self, topic: &Topic) -> bool {
        let same_type = matches!(
            (self.when, topic.when),
            (When::OnChange, When::OnChange) | (When::Periodic { .. }, When::Periodic { .. })
        );
        same_type && self.peer == topic.peer && self.query == topic.query
    }

    /// Whether this subscription's event and the one that `other` was just told cannot both be
    /// there.
    pub(super) fn is_displaced_by(&self, other: &Self) -> bool {
        self.peer == other.peer
            && code_of(&self.query) == code_of(&other.query)
            && self.event.is_some()
            && self.event == other.event
    }

    /// The peer has given this event's number to another one, or may have cancelled it with that.
    pub(super) fn doubt(&mut self, now: Instant) {
        self.event = None;
        // A peer that gives everything the same number is not to be asked without end.
        self.next_ask = Some(now.max(self.last_asked + self.patience.interval));
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
        self.asked = 0;
        self.heard = now;
        self.sequence = None;
        self.next_ask = self.refresh().map(|pause| now + pause);
        if unasked {
            // It was sent twice; or it says that the event has ended, because it was not renewed.
            self.next_ask = Some(now.max(self.last_asked + self.patience.interval));
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

    /// The time between two renewals. What is periodic needs none unless its peer forgets: silence
    /// tells that it has ended, and a renewal brings a report that is out of turn.
    fn refresh(&self) -> Option<Duration> {
        let forgotten = self.lifetime.filter(|lifetime| !lifetime.is_zero());
        let third = forgotten.map(|lifetime| lifetime / 3);
        match self.when {
            When::Periodic { .. } => third,
            When::OnChange => Some(third.map_or(Self::REFRESH, |third| third.min(Self::REFRESH))),
        }
    }

    /// The peer has told how long it keeps an event that nobody renews.
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
            // It was sent twice, or overtaken by a newer one; or it is another event's that a
            // restarted peer gives the number to, and is no sign of this one.
            return;
        }
        let lost = ahead.map_or(0, |ahead| self.lost(now, ahead));
        self.heard = now;
        self.sequence = Some(event.sequence_number);
        if self.state == State::Down {
            // It was only the network.
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

    /// Keeps an event whose confirmation may be still to come.
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

    /// The peer has said something, whatever it was: if it was silent, it is asked at once rather
    /// than when the next attempt is due. Only then, for a peer may talk all the time and not answer.
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
            // Periodic reports that come are confirmation enough.
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

    /// When a periodic event has been silent for too long.
    fn silent_at(&self) -> Option<Instant> {
        let hz = self.hz.filter(|_| self.state == State::Up)?;
        let periods = Duration::try_from_secs_f64(Self::SILENT_PERIODS / hz).ok()?;
        let silent = self.heard.checked_add(periods.max(Self::LEAST_SILENCE))?;
        Some(silent.max(self.begun + Self::SETTLING))
    }

    /// How many reports were lost if the next one's number is so far ahead: none if there cannot have
    /// been so many, because the peer counts anew.
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

    /// Asks for the event; a peer that has it already takes it for a renewal.
    fn ask(&mut self, now: Instant, out: &mut Outbox) {
        if self.lifetime.is_none() && self.lifetime_asked < Self::LIFETIME_TRIES {
            self.lifetime_asked += 1;
            out.send(self.peer, &QueryEventTimeout {});
        }
        out.send_octets(self.peer, self.create.clone());
        let pause = match self.state {
            State::New => self.patience.interval,
            // Ever longer, so that whoever does not answer is not pestered.
            State::Up | State::Down => self
                .patience
                .interval
                .saturating_mul(1 << self.asked.min(8))
                .min(Self::LONGEST_PAUSE),
        };
        self.asked = self.asked.saturating_add(1);
        self.last_asked = now;
        self.next_ask = Some(now + pause);
    }
}
