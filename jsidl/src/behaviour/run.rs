//! A machine that runs: where it is, what it remembers, and what it does next.
//!
//! The machines that [`rust`](crate::rust) writes do the same, and are tested against this one.

use super::{Action, Guard, Machine, StateIndex, Stimulus, Transition, TransitionKind};

/// How many states a machine remembers at once (`push`). Published machines need one.
pub const MOST_REMEMBERED: usize = 8;

/// A [`Machine`] at some moment.
#[derive(Debug, Clone)]
pub struct Run<'m, 'a> {
    machine: &'m Machine<'a>,
    state: StateIndex,
    remembered: Vec<StateIndex>,
}

/// What became of a stimulus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// A transition was taken.
    Handled,
    /// The state has no transition for it.
    Ignored,
    /// The state has transitions for it, and none could be taken: no guard held, or there was no
    /// state to go back to, or no room to remember one more.
    Rejected,
}

impl<'m, 'a> Run<'m, 'a> {
    /// Enters the start state, and the states around it before.
    pub fn start(machine: &'m Machine<'a>, act: &mut impl FnMut(&'a Action)) -> Self {
        let state = machine.start();
        machine.entering(None, state).for_each(act);
        Self::at(machine, state)
    }

    /// In a state, which is entered without any action, and with nothing to remember. Of a state
    /// with others inside it is the one that is entered first.
    pub fn at(machine: &'m Machine<'a>, state: StateIndex) -> Self {
        Self {
            machine,
            state: machine.leaf(state),
            remembered: Vec::new(),
        }
    }

    /// The active state, which has no others inside.
    pub fn state(&self) -> StateIndex {
        self.state
    }

    /// Takes the first transition whose guard holds, when `ask` answers the guards' questions.
    /// `act` is given what is to be done: the actions of the states that are left, the innermost
    /// first, those of the transition, and those of the states that are entered.
    pub fn step(
        &mut self,
        stimulus: Stimulus<'_>,
        ask: &mut impl FnMut(&Guard) -> bool,
        act: &mut impl FnMut(&'a Action),
    ) -> Outcome {
        let candidates = self.machine.candidates(self.state, stimulus);
        let nothing = if candidates.is_empty() {
            Outcome::Ignored
        } else {
            Outcome::Rejected
        };
        let taken = candidates.into_iter().find_map(|declared| {
            let guard = declared.item.guard.as_ref();
            let holds = guard.is_none_or(|guard| guard.holds(ask));
            let to = holds.then(|| self.destination(declared.item)).flatten()?;
            Some((declared.item, to))
        });
        let Some((transition, to)) = taken else {
            return nothing;
        };
        self.take(transition, to, act);
        Outcome::Handled
    }

    /// Where a transition leads now; `None` if it cannot be taken.
    fn destination(&self, transition: &Transition) -> Option<StateIndex> {
        match transition.kind {
            TransitionKind::Pop => self.remembered.last().copied(),
            TransitionKind::Push(_) if self.remembered.len() >= MOST_REMEMBERED => None,
            _ => self.machine.target(self.state, transition),
        }
    }

    fn take(
        &mut self,
        transition: &'a Transition,
        to: StateIndex,
        act: &mut impl FnMut(&'a Action),
    ) {
        let from = self.state;
        match transition.kind {
            TransitionKind::Internal => return transition.actions.iter().for_each(act),
            TransitionKind::Push(_) => self.remembered.push(from),
            TransitionKind::Pop => _ = self.remembered.pop(),
            TransitionKind::To(_) | TransitionKind::Again => {}
        }
        self.machine.leaving(from, to).for_each(&mut *act);
        transition.actions.iter().for_each(&mut *act);
        self.machine.entering(Some(from), to).for_each(act);
        self.state = to;
    }
}
