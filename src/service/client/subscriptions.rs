//! All subscriptions of one component: dispatches the messages of Events, and cancels events
//! without a subscription.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use super::Rejection;
use super::news::SubscriptionNews;
use super::subscription::{Order, Subscription};
use super::topic::{CannotSubscribe, Topic};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::messages::core::{
    CancelEvent, ConfirmEventRequest, Event, RejectEventRequest, ReportEventTimeout,
};
use crate::service::{Change, Handled, Outbox, Patience, code_of, read};

/// Identifies one subscription of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SubscriptionId(u64);

/// The numbers of requests from this one on are for the application's own. Those before it are for
/// subscriptions, so that no answer is taken for that to the other.
pub(crate) const OWN_REQUESTS: u8 = 224;

/// The subscriptions of one component.
///
/// After the application's first subscription this table consumes every Event message, and cancels
/// events that belong to no subscription. Before that it ignores them.
#[derive(Debug, Default)]
pub(in crate::service) struct Subscriptions {
    last: u64,
    last_request: u8,
    alive: BTreeMap<SubscriptionId, Subscription>,
    leaving: VecDeque<Leaving>,
    news: VecDeque<(SubscriptionId, SubscriptionNews)>,
    /// When the next stray event may be cancelled.
    next_stray: Option<Instant>,
}

/// An event that is being cancelled.
#[derive(Debug)]
struct Leaving {
    peer: JausId,
    event: u8,
    request: u8,
    tries: u32,
    next: Instant,
}

impl Subscriptions {
    /// Limit of subscriptions of one component.
    const MOST: usize = 1024;
    /// Limit of subscriptions to one peer, which one octet identifies.
    const MOST_PER_PEER: usize = 200;
    /// Limit of cancellations in progress. Events beyond it are cancelled as strays when they
    /// arrive.
    const MOST_LEAVING: usize = 256;
    /// How often a Cancel Event is sent, and the pause between.
    const CANCEL_TRIES: u32 = 4;
    const CANCEL_PAUSE: Duration = Duration::from_millis(500);
    /// The shortest interval between cancellations of stray events.
    const STRAY_PAUSE: Duration = Duration::from_millis(100);

    pub(in crate::service) fn subscribe(
        &mut self,
        now: Instant,
        topic: &Topic,
        patience: Patience,
        out: &mut Outbox,
    ) -> Result<SubscriptionId, CannotSubscribe> {
        let peer = topic.peer;
        if !peer.is_unicast() {
            return Err(CannotSubscribe::NotOneComponent(peer));
        }
        if self.alive.values().any(|it| it.equals(topic)) {
            return Err(CannotSubscribe::Already);
        }
        let request = self.free_request(peer)?;
        let order = Order {
            peer,
            report: topic.report,
            when: topic.when,
            patience,
            create: topic.create_event(request)?.encode()?,
            request,
            query: topic.query.clone(),
        };
        self.last += 1;
        let id = SubscriptionId(self.last);
        self.alive.insert(id, Subscription::new(now, order, out));
        Ok(id)
    }

    /// A request number that is not in use with this peer.
    fn free_request(&mut self, peer: JausId) -> Result<u8, CannotSubscribe> {
        let to_peer = self.alive.values().filter(|it| it.peer == peer);
        let most = Self::MOST_PER_PEER.min(Self::MOST);
        if self.alive.len() >= Self::MOST || to_peer.clone().count() >= most {
            return Err(CannotSubscribe::TooMany(to_peer.count()));
        }
        let used = |request| {
            let leaving = self.leaving.iter().filter(|it| it.peer == peer);
            let mut requests = to_peer.clone().map(|it| it.request);
            requests.any(|it| it == request) || leaving.clone().any(|it| it.request == request)
        };
        let candidates = std::iter::successors(Some(self.after_last()), |it| Some(after(*it)));
        let mut candidates = candidates.take(OWN_REQUESTS.into());
        let free = candidates.find(|&request| !used(request));
        // Cancellations are few, and reusing the number of one does no harm.
        self.last_request = free.unwrap_or_else(|| self.after_last());
        Ok(self.last_request)
    }

    const fn after_last(&self) -> u8 {
        after(self.last_request)
    }

    /// Ends a subscription, and cancels its event at the peer.
    pub(in crate::service) fn unsubscribe(
        &mut self,
        now: Instant,
        id: SubscriptionId,
        out: &mut Outbox,
    ) {
        let Some(ended) = self.alive.remove(&id) else {
            return;
        };
        // An event whose number is not known yet is cancelled when it arrives.
        if let Some(event) = ended.event {
            self.leave(now, ended.peer, event, out);
        }
    }

    /// Ends all subscriptions. There will be no time to repeat the cancellations.
    pub(in crate::service) fn cancel_all(&mut self, now: Instant, out: &mut Outbox) {
        while let Some((&id, _)) = self.alive.first_key_value() {
            self.unsubscribe(now, id, out);
        }
    }

    fn leave(&mut self, now: Instant, peer: JausId, event: u8, out: &mut Outbox) {
        let known = |it: &Leaving| it.peer == peer && it.event == event;
        if self.leaving.iter().any(known) {
            return;
        }
        let request = self.after_last();
        self.last_request = request;
        if self.leaving.len() >= Self::MOST_LEAVING {
            self.leaving.pop_front();
        }
        let mut leaving = Leaving {
            peer,
            event,
            request,
            tries: 0,
            next: now,
        };
        leaving.cancel(now, out);
        self.leaving.push_back(leaving);
    }

    /// Handles a sign of life of a component.
    pub(in crate::service) fn hear(&mut self, now: Instant, peer: JausId) {
        for subscription in self.alive.values_mut().filter(|it| it.peer == peer) {
            subscription.handle_sign_of_life(now);
        }
    }

    pub(in crate::service) fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        out: &mut Outbox,
    ) -> Handled {
        if self.last == 0 {
            return Handled::No;
        }
        match code_of(&message.payload) {
            Some(Event::CODE) => {
                if let Some(event) = read(message) {
                    self.handle_event(now, message.source, event, out);
                }
                Handled::Yes
            }
            Some(ConfirmEventRequest::CODE) => {
                let confirm = read(message);
                confirm.map_or(Handled::No, |confirm| {
                    self.handle_confirm(now, message.source, &confirm, out)
                })
            }
            Some(RejectEventRequest::CODE) => {
                let rejection = Rejection::read(&message.payload);
                rejection.map_or(Handled::No, |(request, reason)| {
                    self.handle_reject(now, message.source, request, reason, out)
                })
            }
            Some(ReportEventTimeout::CODE) => {
                let report = read(message);
                report.map_or(Handled::No, |report| {
                    self.handle_lifetime(now, message.source, &report)
                })
            }
            _ => Handled::No,
        }
    }

    fn handle_lifetime(
        &mut self,
        now: Instant,
        source: JausId,
        report: &ReportEventTimeout,
    ) -> Handled {
        let lifetime = Duration::from_secs(60) * u32::from(report.timeout.0);
        let mut handled = Handled::No;
        for subscription in self.alive.values_mut().filter(|it| it.peer == source) {
            subscription.handle_lifetime(now, lifetime);
            handled = Handled::Yes;
        }
        handled
    }

    fn handle_event(&mut self, now: Instant, source: JausId, event: Event, out: &mut Outbox) {
        let mut all = self.alive.iter_mut().filter(|(_, it)| it.peer == source);
        if let Some((&id, owner)) = all.find(|(_, it)| it.owns(&event)) {
            let mut news = Vec::new();
            owner.handle_event(now, event, &mut news);
            self.tell(id, news);
            return;
        }
        let mut all = self.alive.values_mut().filter(|it| it.peer == source);
        if let Some(waiting) = all.find(|it| it.expects(&event)) {
            waiting.keep(event);
            return;
        }
        let leaving = |it: &Leaving| it.peer == source && it.event == event.event_id;
        let may = self.next_stray.is_none_or(|next| next <= now);
        // If two events share the number, this may cancel the wrong one: see `has_left`.
        if may && !self.leaving.iter().any(leaving) {
            self.next_stray = Some(now + Self::STRAY_PAUSE);
            tracing::debug!(%source, event = event.event_id, "event without a subscription");
            self.leave(now, source, event.event_id, out);
        }
    }

    fn handle_confirm(
        &mut self,
        now: Instant,
        source: JausId,
        confirm: &ConfirmEventRequest,
        out: &mut Outbox,
    ) -> Handled {
        if self.has_left(now, source, confirm.request_id) {
            return Handled::Yes;
        }
        let mut news = Vec::new();
        let mut all = self.alive.iter_mut().filter(|(_, it)| it.peer == source);
        let Some((&id, confirmed)) = all.find(|(_, it)| it.request == confirm.request_id) else {
            return Handled::No;
        };
        if confirmed.is_to_repetition(now) {
            // Some peers make an event of each repetition.
            self.leave_if_spare(now, source, confirm.event_id, out);
            return Handled::Yes;
        }
        confirmed.handle_confirm(now, confirm, &mut news);
        self.doubt_the_displaced(now, id);
        let same = |it: &&mut Leaving| it.peer == source && it.event == confirm.event_id;
        // The number is in use again: send no more cancellations. The entry stays for one more
        // pause, to match the answer to a cancellation in flight.
        self.leaving
            .iter_mut()
            .filter(same)
            .for_each(|it| it.tries = Self::CANCEL_TRIES);
        self.settle(now, id, news, out);
        Handled::Yes
    }

    /// Cancels an event that belongs to no subscription.
    fn leave_if_spare(&mut self, now: Instant, peer: JausId, event: u8, out: &mut Outbox) {
        let is_it = |it: &Subscription| it.peer == peer && it.event == Some(event);
        if !self.alive.values().any(is_it) {
            self.leave(now, peer, event, out);
        }
    }

    /// A peer that assigns a number twice has restarted and lost the event that had it first.
    fn doubt_the_displaced(&mut self, now: Instant, id: SubscriptionId) {
        let Some(confirmed) = self.alive.remove(&id) else {
            return;
        };
        let others = self.alive.values_mut();
        for displaced in others.filter(|it| it.is_displaced_by(&confirmed)) {
            displaced.doubt(now);
        }
        self.alive.insert(id, confirmed);
    }

    fn handle_reject(
        &mut self,
        now: Instant,
        source: JausId,
        request: u8,
        reason: Rejection,
        out: &mut Outbox,
    ) -> Handled {
        // An event that does not exist needs no cancellation.
        if self.has_left(now, source, request) {
            return Handled::Yes;
        }
        let mut all = self.alive.iter_mut().filter(|(_, it)| it.peer == source);
        let Some((&id, refused)) = all.find(|(_, it)| it.request == request) else {
            return Handled::No;
        };
        if refused.is_to_repetition(now) {
            return Handled::Yes;
        }
        let mut news = Vec::new();
        refused.handle_reject(now, reason, &mut news);
        self.settle(now, id, news, out);
        Handled::Yes
    }

    /// Removes an answered cancellation; returns whether there was one. If numbers are not unique,
    /// it may have hit another subscription, which is then requested again.
    fn has_left(&mut self, now: Instant, source: JausId, request: u8) -> bool {
        let found = self
            .leaving
            .iter()
            .position(|it| it.peer == source && it.request == request);
        let Some(left) = found.and_then(|found| self.leaving.remove(found)) else {
            return false;
        };
        let same = |it: &&mut Subscription| it.peer == source && it.event == Some(left.event);
        self.alive
            .values_mut()
            .filter(same)
            .for_each(|it| it.doubt(now));
        true
    }

    pub(in crate::service) fn handle_change(&mut self, now: Instant, change: &Change) {
        let (Change::Found(peer) | Change::Lost(peer, _)) = *change else {
            return;
        };
        let mut all_news = Vec::new();
        for (&id, it) in self.alive.iter_mut().filter(|(_, it)| it.peer == peer) {
            let mut news = Vec::new();
            match change {
                Change::Lost(..) => it.handle_lost_peer(now, &mut news),
                _ => it.handle_found_peer(now),
            }
            all_news.push((id, news));
        }
        for (id, news) in all_news {
            self.tell(id, news);
        }
    }

    pub(in crate::service) fn handle_timeout(&mut self, now: Instant, out: &mut Outbox) {
        let due = |(&id, it): (&SubscriptionId, &Subscription)| {
            let due = it.poll_timeout().is_some_and(|due| due <= now);
            due.then_some(id)
        };
        let due: Vec<_> = self.alive.iter().filter_map(due).collect();
        for id in due {
            let mut news = Vec::new();
            if let Some(it) = self.alive.get_mut(&id) {
                it.handle_timeout(now, &mut news, out);
            }
            self.settle(now, id, news, out);
        }
        for leaving in self.leaving.iter_mut().filter(|it| it.next <= now) {
            leaving.cancel(now, out);
        }
        self.leaving.retain(|it| it.tries <= Self::CANCEL_TRIES);
    }

    pub(in crate::service) fn poll_timeout(&self) -> Option<Instant> {
        let alive = self.alive.values().filter_map(Subscription::poll_timeout);
        alive.chain(self.leaving.iter().map(|it| it.next)).min()
    }

    pub(in crate::service) fn poll_news(&mut self) -> Option<(SubscriptionId, SubscriptionNews)> {
        self.news.pop_front()
    }

    /// Queues the news, and cancels the event of a subscription that has ended.
    fn settle(
        &mut self,
        now: Instant,
        id: SubscriptionId,
        news: Vec<SubscriptionNews>,
        out: &mut Outbox,
    ) {
        if matches!(news.last(), Some(SubscriptionNews::Ended(_))) {
            self.unsubscribe(now, id, out);
        }
        self.tell(id, news);
    }

    fn tell(&mut self, id: SubscriptionId, news: Vec<SubscriptionNews>) {
        self.news.extend(news.into_iter().map(|news| (id, news)));
    }
}

/// The number of the request after this one.
const fn after(request: u8) -> u8 {
    (request + 1) % OWN_REQUESTS
}

impl Leaving {
    fn cancel(&mut self, now: Instant, out: &mut Outbox) {
        self.tries += 1;
        self.next = now + Subscriptions::CANCEL_PAUSE;
        if self.tries <= Subscriptions::CANCEL_TRIES {
            let cancel = CancelEvent {
                request_id: self.request,
                event_id: self.event,
            };
            out.send(self.peer, &cancel);
        }
    }
}
