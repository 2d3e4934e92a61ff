//! The accounts of bounded tables: how much each network address holds, and its oldest entries.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::Hash;
use std::time::Instant;

use super::rate::Origin;
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

    /// Counts one more for a holder, or one less.
    pub(super) fn count(&mut self, holder: K, more: bool) {
        let amount = self.of(holder);
        self.set(
            holder,
            if more {
                amount + 1
            } else {
                amount.saturating_sub(1)
            },
        );
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

/// Since when an id is in a group, and which.
type Entry = (Instant, JausId);

/// The ids of each group by age: those of each network address and, under `None`, all.
#[derive(Debug, Default)]
pub(super) struct Ages<G>(BTreeMap<(Option<Origin>, G), BTreeSet<Entry>>);

impl<G: Copy + Ord> Ages<G> {
    /// Adds an entry, or removes it.
    pub(super) fn set(&mut self, origin: Origin, group: G, entry: Entry, is_there: bool) {
        for key in [None, Some(origin)].map(|of| (of, group)) {
            let ids = self.0.entry(key).or_default();
            if is_there {
                ids.insert(entry);
            } else {
                ids.remove(&entry);
            }
            if ids.is_empty() {
                self.0.remove(&key);
            }
        }
    }

    /// The oldest of a group, of one network address or of all, and since when it is there.
    pub(super) fn oldest(&self, of: Option<Origin>, group: G) -> Option<Entry> {
        self.0.get(&(of, group))?.first().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_holder_is_known_through_all_changes() {
        let mut tally = Tally::default();
        assert_eq!((tally.largest(), tally.of('a')), (None, 0));
        tally.set('a', 2);
        tally.set('b', 3);
        assert_eq!(tally.largest(), Some((3, 'b')));
        tally.set('a', 4);
        tally.count('a', true);
        assert_eq!((tally.largest(), tally.of('a')), (Some((5, 'a')), 5));
        for _ in 0..3 {
            tally.count('a', false);
        }
        assert_eq!((tally.largest(), tally.of('a')), (Some((3, 'b')), 2));
        tally.set('b', 0);
        tally.count('b', false);
        assert_eq!((tally.largest(), tally.of('b')), (Some((2, 'a')), 0));
        tally.set('a', 0);
        assert_eq!(tally.largest(), None);
        assert!(tally.amounts.is_empty(), "who holds nothing takes no room");
    }
}
