//! What generated state machines share: what became of an event, and the states to go back to.

/// What became of an event that a machine was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[must_use]
pub enum Outcome {
    /// A transition was taken.
    Handled,
    /// The state has no transition for it.
    Ignored,
    /// The state has transitions for it, and none could be taken: no guard held, or there was no
    /// state to go back to, or no room to remember one more.
    Rejected,
}

/// The states that a machine goes back to, the last first; at most `N`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory<S, const N: usize> {
    states: [Option<S>; N],
    count: usize,
}

impl<S: Copy, const N: usize> Memory<S, N> {
    /// Nothing to go back to.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            states: [None; N],
            count: 0,
        }
    }

    /// Whether there is a state to go back to.
    #[must_use]
    pub const fn is_used(&self) -> bool {
        self.count > 0
    }

    /// Whether one more can be remembered.
    #[must_use]
    pub const fn has_room(&self) -> bool {
        self.count < N
    }

    /// Remembers a state; without effect if there is no [room](Self::has_room).
    pub fn push(&mut self, state: S) {
        if let Some(place) = self.states.get_mut(self.count) {
            *place = Some(state);
            self.count += 1;
        }
    }

    /// Takes out the state that was remembered last.
    pub fn pop(&mut self) -> Option<S> {
        let last = self.count.checked_sub(1)?;
        self.count = last;
        self.states.get_mut(last)?.take()
    }
}

impl<S: Copy, const N: usize> Default for Memory<S, N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_remembered_last_comes_back_first_and_no_more_than_there_is_room_for() {
        let mut memory = Memory::<u8, 2>::new();
        assert!(memory.has_room() && !memory.is_used());
        for state in [1, 2, 3] {
            memory.push(state);
        }
        assert!(!memory.has_room() && memory.is_used());
        assert_eq!(
            [memory.pop(), memory.pop(), memory.pop()],
            [Some(2), Some(1), None]
        );
    }
}
