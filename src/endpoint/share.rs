//! The accounts of bounded tables: how much each network address holds, and its oldest entries.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::Hash;
use std::time::Instant;

use crate::address::JausId;

/// The amounts of all holders, and their ranking.
#[derive(Debug)]
pub(super) struct Tally<K> {
    amounts: HashMap<K, usize>,
    ranking: BTreeSet<(usize, K)>,
}

impl<K> Default for Tally<K> {
    fn default() -> Self {
        Self {
            amounts: HashMap::new(),
            ranking: BTreeSet::new(),
        }
    }
}

impl<K: Copy + Ord + Hash> Tally<K> {
    /// The amount of one holder.
    pub(super) fn of(&self, holder: K) -> usize {
        self.amounts.get(&holder).copied().unwrap_or(0)
    }

    /// The holder with the largest amount, and how much that is.
    pub(super) fn largest(&self) -> Option<(usize, K)> {
        self.ranking.last().copied()
    }

    pub(super) fn add(&mut self, holder: K, more: usize) {
        self.set(holder, self.of(holder) + more);
    }

    pub(super) fn subtract(&mut self, holder: K, less: usize) {
        self.set(holder, self.of(holder).saturating_sub(less));
    }

    pub(super) fn set(&mut self, holder: K, amount: usize) {
        self.ranking.remove(&(self.of(holder), holder));
        if amount == 0 {
            self.amounts.remove(&holder);
        } else {
            self.amounts.insert(holder, amount);
            self.ranking.insert((amount, holder));
        }
    }
}

/// The ids of each group by age.
#[derive(Debug)]
pub(super) struct Ages<G>(BTreeMap<G, BTreeSet<(Instant, JausId)>>);

impl<G> Default for Ages<G> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<G: Ord> Ages<G> {
    pub(super) fn insert(&mut self, group: G, since: Instant, id: JausId) {
        self.0.entry(group).or_default().insert((since, id));
    }

    pub(super) fn remove(&mut self, group: G, since: Instant, id: JausId) {
        if let Entry::Occupied(mut ids) = self.0.entry(group) {
            ids.get_mut().remove(&(since, id));
            if ids.get().is_empty() {
                ids.remove();
            }
        }
    }

    /// The oldest of a group, and since when it is there.
    pub(super) fn oldest(&self, group: &G) -> Option<(Instant, JausId)> {
        self.0.get(group)?.first().copied()
    }
}
