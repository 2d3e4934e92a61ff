//! A bounded queue that gives the most urgent first, and in order of arrival among equals.

use std::collections::VecDeque;

use crate::wire::Priority;

/// A queue per priority, each with the same bound, so that no priority can crowd out another.
#[derive(Debug)]
pub(super) struct PriorityQueue<T> {
    levels: [VecDeque<T>; Priority::ALL.len()],
    limit: usize,
}

impl<T> PriorityQueue<T> {
    /// A queue for at most `limit` entries of each priority.
    pub(super) fn new(limit: usize) -> Self {
        Self {
            levels: Default::default(),
            limit,
        }
    }

    /// Whether `count` more entries of that priority fit.
    pub(super) fn has_room(&self, priority: Priority, count: usize) -> bool {
        self.levels[usize::from(priority.bits())].len() + count <= self.limit
    }

    /// Puts an entry behind the others of its priority, or gives it back if there are too many.
    pub(super) fn push(&mut self, priority: Priority, entry: T) -> Result<(), T> {
        let level = &mut self.levels[usize::from(priority.bits())];
        if level.len() >= self.limit {
            return Err(entry);
        }
        level.push_back(entry);
        Ok(())
    }

    /// Takes the oldest entry of the highest priority.
    pub(super) fn pop(&mut self) -> Option<T> {
        self.levels.iter_mut().rev().find_map(VecDeque::pop_front)
    }

    /// Takes the oldest entry of that priority.
    pub(super) fn pop_at(&mut self, priority: Priority) -> Option<T> {
        self.levels[usize::from(priority.bits())].pop_front()
    }

    /// Keeps only what `keep` says.
    pub(super) fn retain(&mut self, keep: impl Fn(&T) -> bool) {
        for level in &mut self.levels {
            level.retain(&keep);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_urgent_comes_first_and_equals_keep_their_order() {
        let mut queue = PriorityQueue::new(2);
        for (priority, name) in [
            (Priority::Low, "low"),
            (Priority::Standard, "first"),
            (Priority::SafetyCritical, "stop"),
            (Priority::Standard, "second"),
        ] {
            queue.push(priority, name).unwrap();
        }
        assert_eq!(
            queue.push(Priority::Standard, "third"),
            Err("third"),
            "its level is full"
        );
        assert_eq!(
            queue.push(Priority::High, "soon"),
            Ok(()),
            "another level is not"
        );
        let order: Vec<_> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(order, ["stop", "soon", "first", "second", "low"]);
    }
}
