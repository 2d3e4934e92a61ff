//! The components of other nodes and their deadlines, indexed so that no lookup scans all of them.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use jaus_limits::Shares;

use super::pace::Budget;
use crate::address::JausId;
use crate::service::share::Share;

/// A known component.
#[derive(Debug)]
pub(super) struct Peer {
    /// When it last sent a message, or was last listed if it never sent one.
    pub(super) heard: Instant,
    /// The component that listed it; `None` if it sends messages itself.
    pub(super) listed_by: Option<JausId>,
    /// The share of the network address that it counts against.
    pub(super) share: Share,
    /// Whether it has answered a query.
    pub(super) is_confirmed: bool,
    /// Probes since its last message.
    pub(super) probes: u32,
    /// The octets of its services, counted against its share.
    octets: usize,
    look: Instant,
    refresh: Instant,
}

#[derive(Debug)]
pub(super) struct Peers {
    all: BTreeMap<JausId, Peer>,
    /// Components that send messages themselves, by the time of the next check for silence.
    looks: BTreeSet<(Instant, JausId)>,
    refreshes: BTreeSet<(Instant, JausId)>,
    /// Components that are only listed, by the component that listed them.
    listed: BTreeSet<(JausId, JausId)>,
    entries: Shares<Share>,
    octets: Shares<Share>,
    /// Budget of each share for changes of known facts.
    news: BTreeMap<Share, Budget>,
    /// The number of components that send messages themselves and have answered.
    confirmed: usize,
}

impl Peers {
    /// Limit of the lists of services of one network address, in octets.
    const MOST_OCTETS: usize = 512 * 1024;
    /// Changes accepted from one network address: a burst, then one per interval.
    const NEWS_BURST: u32 = 128;
    const NEWS_REFILL: std::time::Duration = std::time::Duration::from_millis(50);

    pub(super) const fn new(most: usize) -> Self {
        Self {
            all: BTreeMap::new(),
            looks: BTreeSet::new(),
            refreshes: BTreeSet::new(),
            listed: BTreeSet::new(),
            entries: Shares::new(most),
            octets: Shares::new(Self::MOST_OCTETS),
            news: BTreeMap::new(),
            confirmed: 0,
        }
    }

    pub(super) fn get(&self, id: JausId) -> Option<&Peer> {
        self.all.get(&id)
    }

    /// The number of components that have answered. Only these lengthen the intervals, so that
    /// forged ids change nothing.
    pub(super) const fn confirmed(&self) -> usize {
        self.confirmed
    }

    /// Whether there is room for one more. A component that sends messages itself may replace one
    /// of the same address that is only listed, which is then returned.
    pub(super) fn room(
        &self,
        share: Share,
        speaks: bool,
    ) -> Result<Option<JausId>, ShareExhausted> {
        if self.entries.has_room(share, 1) {
            return Ok(None);
        }
        let is_weaker = |peer: &Peer| speaks && peer.listed_by.is_some() && peer.share == share;
        let weaker = self.all.iter().find(|(_, peer)| is_weaker(peer));
        weaker.map(|(&id, _)| Some(id)).ok_or(ShareExhausted)
    }

    pub(super) fn insert(
        &mut self,
        now: Instant,
        id: JausId,
        (listed_by, share): (Option<JausId>, Share),
        (look, refresh): (Instant, Instant),
    ) {
        self.remove(id);
        self.entries.take(share, 1);
        self.refreshes.insert((refresh, id));
        match listed_by {
            Some(reporter) => _ = self.listed.insert((reporter, id)),
            None => _ = self.looks.insert((look, id)),
        }
        let peer = Peer {
            heard: now,
            listed_by,
            share,
            is_confirmed: false,
            probes: 0,
            octets: 0,
            look,
            refresh,
        };
        self.all.insert(id, peer);
    }

    pub(super) fn remove(&mut self, id: JausId) {
        let Some(gone) = self.all.remove(&id) else {
            return;
        };
        self.looks.remove(&(gone.look, id));
        self.refreshes.remove(&(gone.refresh, id));
        if let Some(reporter) = gone.listed_by {
            self.listed.remove(&(reporter, id));
        }
        self.entries.give_back(gone.share, 1);
        self.octets.give_back(gone.share, gone.octets);
        if self.entries.is_unused(gone.share) {
            self.news.remove(&gone.share);
        }
        self.confirmed -= usize::from(gone.is_confirmed);
    }

    /// Notes a message from a component; returns whether the component is known.
    pub(super) fn hear(&mut self, now: Instant, id: JausId) -> bool {
        let Some(peer) = self.all.get_mut(&id) else {
            return false;
        };
        peer.heard = now;
        if peer.probes > 0 {
            peer.probes = 0;
            self.look_again(now, id);
        }
        true
    }

    /// Notes that a component was listed again.
    pub(super) fn list(&mut self, now: Instant, id: JausId) {
        if let Some(peer) = self.all.get_mut(&id).filter(|it| it.listed_by.is_some()) {
            peer.heard = now;
        }
    }

    /// Notes that a component that was only listed sends messages itself.
    pub(super) fn speak(&mut self, look: Instant, id: JausId) {
        if let Some(peer) = self.all.get_mut(&id)
            && let Some(reporter) = peer.listed_by.take()
        {
            peer.look = look;
            self.listed.remove(&(reporter, id));
            self.looks.insert((look, id));
        }
    }

    /// Notes that a component has answered a query.
    pub(super) fn confirm(&mut self, id: JausId) {
        if let Some(peer) = self.all.get_mut(&id)
            && !std::mem::replace(&mut peer.is_confirmed, true)
        {
            self.confirmed += 1;
        }
    }

    /// The component with the earliest check for silence, and its time.
    pub(super) fn first_look(&self) -> Option<(Instant, JausId)> {
        self.looks.first().copied()
    }

    pub(super) fn look_again(&mut self, at: Instant, id: JausId) {
        if let Some(peer) = self.all.get_mut(&id)
            && self.looks.remove(&(peer.look, id))
        {
            peer.look = at;
            self.looks.insert((at, id));
        }
    }

    /// Counts a probe of a component, and sets the time of its next check.
    pub(super) fn probe(&mut self, next: Instant, id: JausId) {
        if let Some(peer) = self.all.get_mut(&id) {
            peer.probes += 1;
        }
        self.look_again(next, id);
    }

    pub(super) fn first_refresh(&self) -> Option<(Instant, JausId)> {
        self.refreshes.first().copied()
    }

    pub(super) fn refresh_again(&mut self, at: Instant, id: JausId) {
        if let Some(peer) = self.all.get_mut(&id) {
            self.refreshes.remove(&(peer.refresh, id));
            peer.refresh = at;
            self.refreshes.insert((at, id));
        }
    }

    /// The components that are listed on the word of this one.
    pub(super) fn listed_by(&self, reporter: JausId) -> impl Iterator<Item = JausId> {
        let all = (reporter, JausId::from_u32(0))..=(reporter, JausId::from_u32(u32::MAX));
        self.listed.range(all).map(|&(_, id)| id)
    }

    /// The peers that send messages themselves.
    pub(super) fn speakers(&self) -> impl Iterator<Item = JausId> {
        self.looks.iter().map(|&(_, id)| id)
    }

    /// The first peer of a subsystem that sends messages itself.
    pub(super) fn speaker_of(&self, subsystem: u16) -> Option<JausId> {
        let all = JausId::new(subsystem, 0, 0)..=JausId::new(subsystem, u8::MAX, u8::MAX);
        let mut members = self.all.range(all);
        members.find_map(|(&id, peer)| peer.listed_by.is_none().then_some(id))
    }

    /// The peers on the same node as this one.
    pub(super) fn of_node(&self, id: JausId) -> impl Iterator<Item = JausId> {
        let number = |component| JausId::new(id.subsystem(), id.node(), component);
        self.all
            .range(number(0)..=number(u8::MAX))
            .map(|(&id, _)| id)
    }

    /// Charges a component's services to its share; returns whether they fit.
    pub(super) fn charge(&mut self, id: JausId, octets: usize) -> bool {
        let Some(peer) = self.all.get_mut(&id) else {
            return false;
        };
        self.octets.give_back(peer.share, peer.octets);
        let fits = self.octets.has_room(peer.share, octets);
        peer.octets = if fits { octets } else { 0 };
        self.octets.take(peer.share, peer.octets);
        fits
    }

    /// Whether the budget of the component's address allows one more change of a known fact.
    pub(super) fn may_change(&mut self, now: Instant, id: JausId) -> bool {
        let Some(peer) = self.all.get(&id) else {
            return false;
        };
        let budget = || Budget::new(Self::NEWS_BURST, Self::NEWS_REFILL);
        self.news.entry(peer.share).or_insert_with(budget).take(now)
    }
}

/// The share of the component's address is used up.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct ShareExhausted;
