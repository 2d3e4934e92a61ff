//! Which peer is forgotten when the table is full, and how many peers each network address holds.

use std::collections::{BTreeSet, HashMap};
use std::time::{Duration, Instant};

use crate::address::JausId;
use crate::endpoint::rate::Origin;

/// What we have had to do with a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Standing {
    Heard,
    SpokenTo,
    /// It has acknowledged something of ours.
    Answered,
}

impl Standing {
    pub(super) const ALL: [Self; 3] = [Self::Heard, Self::SpokenTo, Self::Answered];

    /// How long a peer must have been silent to be forgotten for a newcomer.
    pub(super) const fn silence(self) -> Duration {
        match self {
            Self::Heard | Self::SpokenTo => Duration::ZERO,
            Self::Answered => Duration::from_secs(60),
        }
    }
}

/// A peer's place in the order of eviction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) standing: Standing,
    pub(super) origin: Origin,
    number: u64,
    /// When the peer was heard last before it got this place.
    pub(super) heard: Instant,
}

/// The order of eviction, overall and for each network address. It follows the time at which
/// peers were heard last only when somebody looks, so that hearing a peer costs nothing.
#[derive(Debug, Default)]
pub(super) struct Places {
    latest: u64,
    overall: BTreeSet<(Standing, u64, JausId)>,
    by_origin: BTreeSet<(Origin, Standing, u64, JausId)>,
    held: HashMap<Origin, usize>,
    ranking: BTreeSet<(usize, Origin)>,
}

impl Places {
    /// Puts a peer behind all others of its standing.
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

    /// The network address that holds most, and how many.
    pub(super) fn most(&self) -> Option<(usize, Origin)> {
        self.ranking.last().copied()
    }

    /// The first of a standing, of one network address or overall.
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
