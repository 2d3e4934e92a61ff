//! A queue that drops its oldest items.

use std::collections::VecDeque;

/// The most items of a queue.
const MOST_ITEMS: usize = 1000;
/// The most octets of all items of a queue. 8 MiB
const MOST_OCTETS: usize = 1 << 23;

/// Items that wait, each with its size in octets. When there are too many, the oldest are dropped and
/// counted.
#[derive(Debug)]
pub(super) struct Backlog<T> {
    items: VecDeque<(T, usize)>,
    octets: usize,
    depth: usize,
    dropped: u64,
}

impl<T> Backlog<T> {
    /// A queue of so many items: at least 1, at most 1000.
    pub(super) fn new(depth: u64) -> Self {
        let depth = usize::try_from(depth).unwrap_or(MOST_ITEMS);
        Self {
            items: VecDeque::new(),
            octets: 0,
            depth: depth.clamp(1, MOST_ITEMS),
            dropped: 0,
        }
    }

    /// Adds an item; the newest is always kept.
    pub(super) fn push(&mut self, item: T, octets: usize) {
        self.items.push_back((item, octets));
        self.octets += octets;
        while self.items.len() > self.depth || (self.octets > MOST_OCTETS && self.items.len() > 1) {
            self.pop();
            self.dropped += 1;
        }
    }

    /// Takes the oldest item.
    pub(super) fn pop(&mut self) -> Option<T> {
        let (item, octets) = self.items.pop_front()?;
        self.octets -= octets;
        Some(item)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// How many items were dropped.
    pub(super) const fn dropped(&self) -> u64 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_items_are_dropped_and_counted() {
        let mut backlog = Backlog::new(2);
        for item in 1..=5 {
            backlog.push(item, 1);
        }
        assert_eq!(backlog.dropped(), 3);
        assert_eq!(
            (backlog.pop(), backlog.pop(), backlog.pop()),
            (Some(4), Some(5), None)
        );
    }

    #[test]
    fn the_octets_have_a_bound_and_the_newest_item_is_kept() {
        let mut backlog = Backlog::new(u64::MAX);
        for item in 1..=3 {
            backlog.push(item, MOST_OCTETS / 2);
        }
        assert_eq!((backlog.dropped(), backlog.pop()), (1, Some(2)));
        backlog.push(4, 2 * MOST_OCTETS);
        assert_eq!(
            (backlog.dropped(), backlog.pop(), backlog.pop()),
            (2, Some(4), None)
        );
        let mut none = Backlog::new(0);
        none.push(1, 0);
        assert_eq!(none.pop(), Some(1));
    }
}
