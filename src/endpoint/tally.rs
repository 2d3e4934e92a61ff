//! How much each holder has of something shared, such as the network addresses of a bounded table.

use std::collections::{BTreeSet, HashMap};
use std::hash::Hash;

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

    fn set(&mut self, holder: K, amount: usize) {
        self.ranking.remove(&(self.of(holder), holder));
        if amount == 0 {
            self.amounts.remove(&holder);
        } else {
            self.amounts.insert(holder, amount);
            self.ranking.insert((amount, holder));
        }
    }
}
