//! A bounded table whose idle entries give way to new ones.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::Hash;
use std::time::Duration;

use crate::Shares;

/// Whether there is room for a new entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Room<E> {
    /// There is.
    Free,
    /// There is when this entry is removed.
    InPlaceOf(E),
    /// There is none.
    None,
}

/// The entries of a bounded table by owner and age: which one a new entry displaces.
///
/// Owners have [`Shares`]. Without room, a new entry displaces the entry of its own owner that was
/// idle for longest, or of any owner if its own has no more than an eighth of the table; but none that
/// was used within the time that counts as idle. An owner that floods the table displaces its own
/// entries, and entries in use stay.
///
/// Times are those since any common epoch.
#[derive(Debug)]
pub struct Displacing<K, E> {
    shares: Shares<K>,
    /// An eighth of the table.
    modest: usize,
    idle: Duration,
    entries: HashMap<E, (K, Duration)>,
    /// The entries by time of use: those of each owner and, under `None`, all.
    ages: BTreeMap<Option<K>, BTreeSet<(Duration, E)>>,
}

impl<K: Ord + Copy, E: Ord + Copy + Hash> Displacing<K, E> {
    /// An empty table for `most` entries. An entry that was not used for `idle` gives way.
    #[must_use]
    pub fn new(most: usize, idle: Duration) -> Self {
        Self {
            shares: Shares::new(most / 2),
            modest: most / 8,
            idle,
            entries: HashMap::new(),
            ages: BTreeMap::new(),
        }
    }

    /// The room for a new entry of an owner.
    pub fn room(&self, owner: K, now: Duration) -> Room<E> {
        if self.shares.has_room(owner, 1) {
            return Room::Free;
        }
        let idlest = |of: Option<K>| {
            let &(used, entry) = self.ages.get(&of)?.first()?;
            (now.saturating_sub(used) >= self.idle).then_some(entry)
        };
        let others = || idlest(None).filter(|_| self.shares.of(&owner) <= self.modest);
        let displaced = idlest(Some(owner)).or_else(others);
        displaced.map_or(Room::None, Room::InPlaceOf)
    }

    /// Adds an entry, which is in use now.
    pub fn insert(&mut self, entry: E, owner: K, now: Duration) {
        self.remove(entry);
        self.shares.take(owner, 1);
        self.entries.insert(entry, (owner, now));
        self.list(owner, (now, entry), true);
    }

    /// Notes that an entry is in use.
    pub fn touch(&mut self, entry: E, now: Duration) {
        let Some((owner, used)) = self.entries.get_mut(&entry) else {
            return;
        };
        let (owner, before) = (*owner, std::mem::replace(used, now));
        self.list(owner, (before, entry), false);
        self.list(owner, (now, entry), true);
    }

    /// Removes an entry.
    pub fn remove(&mut self, entry: E) {
        if let Some((owner, used)) = self.entries.remove(&entry) {
            self.shares.give_back(owner, 1);
            self.list(owner, (used, entry), false);
        }
    }

    fn list(&mut self, owner: K, age: (Duration, E), is_there: bool) {
        for key in [None, Some(owner)] {
            let ages = self.ages.entry(key).or_default();
            if is_there {
                ages.insert(age);
            } else {
                ages.remove(&age);
            }
            if ages.is_empty() {
                self.ages.remove(&key);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDLE: Duration = Duration::from_secs(10);

    fn table() -> Displacing<char, u32> {
        Displacing::new(64, IDLE)
    }

    /// Adds an entry if there is room; returns whether there was.
    fn add(table: &mut Displacing<char, u32>, owner: char, entry: u32, second: u64) -> bool {
        let now = Duration::from_secs(second);
        match table.room(owner, now) {
            Room::Free => {}
            Room::InPlaceOf(other) => table.remove(other),
            Room::None => return false,
        }
        table.insert(entry, owner, now);
        true
    }

    fn held(table: &Displacing<char, u32>, owner: char) -> usize {
        table.shares.of(&owner)
    }

    #[test]
    fn who_floods_the_table_displaces_its_own_entries_and_leaves_room() {
        let mut table = table();
        assert!(add(&mut table, 'a', 1_000_000, 0));
        for entry in 0..10_000 {
            add(&mut table, 'f', entry, u64::from(entry) / 100);
        }
        assert_eq!(held(&table, 'f'), 31, "half of the table");
        assert_eq!(held(&table, 'a'), 1, "idle for 100 s, and still there");
        assert!(add(&mut table, 'b', 1_000_001, 100));
    }

    #[test]
    fn a_full_table_gives_the_places_of_idle_entries_to_a_newcomer() {
        let mut table = table();
        let mut entry = 0;
        for owner in ('A'..='Z').chain('a'..='z').chain('α'..='ω') {
            for _ in 0..64 {
                entry += 1;
                add(&mut table, owner, entry, 0);
            }
        }
        assert_eq!(table.entries.len(), 64);
        assert!(!add(&mut table, '1', 1_000_000, 9), "all are in use");
        table.touch(1, Duration::from_secs(9));
        for number in 0..8 {
            assert!(add(&mut table, '1', 1_000_000 + number, 10), "{number}");
        }
        assert!(table.entries.contains_key(&1), "it is in use");
        assert_eq!(table.entries.len(), 64);
    }

    #[test]
    fn who_holds_more_than_an_eighth_displaces_no_others() {
        let mut table = table();
        for entry in 0..32 {
            assert!(add(&mut table, 'f', entry, 0));
        }
        for (owner, entry) in ('a'..='z').zip(100..) {
            add(&mut table, owner, entry, 0);
        }
        for entry in 0..32 {
            table.touch(entry, Duration::from_secs(60));
        }
        assert!(!add(&mut table, 'f', 1_000_000, 60), "its own are in use");
        assert!(add(&mut table, '1', 1_000_000, 60));
    }

    #[test]
    fn what_is_removed_leaves_nothing() {
        let mut table = table();
        for entry in 0..5 {
            add(&mut table, 'a', entry, 0);
            table.touch(entry, Duration::from_secs(1));
        }
        (0..6).for_each(|entry| table.remove(entry));
        table.touch(3, Duration::from_secs(2));
        assert!(table.ages.is_empty() && table.entries.is_empty());
        assert_eq!(held(&table, 'a'), 0);
    }
}
