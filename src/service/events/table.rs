//! The table of subscriptions by client and number, indexed by due time, expiry and query, so that
//! no lookup scans all of them.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus_limits::Shares;

use crate::address::JausId;
use crate::service::code_of;
use crate::service::share::Share;

/// The client and its event number.
pub(super) type Name = (JausId, u8);

/// When a subscription's reports are sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Periodic {
        hertz: f64,
        period: Duration,
    },
    /// With at least this pause between two reports.
    EveryChange {
        pause: Duration,
    },
}

impl Kind {
    /// The number of reports in 1000 seconds; 0 for events on change, which have no fixed rate.
    fn reports(self) -> usize {
        match self {
            Self::Periodic { hertz, .. } => in_1000_seconds(hertz),
            Self::EveryChange { .. } => 0,
        }
    }
}

/// A rate in units of 0.001 Hz.
fn in_1000_seconds(hertz: f64) -> usize {
    (hertz * 1000.0).round() as usize
}

#[derive(Debug)]
pub(super) struct Subscriber {
    pub(super) kind: Kind,
    pub(super) query: Bytes,
    pub(super) sequence: u8,
    /// For events on change, the last report and its time.
    pub(super) reported: Option<(Instant, Bytes)>,
    /// When the next report is due; `None` while there is no change to report.
    pub(super) next: Option<Instant>,
    pub(super) expires: Option<Instant>,
    /// The number of the request that last set it up.
    pub(super) request_id: u8,
    /// The share of the network address that it counts against.
    pub(super) share: Share,
}

/// A report that is due.
#[derive(Debug)]
pub(in crate::service) struct Due {
    pub(super) name: Name,
    when: Instant,
    pub(in crate::service) query: Bytes,
}

impl Due {
    pub(in crate::service) const fn client(&self) -> JausId {
        self.name.0
    }
}

impl Subscriber {
    /// The earliest time from `now` on at which a change may be reported.
    fn after_its_pause(&self, now: Instant) -> Instant {
        match (self.kind, &self.reported) {
            (Kind::EveryChange { pause }, Some((reported, _))) => now.max(*reported + pause),
            _ => now,
        }
    }
}

#[derive(Debug)]
pub(super) struct Table {
    subscriptions: BTreeMap<Name, Subscriber>,
    due: BTreeSet<(Instant, Name)>,
    expiring: BTreeSet<(Instant, Name)>,
    /// Events on change, by the code of their query.
    by_query: BTreeSet<(u16, Name)>,
    shares: Shares<Share>,
    /// Reports of periodic events, in 1000 seconds.
    rates: Shares<Share>,
}

impl Table {
    /// A table with limits of entries and of reports per second for one network address.
    pub(super) fn new(most: usize, reports_per_second: f64) -> Self {
        Self {
            subscriptions: BTreeMap::new(),
            due: BTreeSet::new(),
            expiring: BTreeSet::new(),
            by_query: BTreeSet::new(),
            shares: Shares::new(most),
            rates: Shares::new(in_1000_seconds(reports_per_second)),
        }
    }

    /// Whether a network address may have one more event of a kind, in place of `before` if given.
    pub(super) fn has_room(&self, share: Share, kind: Kind, before: Option<Kind>) -> bool {
        let freed = before.map_or(0, Kind::reports);
        let more = kind.reports().saturating_sub(freed);
        (before.is_some() || self.shares.has_room(share, 1))
            && (more == 0 || self.rates.has_room(share, more))
    }

    pub(super) fn len(&self) -> usize {
        self.subscriptions.len()
    }

    /// All subscriptions.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Subscriber> {
        self.subscriptions.values()
    }

    pub(super) fn get(&self, name: Name) -> Option<&Subscriber> {
        self.subscriptions.get(&name)
    }

    /// The subscriptions of one client, in order of their numbers.
    pub(super) fn of(&self, client: JausId) -> impl Iterator<Item = (u8, &Subscriber)> {
        self.subscriptions
            .range((client, 0)..=(client, u8::MAX))
            .map(|(name, subscription)| (name.1, subscription))
    }

    /// The number of a client's event of this type with exactly this query.
    pub(super) fn find(&self, client: JausId, kind: u8, query: &[u8]) -> Option<u8> {
        self.of(client)
            .find(|(_, it)| super::type_of(it) == kind && it.query == query)
            .map(|(id, _)| id)
    }

    /// The lowest number that a client does not use. 0 comes last, because it means "none" to some
    /// peers.
    pub(super) fn free_id(&self, client: JausId, taken: impl Fn(Name) -> bool) -> Option<u8> {
        (1..=u8::MAX)
            .chain([0])
            .map(|id| (client, id))
            .find(|name| !self.subscriptions.contains_key(name) && !taken(*name))
            .map(|(_, id)| id)
    }

    /// Inserts a subscription, in place of any other with that name.
    pub(super) fn insert(&mut self, name: Name, subscription: Subscriber) {
        self.remove(name);
        if let Some(next) = subscription.next {
            self.due.insert((next, name));
        }
        if let Some(expires) = subscription.expires {
            self.expiring.insert((expires, name));
        }
        if matches!(subscription.kind, Kind::EveryChange { .. }) {
            self.by_query
                .extend(code_of(&subscription.query).map(|code| (code, name)));
        }
        self.shares.take(subscription.share, 1);
        self.rates
            .take(subscription.share, subscription.kind.reports());
        self.subscriptions.insert(name, subscription);
    }

    pub(super) fn remove(&mut self, name: Name) -> Option<Subscriber> {
        let gone = self.subscriptions.remove(&name)?;
        self.shares.give_back(gone.share, 1);
        self.rates.give_back(gone.share, gone.kind.reports());
        if let Some(next) = gone.next {
            self.due.remove(&(next, name));
        }
        if let Some(expires) = gone.expires {
            self.expiring.remove(&(expires, name));
        }
        if let Some(code) = code_of(&gone.query) {
            self.by_query.remove(&(code, name));
        }
        Some(gone)
    }

    pub(super) fn remove_client(&mut self, client: JausId) {
        let ids: Vec<u8> = self.of(client).map(|(id, _)| id).collect();
        for id in ids {
            self.remove((client, id));
        }
    }

    /// Renews a client's events.
    pub(super) fn renew(&mut self, client: JausId, expires: Option<Instant>) {
        for (name, subscription) in self
            .subscriptions
            .range_mut((client, 0)..=(client, u8::MAX))
        {
            if let Some(before) = std::mem::replace(&mut subscription.expires, expires) {
                self.expiring.remove(&(before, *name));
            }
            self.expiring
                .extend(expires.map(|expires| (expires, *name)));
        }
    }

    pub(super) fn take_expired(&mut self, now: Instant) -> Vec<(Name, Subscriber)> {
        let mut expired = Vec::new();
        while let Some(&(when, name)) = self.expiring.first()
            && when <= now
        {
            self.expiring.pop_first();
            expired.extend(self.remove(name).map(|it| (name, it)));
        }
        expired
    }

    /// Makes the reports of the events on change of this query due, after their pause.
    pub(super) fn touch(&mut self, now: Instant, query: u16) {
        let all =
            (query, (JausId::from_u32(0), 0))..=(query, (JausId::from_u32(u32::MAX), u8::MAX));
        for &(_, name) in self.by_query.range(all) {
            if let Some(subscription) = self.subscriptions.get_mut(&name) {
                let next = subscription.after_its_pause(now);
                let next = *subscription.next.get_or_insert(next);
                self.due.insert((next, name));
            }
        }
    }

    /// The next report that is due. It stays due until it is [rescheduled](Self::reschedule) or
    /// removed.
    pub(super) fn poll_due(&mut self, now: Instant) -> Option<Due> {
        let &(when, name) = self.due.first().filter(|(when, _)| *when <= now)?;
        let query = self.subscriptions.get(&name)?.query.clone();
        Some(Due { name, when, query })
    }

    /// Calls `report` for a due subscription, and schedules its next report.
    pub(super) fn reschedule(
        &mut self,
        due: &Due,
        now: Instant,
        report: impl FnOnce(&mut Subscriber),
    ) {
        self.due.remove(&(due.when, due.name));
        let Some(subscription) = self.subscriptions.get_mut(&due.name) else {
            return;
        };
        report(subscription);
        subscription.next = match subscription.kind {
            Kind::Periodic { period, .. } => Some(following(due.when, period, now)),
            Kind::EveryChange { .. } => None,
        };
        if let Some(next) = subscription.next {
            self.due.insert((next, due.name));
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let due = self.due.first().map(|&(when, _)| when);
        let expiring = self.expiring.first().map(|&(when, _)| when);
        due.into_iter().chain(expiring).min()
    }
}

/// The next scheduled time after `now`. Missed times are skipped, and a delay does not shift the
/// schedule.
fn following(beat: Instant, period: Duration, now: Instant) -> Instant {
    let next = beat + period;
    if next > now {
        return next;
    }
    let missed = now.saturating_duration_since(beat).as_nanos() / period.as_nanos().max(1);
    let beats = u32::try_from(missed + 1).unwrap_or(u32::MAX);
    beat + period.saturating_mul(beats)
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    #[test]
    fn the_next_time_is_after_now_and_on_the_schedule() {
        let (beat, period) = (Instant::now(), Duration::from_millis(100));
        for (late, expected) in [(0, 100), (99, 100), (100, 200), (101, 200), (1050, 1100)] {
            let now = beat + Duration::from_millis(late);
            let next = following(beat, period, now) - beat;
            assert_eq!(next.as_millis(), expected, "{late} ms late");
        }
    }
}
