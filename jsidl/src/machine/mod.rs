//! Merged state machine of a service and its bases: [`Run`] executes it, [`dot`] and [`mermaid`]
//! draw it.
//!
//! States with the same path are the same state in all services; letter case is ignored, because
//! published definitions are inconsistent. Every transition and action keeps its declaring service,
//! which determines the order of transitions: the most derived service before its bases, within a
//! service the innermost state before the outer ones, and default states last, in the same order.
//! The public JAUS Tool Set uses this order.

mod draw;
mod run;

use std::collections::HashMap;

use crate::behaviour::{
    Action, Guard, Name, Push, State, StateMachine, Transition, TransitionKind,
};
use crate::library::Library;
use crate::model::Service;

pub use draw::{dot, mermaid};
pub use run::{MOST_REMEMBERED, Outcome, Run};

/// Index of a state of a [`Machine`]; only meaningful for the machine that returned it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StateIndex(usize);

impl StateIndex {
    /// Its position among the [states](Machine::states) of the machine, from 0.
    pub const fn number(self) -> usize {
        self.0
    }
}

/// A state machine, merged along `inherits_from`.
#[derive(Debug, Clone)]
pub struct Machine<'a> {
    name: &'a Name,
    start: StateIndex,
    states: Vec<MachineState<'a>>,
    /// By path in lower case.
    paths: HashMap<String, StateIndex>,
}

/// A state of a [`Machine`], with the declarations of all services, the most derived first.
#[derive(Debug, Clone)]
pub struct MachineState<'a> {
    /// From the outermost state inwards.
    pub path: Name,
    /// The enclosing state.
    pub parent: Option<StateIndex>,
    /// The substate that is entered first; never `None` in a composite state.
    pub initial: Option<StateIndex>,
    /// The initial state named by the most derived service that names one.
    pub(crate) wanted_initial: Option<&'a str>,
    /// The substates.
    pub children: Vec<StateIndex>,
    /// Actions on entry.
    pub entry: Vec<Declared<'a, Action>>,
    /// Actions on exit.
    pub exit: Vec<Declared<'a, Action>>,
    /// Transitions that can be taken while it is active.
    pub transitions: Vec<Declared<'a, Transition>>,
    /// Transitions that are tried when no other can be taken.
    pub default_transitions: Vec<Declared<'a, Transition>>,
}

/// A declaration about a state, with its service.
#[derive(Debug)]
pub struct Declared<'a, T> {
    /// The declaring service.
    pub service: &'a Service,
    /// The declaration.
    pub item: &'a T,
    /// Inheritance distance to the service.
    distance: usize,
}

// A derived `Clone` would require `T: Clone`, although only the reference is copied.
impl<T> Clone for Declared<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Declared<'_, T> {}

/// An event for a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stimulus<'s> {
    /// The event's name, unqualified, for example `Receive`.
    pub event: &'s str,
    /// The name of the received message, if any.
    pub message: Option<&'s str>,
}

impl<'s> Stimulus<'s> {
    /// The arrival of a message.
    pub const fn received(message: &'s str) -> Self {
        Self {
            event: "Receive",
            message: Some(message),
        }
    }

    /// An event without a message.
    pub const fn event(event: &'s str) -> Self {
        Self {
            event,
            message: None,
        }
    }

    /// The stimulus that triggers a transition; `None` for a default transition, which every
    /// stimulus triggers.
    pub fn of(transition: &'s Transition) -> Option<Self> {
        Some(Self {
            event: transition.trigger.name()?,
            message: transition.trigger.message(),
        })
    }

    pub(crate) fn triggers(&self, transition: &Transition) -> bool {
        let trigger = &transition.trigger;
        let Some(event) = trigger.name() else {
            return true;
        };
        let same_message = match (self.message, trigger.message()) {
            (Some(message), Some(named)) => named.eq_ignore_ascii_case(message),
            (None, None) => true,
            // The transport's own machine accepts every envelope; that is no reaction to a message.
            _ => false,
        };
        same_message && event.eq_ignore_ascii_case(self.event)
    }
}

impl<'a> Machine<'a> {
    /// The name in the most derived service that declares the machine.
    pub fn name(&self) -> &'a Name {
        self.name
    }

    /// The start state, a leaf state.
    pub fn start(&self) -> StateIndex {
        self.leaf(self.start)
    }

    /// All states, each before its substates.
    pub fn states(&self) -> impl Iterator<Item = (StateIndex, &MachineState<'a>)> {
        let states = self.states.iter().enumerate();
        states.map(|(index, state)| (StateIndex(index), state))
    }

    /// All transitions, including the default ones.
    pub(crate) fn transitions(&self) -> impl Iterator<Item = &Declared<'a, Transition>> {
        let states = self.states.iter();
        states.flat_map(|it| it.transitions.iter().chain(&it.default_transitions))
    }

    /// Whether it has any transition.
    pub(crate) fn has_transitions(&self) -> bool {
        self.transitions().next().is_some()
    }

    /// The machine without the transitions and actions of some services. The states stay.
    pub(crate) fn without(mut self, left_out: impl Fn(&Service) -> bool) -> Self {
        for state in &mut self.states {
            state.entry.retain(|it| !left_out(it.service));
            state.exit.retain(|it| !left_out(it.service));
            state.transitions.retain(|it| !left_out(it.service));
            state.default_transitions.retain(|it| !left_out(it.service));
        }
        self
    }

    /// Finds a state by its path, ignoring letter case.
    pub fn find(&self, path: &Name) -> Option<StateIndex> {
        self.paths.get(&key(path)).copied()
    }

    /// The state with this index.
    ///
    /// # Panics
    /// If the index comes from a machine with more states.
    pub fn state(&self, index: StateIndex) -> &MachineState<'a> {
        &self.states[index.0]
    }

    /// The leaf state that becomes active when this state is entered: its initial state, and so on.
    ///
    /// # Panics
    /// As [`state`](Self::state).
    pub fn leaf(&self, index: StateIndex) -> StateIndex {
        let within = |index: &StateIndex| self.state(*index).initial;
        std::iter::successors(Some(index), within)
            .last()
            .unwrap_or(index)
    }

    /// The transitions of a state for a stimulus, in the order in which their guards are tried.
    ///
    /// # Panics
    /// As [`state`](Self::state).
    pub fn candidates(
        &self,
        index: StateIndex,
        stimulus: Stimulus<'_>,
    ) -> Vec<Declared<'a, Transition>> {
        let outwards = || {
            let around = |index: &StateIndex| self.state(*index).parent;
            std::iter::successors(Some(index), around).map(|index| self.state(index))
        };
        let own = outwards().flat_map(|state| &state.transitions);
        let default = outwards().flat_map(|state| &state.default_transitions);
        let triggered = |declared: &&Declared<'a, Transition>| stimulus.triggers(declared.item);
        let mut own: Vec<_> = own.filter(triggered).copied().collect();
        let mut default: Vec<_> = default.filter(triggered).copied().collect();
        own.sort_by_key(|declared| declared.distance);
        // Those without a trigger come last.
        default.sort_by_key(|it| (it.item.trigger.event.is_none(), it.distance));
        own.append(&mut default);
        own
    }

    /// The exit actions of a change from the leaf state `from` to another state: from `from`
    /// outwards, up to the innermost state around both. A self-transition leaves and enters only
    /// the state itself.
    ///
    /// # Panics
    /// As [`state`](Self::state).
    pub fn leaving(&self, from: StateIndex, to: StateIndex) -> impl Iterator<Item = &'a Action> {
        let left = self.alone(from, Some(to));
        let actions = left.into_iter().flat_map(|index| &self.state(index).exit);
        actions.map(|declared| declared.item)
    }

    /// The entry actions of such a change: of the newly entered enclosing states, then of the state
    /// itself. Without `from`, all enclosing states are new.
    ///
    /// # Panics
    /// As [`state`](Self::state).
    pub fn entering(
        &self,
        from: Option<StateIndex>,
        to: StateIndex,
    ) -> impl Iterator<Item = &'a Action> {
        let entered = self.alone(to, from).into_iter().rev();
        let actions = entered.flat_map(|index| &self.state(index).entry);
        actions.map(|declared| declared.item)
    }

    /// A state and those of its enclosing states that do not enclose the other, from inside
    /// outwards.
    fn alone(&self, one: StateIndex, other: Option<StateIndex>) -> Vec<StateIndex> {
        let around = |index: StateIndex| {
            let parent = self.state(index).parent;
            std::iter::successors(parent, |index| self.state(*index).parent)
        };
        let shared: Vec<_> = other.into_iter().flat_map(around).collect();
        let alone = around(one).take_while(|index| !shared.contains(index));
        std::iter::once(one).chain(alone).collect()
    }

    /// The transition that a state takes on a stimulus; `ask` evaluates the guards, see
    /// [`Guard::holds`]. `None` if there is none.
    ///
    /// # Panics
    /// As [`state`](Self::state).
    pub fn reaction(
        &self,
        index: StateIndex,
        stimulus: Stimulus<'_>,
        ask: &mut impl FnMut(&Guard) -> bool,
    ) -> Option<Declared<'a, Transition>> {
        let mut candidates = self.candidates(index, stimulus).into_iter();
        candidates.find(|declared| {
            let guard = declared.item.guard.as_ref();
            guard.is_none_or(|guard| guard.holds(ask))
        })
    }

    /// The leaf state that is active after a transition; `None` for a `pop`, which depends on the
    /// history, and for a state that does not exist.
    pub fn target(&self, from: StateIndex, transition: &Transition) -> Option<StateIndex> {
        match &transition.kind {
            TransitionKind::Internal | TransitionKind::Again => Some(from),
            TransitionKind::To(path) | TransitionKind::Push(Push { to: path, .. }) => {
                self.find(path).map(|index| self.leaf(index))
            }
            TransitionKind::Pop(_) => None,
        }
    }

    /// Whether some transition within or around a state returns to the remembered one.
    pub(crate) fn returns(&self, index: StateIndex) -> bool {
        let is_within = |inner: StateIndex, outer: StateIndex| {
            let around = |index: &StateIndex| self.state(*index).parent;
            std::iter::successors(Some(inner), around).any(|index| index == outer)
        };
        let related = self
            .states()
            .filter(|(other, _)| is_within(*other, index) || is_within(index, *other));
        let mut transitions = related.flat_map(|(_, state)| {
            let all = state.transitions.iter().chain(&state.default_transitions);
            all.map(|declared| &declared.item.kind)
        });
        transitions.any(|kind| matches!(kind, TransitionKind::Pop(_)))
    }

    /// The leaf state that a `push` remembers; `None` if it does not exist.
    pub fn remembered(&self, from: StateIndex, push: &Push) -> Option<StateIndex> {
        match &push.back {
            Some(path) => self.find(path).map(|index| self.leaf(index)),
            None => Some(from),
        }
    }
}

fn key(path: &Name) -> String {
    path.to_string().to_ascii_lowercase()
}

impl Library {
    /// The state machines of a service, its own and the inherited ones merged, for example
    /// `ReceiveFSM`. A machine extends the base service's machine with the same unqualified name.
    pub fn machines<'a>(&'a self, service: &'a Service) -> Vec<Machine<'a>> {
        let mut machines: Vec<Vec<Part<'a>>> = Vec::new();
        for (distance, service) in self.lineage(service).enumerate() {
            for machine in &service.behaviour {
                let part = Part {
                    service,
                    machine,
                    distance,
                };
                match machines.iter_mut().find(|parts| parts[0].extends(machine)) {
                    Some(parts) => parts.push(part),
                    None => machines.push(vec![part]),
                }
            }
        }
        let merged = machines.iter().map(|parts| Merge::default().run(parts));
        merged.flatten().collect()
    }
}

/// The declarations of one service about a machine.
struct Part<'a> {
    service: &'a Service,
    machine: &'a StateMachine,
    /// Inheritance distance to the service.
    distance: usize,
}

impl<'a> Part<'a> {
    fn extends(&self, base: &StateMachine) -> bool {
        let own = self.machine.name.last();
        own.eq_ignore_ascii_case(base.name.last())
    }

    fn declared<T>(&self, item: &'a T) -> Declared<'a, T> {
        Declared {
            service: self.service,
            item,
            distance: self.distance,
        }
    }
}

/// A machine during the merge.
#[derive(Default)]
struct Merge<'a> {
    states: Vec<MachineState<'a>>,
    paths: HashMap<String, StateIndex>,
}

impl<'a> Merge<'a> {
    /// Merges the parts, the most derived first; `None` without any state.
    fn run(mut self, parts: &[Part<'a>]) -> Option<Machine<'a>> {
        for part in parts {
            for state in &part.machine.states {
                self.add(part, None, state);
            }
        }
        self.add_defaults(parts);
        self.choose_initial_states();
        let first = parts.first()?;
        let mut starts = parts.iter().map(|part| key(&part.machine.start));
        let start = starts.find_map(|start| self.paths.get(&start).copied());
        // Without a valid start it begins in its first state, if there is one.
        let start = start.or_else(|| (!self.states.is_empty()).then_some(StateIndex(0)))?;
        Some(Machine {
            name: &first.machine.name,
            start,
            states: self.states,
            paths: self.paths,
        })
    }

    /// The default transitions of a whole machine are default transitions of its outermost states.
    fn add_defaults(&mut self, parts: &[Part<'a>]) {
        let outermost = self.states.iter_mut();
        for state in outermost.filter(|state| state.parent.is_none()) {
            for part in parts {
                let default = part.machine.default_transitions.iter();
                let default = default.map(|item| part.declared(item));
                state.default_transitions.extend(default);
            }
        }
    }

    /// Runs after all states exist: a derived service may name an initial state of its base.
    fn choose_initial_states(&mut self) {
        for state in &mut self.states {
            let wanted = state.wanted_initial.and_then(|initial| {
                let path = format!("{}.{}", key(&state.path), initial.to_ascii_lowercase());
                self.paths.get(&path).copied()
            });
            state.initial = wanted.or_else(|| state.children.first().copied());
        }
    }

    fn add(&mut self, part: &Part<'a>, parent: Option<StateIndex>, state: &'a State) {
        let index = self.place(parent, state);
        for child in &state.children {
            self.add(part, Some(index), child);
        }
        let merged = &mut self.states[index.0];
        merged.wanted_initial = merged.wanted_initial.or(state.initial.as_deref());
        merged
            .entry
            .extend(state.entry.iter().map(|item| part.declared(item)));
        merged
            .exit
            .extend(state.exit.iter().map(|item| part.declared(item)));
        let own = state.transitions.iter();
        merged
            .transitions
            .extend(own.map(|item| part.declared(item)));
        let default = state.default_transitions.iter();
        merged
            .default_transitions
            .extend(default.map(|item| part.declared(item)));
    }

    /// The index of a state, which is added if it is new.
    fn place(&mut self, parent: Option<StateIndex>, state: &'a State) -> StateIndex {
        let path = match parent {
            Some(parent) => self.states[parent.0].path.join(&state.name),
            None => Name::of(vec![&state.name]),
        };
        let key = key(&path);
        if let Some(index) = self.paths.get(&key) {
            return *index;
        }
        let index = StateIndex(self.states.len());
        self.paths.insert(key, index);
        if let Some(parent) = parent {
            self.states[parent.0].children.push(index);
        }
        self.states.push(MachineState {
            path,
            parent,
            initial: None,
            wanted_initial: None,
            children: Vec::new(),
            entry: Vec::new(),
            exit: Vec::new(),
            transitions: Vec::new(),
            default_transitions: Vec::new(),
        });
        index
    }
}
