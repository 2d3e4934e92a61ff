//! What waits because somebody is slower: bounded, the urgent first, and the stale goes.
//!
//! Both ends of a node need it: a link while the network takes nothing more, and a component's
//! mailbox while it does not read. **When there is no more room, the oldest item of the least
//! urgent priority present goes**; if all that wait are more urgent than the new item, the new one.

use std::collections::VecDeque;

use crate::wire::Priority;

/// How much may wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Bounds {
    /// Items, at least 1.
    pub(crate) items: usize,
    /// Octets of all items. A single larger one is taken when nothing else waits.
    pub(crate) octets: usize,
}

#[derive(Debug)]
pub(crate) struct Backlog<T> {
    bounds: Bounds,
    /// By priority, low first; each item with its octets.
    queues: [VecDeque<(usize, T)>; Priority::ALL.len()],
    items: usize,
    octets: usize,
}

impl<T> Backlog<T> {
    pub(crate) fn new(bounds: Bounds) -> Self {
        Self {
            bounds,
            queues: Default::default(),
            items: 0,
            octets: 0,
        }
    }

    pub(crate) const fn len(&self) -> usize {
        self.items
    }

    pub(crate) const fn octets(&self) -> usize {
        self.octets
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.items == 0
    }

    /// Whether so many more items fit, and less than half of the octets wait.
    pub(crate) const fn has_room(&self, items: usize) -> bool {
        self.items + items <= self.bounds.items && self.octets <= self.bounds.octets / 2
    }

    /// Takes an item in; returns how many items went for it.
    #[must_use]
    pub(crate) fn push(&mut self, priority: Priority, octets: usize, item: T) -> u64 {
        self.items += 1;
        self.octets += octets;
        self.queues[usize::from(priority.bits())].push_back((octets, item));
        let mut dropped = 0;
        while self.is_overfull() && self.drop_least() {
            dropped += 1;
        }
        dropped
    }

    /// Takes out the oldest of the most urgent items.
    pub(crate) fn pop(&mut self) -> Option<T> {
        let taken = self.queues.iter_mut().rev().find_map(take_first);
        self.account(taken)
    }

    const fn is_overfull(&self) -> bool {
        self.items > 1 && (self.items > self.bounds.items || self.octets > self.bounds.octets)
    }

    /// Drops the oldest of the least urgent items; whether there was one.
    pub(crate) fn drop_least(&mut self) -> bool {
        let taken = self.queues.iter_mut().find_map(VecDeque::pop_front);
        self.account(taken).is_some()
    }

    fn account(&mut self, taken: Option<(usize, T)>) -> Option<T> {
        let (octets, item) = taken?;
        self.items -= 1;
        self.octets -= octets;
        Some(item)
    }
}

/// The memory, in items, that an empty queue keeps. A burst may need more, but a node has many
/// components whose only burst is the discovery at its beginning.
const KEPT: usize = 32;

fn take_first<T>(queue: &mut VecDeque<T>) -> Option<T> {
    let first = queue.pop_front()?;
    if queue.is_empty() && queue.capacity() > 2 * KEPT {
        queue.shrink_to(KEPT);
    }
    Some(first)
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
