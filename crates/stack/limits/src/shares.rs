//! How much of a bounded table each owner holds, and how much it may.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::Hash;

/// How much of a bounded table each owner has taken.
///
/// The table holds twice `most` entries. The first half is first come, first served. Of the second
/// half an owner gets at most an eighth of the free entries, so that a newcomer finds room.
#[derive(Debug)]
pub struct Shares<K> {
    most: usize,
    total: usize,
    taken: BTreeMap<K, usize>,
}

impl<K: Ord + Copy> Shares<K> {
    /// The shares of an empty table for twice `most` entries.
    #[must_use]
    pub const fn new(most: usize) -> Self {
        Self {
            most,
            total: 0,
            taken: BTreeMap::new(),
        }
    }

    /// Whether an owner may take `more` entries.
    pub fn has_room(&self, owner: K, more: usize) -> bool {
        if self.total.saturating_add(more) <= self.most {
            return true;
        }
        let free = self.most.saturating_mul(2).saturating_sub(self.total);
        more <= free && self.of(&owner).saturating_add(more) <= (free / 8).max(1)
    }

    /// How much an owner holds.
    pub fn of(&self, owner: &K) -> usize {
        self.taken.get(owner).copied().unwrap_or(0)
    }

    /// Whether an owner holds nothing.
    pub fn is_unused(&self, owner: K) -> bool {
        !self.taken.contains_key(&owner)
    }

    /// Counts entries of an owner.
    pub fn take(&mut self, owner: K, more: usize) {
        if more > 0 {
            *self.taken.entry(owner).or_default() += more;
            self.total += more;
        }
    }

    /// Counts them no more.
    pub fn give_back(&mut self, owner: K, less: usize) {
        if let Some(taken) = self.taken.get_mut(&owner) {
            let less = less.min(*taken);
            *taken -= less;
            self.total -= less;
            if *taken == 0 {
                self.taken.remove(&owner);
            }
        }
    }
}

/// The amounts of all holders, and their ranking.
#[derive(Debug)]
pub struct Tally<K> {
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
    #[must_use]
    pub fn of(&self, holder: K) -> usize {
        self.amounts.get(&holder).copied().unwrap_or(0)
    }

    /// The holder with the largest amount, and how much that is.
    #[must_use]
    pub fn largest(&self) -> Option<(usize, K)> {
        self.ranking.last().copied()
    }

    /// Counts one more for a holder, or one less.
    pub fn count(&mut self, holder: K, more: bool) {
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

    /// Sets the amount of a holder; 0 forgets it.
    pub fn set(&mut self, holder: K, amount: usize) {
        self.ranking.remove(&(self.of(holder), holder));
        if amount == 0 {
            self.amounts.remove(&holder);
        } else {
            self.amounts.insert(holder, amount);
            self.ranking.insert((amount, holder));
        }
    }
}

/// The entry that gives way to a new one in a full list: the first of the owner that has the most, or
/// of all if each has as many. `None` if the list is empty.
///
/// ```
/// let oldest_first = ["a", "flood", "flood", "b"];
/// assert_eq!(jaus_limits::first_of_largest(&oldest_first, |it| *it), Some(1));
/// ```
pub fn first_of_largest<'i, T: 'i, K: Eq + Hash>(
    items: impl IntoIterator<Item = &'i T>,
    owner: impl Fn(&T) -> K,
) -> Option<usize> {
    let mut held = HashMap::<K, (usize, usize)>::new();
    for (place, item) in items.into_iter().enumerate() {
        held.entry(owner(item)).or_insert((0, place)).0 += 1;
    }
    let most = held
        .into_values()
        .max_by_key(|&(count, first)| (count, Reverse(first)));
    most.map(|(_, first)| first)
}

/// The entry that gives way to a newcomer in a full list of entries in use, the oldest first: the newest of the owner that
/// has the most. `None` if the owner of the newcomer would have as many then, or the list is empty.
///
/// ```
/// let oldest_first = ["a", "flood", "flood", "b", "flood"];
/// assert_eq!(jaus_limits::last_of_crowd(&oldest_first, &"c", |it| *it), Some(4));
/// assert_eq!(jaus_limits::last_of_crowd(&["a", "b"], &"c", |it| *it), None);
/// ```
pub fn last_of_crowd<T, K: Eq + Hash>(
    items: &[T],
    newcomer: &K,
    owner: impl Fn(&T) -> K,
) -> Option<usize> {
    let newest_first = items.iter().rev();
    let place = items.len() - 1 - first_of_largest(newest_first, &owner)?;
    let held = |by: &K| items.iter().filter(|it| owner(it) == *by).count();
    (held(&owner(&items[place])) > held(newcomer) + 1).then_some(place)
}

/// Selects at most `most` items, as evenly as possible from all owners: one of each, then a second,
/// and so on. Items of one owner keep their order, and so do the selected ones.
///
/// ```
/// let items = [("a", 1), ("a", 2), ("a", 3), ("b", 4)];
/// let chosen = jaus_limits::fair_selection(items.to_vec(), 2, |item| item.0);
/// assert_eq!(chosen, [("a", 1), ("b", 4)]);
/// ```
pub fn fair_selection<T, K: Eq + Hash>(
    items: Vec<T>,
    most: usize,
    owner: impl Fn(&T) -> K,
) -> Vec<T> {
    let mut seen = HashMap::<K, usize>::new();
    let turn = |item: &T| {
        let seen = seen.entry(owner(item)).or_default();
        *seen += 1;
        *seen
    };
    let turns: Vec<usize> = items.iter().map(turn).collect();
    let mut order: Vec<usize> = (0..items.len()).collect();
    // Stable: among equal turns the first come first.
    order.sort_by_key(|&index| turns[index]);
    order.truncate(most);
    let chosen: BTreeSet<usize> = order.into_iter().collect();
    let items = items.into_iter().enumerate();
    items
        .filter_map(|(index, item)| chosen.contains(&index).then_some(item))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_newcomer_finds_room_however_many_others_take_all_they_can() {
        for others in 0..50 {
            let mut shares = Shares::new(1000);
            for other in 0..others {
                while shares.has_room(other, 1) {
                    shares.take(other, 1);
                }
            }
            assert!(shares.has_room(u32::MAX, 1), "{others} others");
            assert!(shares.total <= 2000);
        }
    }

    #[test]
    fn one_owner_alone_gets_the_most_and_what_it_gives_back_is_free_again() {
        let mut shares = Shares::new(8);
        assert!(shares.has_room('a', 8) && !shares.has_room('a', 9));
        shares.take('a', 8);
        assert!(!shares.has_room('a', 1));
        shares.give_back('a', 3);
        assert!(shares.has_room('a', 3) && !shares.has_room('a', 4));
    }

    #[test]
    fn the_first_of_the_owner_with_the_most_gives_way() {
        for (owners, first) in [
            ("", None),
            ("abc", Some(0)),
            ("abcc", Some(2)),
            ("baab", Some(0)),
        ] {
            let owners: Vec<char> = owners.chars().collect();
            assert_eq!(first_of_largest(&owners, |it| *it), first, "{owners:?}");
        }
    }

    #[test]
    fn a_selection_has_items_of_every_owner_before_it_has_more_of_one() {
        let flood = (0..1000).map(|number| ("flood", number));
        let items: Vec<_> = flood.chain([("a", 0), ("b", 0), ("a", 1)]).collect();
        let chosen = fair_selection(items.clone(), 8, |item| item.0);
        assert_eq!(chosen.len(), 8);
        for item in [("a", 0), ("b", 0), ("a", 1), ("flood", 0)] {
            assert!(chosen.contains(&item), "{item:?}");
        }
        assert!(chosen.is_sorted_by_key(|item| items.iter().position(|it| it == item)));
        assert_eq!(fair_selection(items.clone(), 2000, |item| item.0), items);
    }

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
