//! A bounded priority queue for a slow receiver: most urgent first, and the stale items are
//! dropped.
//!
//! Both ends of a node use it: a link while the network is busy, and a component's mailbox while it
//! does not read. **When it is full, it drops the oldest item of the lowest priority present**. If
//! all waiting items are more urgent than the new one, it drops the new one.

use std::collections::VecDeque;

use crate::wire::Priority;

/// The limits of a backlog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Items, at least 1.
    pub items: usize,
    /// Octets of all items. A single larger item is accepted if nothing else waits.
    pub octets: usize,
}

/// The queue.
#[derive(Debug)]
pub struct Backlog<T> {
    bounds: Bounds,
    /// By priority, low first: the items, each with its octets.
    levels: [VecDeque<(usize, T)>; LEVELS],
    /// Octets of the items of each level.
    octets: [usize; LEVELS],
}

const LEVELS: usize = Priority::ALL.len();

/// The memory, in items, that an empty level keeps. A burst may need more, but a node has many
/// components whose only burst is the discovery at the start.
const KEPT: usize = 32;

impl<T> Backlog<T> {
    /// An empty queue with these limits.
    #[must_use]
    pub fn new(bounds: Bounds) -> Self {
        Self {
            bounds,
            levels: Default::default(),
            octets: [0; LEVELS],
        }
    }

    /// Items that wait.
    #[must_use]
    pub fn len(&self) -> usize {
        self.levels.iter().map(VecDeque::len).sum()
    }

    /// Octets of all items that wait.
    #[must_use]
    pub fn octets(&self) -> usize {
        self.octets.iter().sum()
    }

    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether `items` more fit, and at most half of the octets are in use.
    #[must_use]
    pub fn has_room(&self, items: usize) -> bool {
        self.len() + items <= self.bounds.items && self.octets() <= self.bounds.octets / 2
    }

    /// Whether items of this or a higher priority take less than half of the room. The other half
    /// is a reserve for items that are pushed without this check.
    #[must_use]
    pub fn has_reserve(&self, priority: Priority) -> bool {
        let level = usize::from(priority.bits());
        let items: usize = self.levels[level..].iter().map(VecDeque::len).sum();
        let octets: usize = self.octets[level..].iter().sum();
        items < self.bounds.items.div_ceil(2) && octets <= self.bounds.octets / 2
    }

    /// Adds an item; returns how many items were dropped for it.
    #[must_use]
    pub fn push(&mut self, priority: Priority, octets: usize, item: T) -> u64 {
        let level = usize::from(priority.bits());
        self.levels[level].push_back((octets, item));
        self.octets[level] += octets;
        let mut dropped = 0;
        while self.is_overfull() && self.drop_least() {
            dropped += 1;
        }
        dropped
    }

    /// The item that [`pop`](Self::pop) removes next.
    #[must_use]
    pub fn first(&self) -> Option<&T> {
        let (_, first) = self.levels.iter().rev().find_map(VecDeque::front)?;
        Some(first)
    }

    /// Removes the oldest item of the highest priority.
    pub fn pop(&mut self) -> Option<T> {
        (0..LEVELS).rev().find_map(|level| self.pop_from(level))
    }

    /// Drops the oldest item of the lowest priority; returns whether there was one.
    pub fn drop_least(&mut self) -> bool {
        (0..LEVELS).any(|level| self.pop_from(level).is_some())
    }

    fn pop_from(&mut self, level: usize) -> Option<T> {
        let items = &mut self.levels[level];
        let (octets, item) = items.pop_front()?;
        self.octets[level] -= octets;
        if items.is_empty() && items.capacity() > 2 * KEPT {
            items.shrink_to(KEPT);
        }
        Some(item)
    }

    fn is_overfull(&self) -> bool {
        let items = self.len();
        items > 1 && (items > self.bounds.items || self.octets() > self.bounds.octets)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn backlog(items: usize, octets: usize) -> Backlog<&'static str> {
        Backlog::new(Bounds { items, octets })
    }

    fn push(backlog: &mut Backlog<&'static str>, priority: Priority, text: &'static str) -> u64 {
        backlog.push(priority, text.len(), text)
    }

    fn drain(backlog: &mut Backlog<&'static str>) -> Vec<&'static str> {
        std::iter::from_fn(|| backlog.pop()).collect()
    }

    #[test]
    fn the_urgent_come_first_and_equals_in_order() {
        let mut backlog = backlog(10, 1000);
        for (priority, text) in [
            (Priority::Standard, "one"),
            (Priority::Low, "later"),
            (Priority::SafetyCritical, "stop"),
            (Priority::Standard, "two"),
        ] {
            assert_eq!(push(&mut backlog, priority, text), 0);
        }
        assert_eq!(drain(&mut backlog), ["stop", "one", "two", "later"]);
        assert!(backlog.is_empty());
    }

    #[test]
    fn when_it_is_full_the_oldest_of_the_least_urgent_goes() {
        let mut backlog = backlog(2, 1000);
        let dropped = [
            push(&mut backlog, Priority::Standard, "one"),
            push(&mut backlog, Priority::Standard, "two"),
            push(&mut backlog, Priority::Standard, "three"),
            push(&mut backlog, Priority::High, "four"),
            push(&mut backlog, Priority::Low, "five"),
        ];
        assert_eq!(dropped, [0, 0, 1, 1, 1]);
        assert_eq!(drain(&mut backlog), ["four", "three"]);
    }

    #[test]
    fn octets_are_bounded_too_but_a_single_large_item_passes() {
        let mut backlog = backlog(10, 8);
        assert_eq!(push(&mut backlog, Priority::Standard, "1234"), 0);
        assert_eq!(push(&mut backlog, Priority::Standard, "5678"), 0);
        assert_eq!(push(&mut backlog, Priority::Standard, "9"), 1);
        assert_eq!(drain(&mut backlog), ["5678", "9"]);
        assert_eq!(
            push(&mut backlog, Priority::Standard, "longer than eight"),
            0
        );
        assert_eq!(push(&mut backlog, Priority::Standard, "next"), 1);
        assert_eq!(drain(&mut backlog), ["next"]);
    }
}
