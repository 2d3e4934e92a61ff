//! A bounded priority queue for a slow receiver: most urgent first, and the stale items are
//! dropped.
//!
//! Both ends of a node use it: a link while the network is busy, and a component's mailbox while it
//! does not read. **When it is full, it drops the oldest item of the lowest priority present**. If
//! all waiting items are more urgent than the new one, it drops the new one. Items that must stay, such as
//! acknowledged messages, are never dropped; whoever adds them asks for room before.

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
    /// By priority, low first.
    levels: [Level<T>; LEVELS],
    /// The number of the next item.
    next: u64,
}

/// The items of one priority.
#[derive(Debug)]
struct Level<T> {
    /// Those that may be dropped, and those that must stay: the number of each, by which they are in
    /// order, and its octets.
    items: [VecDeque<(u64, usize, T)>; 2],
    octets: [usize; 2],
}

/// The place, in a level, of items that may be dropped, and of those that must stay.
const LOOSE: usize = 0;
const FIRM: usize = 1;

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
            next: 0,
        }
    }

    /// Items that wait.
    #[must_use]
    pub fn len(&self) -> usize {
        self.levels.iter().map(Level::len).sum()
    }

    /// Octets of all items that wait.
    #[must_use]
    pub fn octets(&self) -> usize {
        self.levels.iter().flat_map(|level| level.octets).sum()
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

    /// Whether items of this or a higher priority that must stay take less than half of the room. The
    /// other half is for items that may be dropped.
    #[must_use]
    pub fn has_reserve(&self, priority: Priority) -> bool {
        let levels = &self.levels[usize::from(priority.bits())..];
        let items: usize = levels.iter().map(|it| it.items[FIRM].len()).sum();
        let octets: usize = levels.iter().map(|it| it.octets[FIRM]).sum();
        items < self.bounds.items.div_ceil(2) && octets <= self.bounds.octets / 2
    }

    /// Adds an item; returns how many items were dropped for it.
    #[must_use]
    pub fn push(&mut self, priority: Priority, octets: usize, item: T) -> u64 {
        self.push_to(LOOSE, priority, octets, item)
    }

    /// Adds an item that stays until it is taken, whatever is added later: see
    /// [`has_reserve`](Self::has_reserve). Returns how many others were dropped for it.
    #[must_use]
    pub fn push_firm(&mut self, priority: Priority, octets: usize, item: T) -> u64 {
        self.push_to(FIRM, priority, octets, item)
    }

    fn push_to(&mut self, place: usize, priority: Priority, octets: usize, item: T) -> u64 {
        let level = &mut self.levels[usize::from(priority.bits())];
        level.items[place].push_back((self.next, octets, item));
        level.octets[place] += octets;
        self.next += 1;
        let mut dropped = 0;
        while self.is_overfull() && self.drop_least() {
            dropped += 1;
        }
        dropped
    }

    /// The item that [`pop`](Self::pop) removes next.
    #[must_use]
    pub fn first(&self) -> Option<&T> {
        let level = self.levels.iter().rev().find(|it| it.len() > 0)?;
        let (_, _, first) = level.items[level.first()].front()?;
        Some(first)
    }

    /// Removes the oldest item of the highest priority.
    pub fn pop(&mut self) -> Option<T> {
        let mut levels = self.levels.iter_mut().rev();
        levels.find_map(|level| level.pop(level.first()))
    }

    /// Drops the oldest of the items of the lowest priority that may be dropped; returns whether there was
    /// one.
    pub fn drop_least(&mut self) -> bool {
        let mut levels = self.levels.iter_mut();
        levels.any(|level| level.pop(LOOSE).is_some())
    }

    fn is_overfull(&self) -> bool {
        let items = self.len();
        items > 1 && (items > self.bounds.items || self.octets() > self.bounds.octets)
    }
}

impl<T> Default for Level<T> {
    fn default() -> Self {
        Self {
            items: Default::default(),
            octets: Default::default(),
        }
    }
}

impl<T> Level<T> {
    fn len(&self) -> usize {
        self.items.iter().map(VecDeque::len).sum()
    }

    /// The place of the oldest item.
    fn first(&self) -> usize {
        let number = |place: usize| self.items[place].front().map(|it| it.0);
        match (number(LOOSE), number(FIRM)) {
            (Some(loose), Some(firm)) if firm < loose => FIRM,
            (None, _) => FIRM,
            _ => LOOSE,
        }
    }

    fn pop(&mut self, place: usize) -> Option<T> {
        let items = &mut self.items[place];
        let (_, octets, item) = items.pop_front()?;
        self.octets[place] -= octets;
        if items.is_empty() && items.capacity() > 2 * KEPT {
            items.shrink_to(KEPT);
        }
        Some(item)
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

    #[test]
    fn what_must_stay_stays_and_comes_in_order() {
        let mut backlog = backlog(4, 1000);
        let firm = |backlog: &mut Backlog<&'static str>, text: &'static str| {
            assert!(backlog.has_reserve(Priority::Standard));
            backlog.push_firm(Priority::Standard, text.len(), text)
        };
        assert_eq!(firm(&mut backlog, "one"), 0);
        assert_eq!(push(&mut backlog, Priority::Standard, "two"), 0);
        assert_eq!(firm(&mut backlog, "three"), 0);
        assert!(!backlog.has_reserve(Priority::Standard), "half is taken");
        assert!(backlog.has_reserve(Priority::High), "a stop gets in");
        assert_eq!(push(&mut backlog, Priority::High, "four"), 0);
        assert_eq!(backlog.first(), Some(&"four"));
        assert_eq!(push(&mut backlog, Priority::High, "five"), 1, "two");
        assert_eq!(push(&mut backlog, Priority::Low, "six"), 1, "itself");
        assert_eq!(drain(&mut backlog), ["four", "five", "one", "three"]);
    }
}
