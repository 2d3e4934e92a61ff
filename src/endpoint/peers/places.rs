//! The eviction order of the full peer table, and the share of each network address.
//!
//! A new peer evicts a peer of the network address that holds the most, if that is another one.
//! Otherwise peers that were only heard go first, then those that we have sent to, then those that
//! have acknowledged a message; among equals the one heard longest ago. Peers in conversation with
//! us stay as long as they are heard from time to time: if none can be evicted, the new peer is
//! refused. Invented ids can therefore only replace each other.

use std::collections::{BTreeSet, HashMap};
use std::time::{Duration, Instant};

use super::Peers;
use crate::address::JausId;
use crate::endpoint::Path;
use crate::endpoint::rate::Origin;

/// Our history with a peer, which determines the eviction order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Standing {
    Heard,
    SpokenTo,
    /// It has acknowledged one of our messages.
    Answered,
}

impl Standing {
    pub(super) const ALL: [Self; 3] = [Self::Heard, Self::SpokenTo, Self::Answered];

    /// How long a peer must have been silent to be evicted.
    pub(super) const fn silence(self) -> Duration {
        match self {
            Self::Heard | Self::SpokenTo => Duration::ZERO,
            Self::Answered => Duration::from_secs(60),
        }
    }
}

/// A peer's position in the eviction order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) standing: Standing,
    pub(super) origin: Origin,
    number: u64,
    /// When the peer was last heard before it got this position.
    pub(super) heard: Instant,
}

/// The eviction order, overall and per network address. It catches up with the times at which peers
/// were heard only during a search, so that receiving a message costs nothing.
#[derive(Debug, Default)]
pub(super) struct Places {
    latest: u64,
    overall: BTreeSet<(Standing, u64, JausId)>,
    by_origin: BTreeSet<(Origin, Standing, u64, JausId)>,
    held: HashMap<Origin, usize>,
    ranking: BTreeSet<(usize, Origin)>,
}

impl Places {
    /// Appends a peer to those of its standing.
    pub(super) fn insert(
        &mut self,
        id: JausId,
        origin: Origin,
        standing: Standing,
        heard: Instant,
    ) -> Place {
        self.latest += 1;
        let number = self.latest;
        self.overall.insert((standing, number, id));
        self.by_origin.insert((origin, standing, number, id));
        self.count(origin, |held| held + 1);
        Place {
            standing,
            origin,
            number,
            heard,
        }
    }

    pub(super) fn remove(&mut self, id: JausId, place: Place) {
        let Place {
            standing,
            origin,
            number,
            ..
        } = place;
        self.overall.remove(&(standing, number, id));
        if self.by_origin.remove(&(origin, standing, number, id)) {
            self.count(origin, |held| held.saturating_sub(1));
        }
    }

    fn count(&mut self, origin: Origin, change: impl Fn(usize) -> usize) {
        let before = self.held(origin);
        self.ranking.remove(&(before, origin));
        match change(before) {
            0 => {
                self.held.remove(&origin);
            }
            held => {
                self.held.insert(origin, held);
                self.ranking.insert((held, origin));
            }
        }
    }

    /// How many peers a network address holds.
    pub(super) fn held(&self, origin: Origin) -> usize {
        self.held.get(&origin).copied().unwrap_or(0)
    }

    /// The network address that holds the most peers, and how many.
    pub(super) fn most(&self) -> Option<(usize, Origin)> {
        self.ranking.last().copied()
    }

    /// The first peer of a standing, of one network address or overall.
    pub(super) fn first(&self, standing: Standing, of: Option<Origin>) -> Option<JausId> {
        match of {
            Some(origin) => {
                let from = (origin, standing, 0, JausId::from_u32(0));
                let next = self.by_origin.range(from..).next();
                let next = next.filter(|(at, is, ..)| (*at, *is) == (origin, standing));
                next.map(|&(.., id)| id)
            }
            None => {
                let from = (standing, 0, JausId::from_u32(0));
                let next = self.overall.range(from..).next();
                next.filter(|(is, ..)| *is == standing).map(|&(.., id)| id)
            }
        }
    }
}

impl Peers {
    /// Whether an id is known or can be added: there is room, or a peer can be evicted.
    pub(in crate::endpoint) fn has_room_for(
        &mut self,
        now: Instant,
        id: JausId,
        from: Path,
    ) -> bool {
        self.knows(id)
            || self.states.len() < self.limit
            || self.next_to_go(now, from.into()).is_some()
    }

    /// The peer to evict for a new one from a network address. An address that holds a quarter of
    /// the table gets no more of it, and makes room for addresses that hold less.
    pub(super) fn next_to_go(&mut self, now: Instant, newcomer: Origin) -> Option<JausId> {
        let (most, holder) = self.places.most()?;
        let own = self.places.held(newcomer);
        let (is_excessive, own_is) = (most * 4 > self.limit, own * 4 > self.limit);
        if most > own + 1 {
            let found = Standing::ALL.into_iter().find_map(|standing| {
                let silence = if is_excessive {
                    Duration::ZERO
                } else {
                    standing.silence()
                };
                self.longest_silent(now, Some(holder), standing, silence)
            });
            if found.is_some() {
                return found;
            }
        }
        let of = own_is.then_some(newcomer);
        Standing::ALL
            .into_iter()
            .find_map(|standing| self.longest_silent(now, of, standing, standing.silence()))
    }

    /// The peer of a standing that was heard longest ago, if it was silent for long enough. Peers
    /// heard since they got their position move to the end, so a search costs no more than the
    /// messages heard.
    fn longest_silent(
        &mut self,
        now: Instant,
        of: Option<Origin>,
        standing: Standing,
        silence: Duration,
    ) -> Option<JausId> {
        loop {
            let id = self.places.first(standing, of)?;
            let state = self.states.get(&id)?;
            let heard = state.peer.last_heard;
            if heard > state.place.heard {
                self.place_anew(id, standing);
                continue;
            }
            return (now.saturating_duration_since(heard) >= silence).then_some(id);
        }
    }

    fn place_anew(&mut self, id: JausId, standing: Standing) {
        if let Some(state) = self.states.get_mut(&id) {
            self.places.remove(id, state.place);
            let (origin, heard) = (state.place.origin, state.peer.last_heard);
            state.place = self.places.insert(id, origin, standing, heard);
        }
    }

    pub(super) fn raise(&mut self, id: JausId, standing: Standing) {
        let state = self.states.get(&id);
        if state.is_some_and(|state| state.place.standing < standing) {
            self.place_anew(id, standing);
        }
    }
}
