//! Shared parts of generated state machines: the outcome of an event and the stack of return
//! states.

/// Result of passing an event to a state machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[must_use]
pub enum Outcome {
    /// The machine took a transition.
    Handled,
    /// The state has no transition for the event.
    Ignored,
    /// The state has transitions for the event, but none was possible: no guard held, there was no
    /// state to return to, or the return stack was full.
    Rejected,
}

/// A stack of at most `N` states to return to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory<S, const N: usize> {
    states: [Option<S>; N],
    count: usize,
}

impl<S: Copy, const N: usize> Memory<S, N> {
    /// Creates an empty stack.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            states: [None; N],
            count: 0,
        }
    }

    /// Whether there is a state to return to.
    #[must_use]
    pub const fn is_used(&self) -> bool {
        self.count > 0
    }

    /// Whether the stack has room for another state.
    #[must_use]
    pub const fn has_room(&self) -> bool {
        self.count < N
    }

    /// Pushes a state. No effect if there is no [room](Self::has_room).
    pub fn push(&mut self, state: S) {
        if let Some(place) = self.states.get_mut(self.count) {
            *place = Some(state);
            self.count += 1;
        }
    }

    /// Removes and returns the state pushed last.
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
    fn states_return_in_reverse_order_up_to_the_capacity() {
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
