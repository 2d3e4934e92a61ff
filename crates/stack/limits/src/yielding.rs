//! A bounded number of holders, such as connections that have proven nothing yet, of which one gives way to
//! a newcomer.

use std::hash::Hash;

use crate::first_of_largest;

/// The holders of a bounded number of places with their owners, such as network addresses, in the order in
/// which they came.
///
/// A newcomer always gets a place. So nobody is kept out by others that hold all places, however many owners
/// they pretend to be, if a place is not needed for long.
#[derive(Debug)]
pub struct Yielding<K, H> {
    most: usize,
    holders: Vec<(K, H)>,
}

impl<K: Eq + Hash + Copy, H> Yielding<K, H> {
    /// Nobody yet, of at most `most` holders.
    #[must_use]
    pub const fn new(most: usize) -> Self {
        let holders = Vec::new();
        Self { most, holders }
    }

    /// Adds a holder, and returns the one that has to give way, if any: the first of the owner that has the
    /// most. Holders that are done are forgotten before.
    ///
    /// ```
    /// let mut connections = jaus_limits::Yielding::new(3);
    /// let is_done = |_: &u32| false;
    /// for (owner, number) in [("a", 1), ("flood", 2), ("flood", 3)] {
    ///     assert_eq!(connections.add(owner, number, is_done), None);
    /// }
    /// assert_eq!(connections.add("b", 4, is_done), Some(2));
    /// ```
    pub fn add(&mut self, owner: K, holder: H, is_done: impl Fn(&H) -> bool) -> Option<H> {
        self.holders.retain(|(_, holder)| !is_done(holder));
        let yields = match self.holders.len() < self.most {
            true => None,
            false => first_of_largest(&self.holders, |it| it.0),
        };
        let yields = yields.map(|place| self.holders.remove(place).1);
        self.holders.push((owner, holder));
        yields
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_floods_gives_way_and_others_keep_their_places() {
        let mut holders = Yielding::new(16);
        assert_eq!(holders.add('a', 0, |_| false), None);
        let yielded: Vec<_> = (1..100)
            .filter_map(|it| holders.add('f', it, |_| false))
            .collect();
        assert_eq!(yielded, (1..85).collect::<Vec<_>>(), "the oldest first");
    }

    #[test]
    fn of_many_owners_with_one_place_each_the_oldest_gives_way() {
        let mut holders = Yielding::new(4);
        let yielded: Vec<_> = (0..8)
            .filter_map(|it| holders.add(it, it, |_| false))
            .collect();
        assert_eq!(yielded, [0, 1, 2, 3]);
    }

    #[test]
    fn who_is_done_leaves_its_place() {
        let mut holders = Yielding::new(2);
        for it in 0..10 {
            assert_eq!(holders.add('a', it, |it| it % 2 == 0), None);
            if it % 2 == 1 {
                holders.holders.clear();
            }
        }
    }
}
