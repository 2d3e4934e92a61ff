//! A whole state machine: what a service and those it inherits from say about it, merged.
//!
//! States with the same path are the same state, whoever writes them down; the case of letters is
//! passed over, because published definitions are not consistent in it. Every transition and
//! action remembers the service that declares it, which decides which transition comes first:
//! those of the most derived service before those of its bases, within a service those of the
//! innermost state before those around it, and only then, in the same order, those of default
//! states. This is the order in which the public JAUS Tool Set tries them.

use std::collections::HashMap;

use super::{Action, Guard, Name, State, StateMachine, Transition, TransitionKind};
use crate::library::Library;
use crate::model::Service;

/// Which state of a [`Machine`]; only meaningful for the machine that gave it out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StateIndex(usize);

impl StateIndex {
    /// Its place among the [states](Machine::states) of the machine, from 0.
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

/// A state of a [`Machine`], with what all services say about it, the most derived first.
#[derive(Debug, Clone)]
pub struct MachineState<'a> {
    /// From the outermost state inwards.
    pub path: Name,
    /// The state around it.
    pub parent: Option<StateIndex>,
    /// The state within that is entered first; of a composite state never `None`.
    pub initial: Option<StateIndex>,
    /// What the most derived service that names an initial state calls it.
    pub(crate) wanted_initial: Option<&'a str>,
    /// The states within.
    pub children: Vec<StateIndex>,
    /// What is done when it is entered.
    pub entry: Vec<Declared<'a, Action>>,
    /// What is done when it is left.
    pub exit: Vec<Declared<'a, Action>>,
    /// Transitions that may be taken while it is active.
    pub transitions: Vec<Declared<'a, Transition>>,
    /// Transitions that are tried when no other can be taken.
    pub default_transitions: Vec<Declared<'a, Transition>>,
}

/// Something that a service says about a state.
#[derive(Debug)]
pub struct Declared<'a, T> {
    /// The service that says it.
    pub service: &'a Service,
    /// What it says.
    pub item: &'a T,
    /// Steps of inheritance up to the service.
    distance: usize,
}

// Derived, these would ask that what is said can be copied, where only the reference is.
impl<T> Clone for Declared<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Declared<'_, T> {}

/// Something that happens to a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stimulus<'s> {
    /// The event's name, unqualified, for example `Receive`.
    pub event: &'s str,
    /// The name of the message that it brings, if any.
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

    /// What a transition waits for.
    pub fn of(transition: &'s Transition) -> Self {
        Self {
            event: transition.trigger.event.last(),
            message: transition.trigger.message(),
        }
    }

    fn triggers(&self, transition: &Transition) -> bool {
        let trigger = &transition.trigger;
        let same_message = match (self.message, trigger.message()) {
            (Some(message), Some(named)) => named.eq_ignore_ascii_case(message),
            (None, None) => true,
            // The transport's own machine takes every envelope; that is no answer to a message.
            _ => false,
        };
        same_message && trigger.event.last().eq_ignore_ascii_case(self.event)
    }
}

impl<'a> Machine<'a> {
    /// As the most derived service that has it calls it.
    pub fn name(&self) -> &'a Name {
        self.name
    }

    /// The state in which it begins, which holds no others.
    pub fn start(&self) -> StateIndex {
        self.leaf(self.start)
    }

    /// All states, each before those within it.
    pub fn states(&self) -> impl Iterator<Item = (StateIndex, &MachineState<'a>)> {
        let states = self.states.iter().enumerate();
        states.map(|(index, state)| (StateIndex(index), state))
    }

    /// A state by its path, whatever the case of its letters.
    pub fn find(&self, path: &Name) -> Option<StateIndex> {
        self.paths.get(&key(path)).copied()
    }

    /// What is known of a state.
    ///
    /// # Panics
    /// If the index comes from a machine with more states.
    pub fn state(&self, index: StateIndex) -> &MachineState<'a> {
        &self.states[index.0]
    }

    /// The state that becomes active when this one is entered: its initial state, and so on until
    /// there is none within.
    ///
    /// # Panics
    /// As [`state`](Self::state).
    pub fn leaf(&self, index: StateIndex) -> StateIndex {
        let within = |index: &StateIndex| self.state(*index).initial;
        std::iter::successors(Some(index), within)
            .last()
            .unwrap_or(index)
    }

    /// The transitions that a state has for a stimulus, in the order in which their guards are to
    /// be tried.
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
        default.sort_by_key(|declared| declared.distance);
        own.append(&mut default);
        own
    }

    /// What is done when a change from one state to another leaves the first, which holds no
    /// others: the exit actions from there outwards, up to what both are in. A state that is left
    /// for itself is left and entered alone.
    ///
    /// # Panics
    /// As [`state`](Self::state).
    pub fn leaving(&self, from: StateIndex, to: StateIndex) -> impl Iterator<Item = &'a Action> {
        let left = self.alone(from, Some(to));
        let actions = left.into_iter().flat_map(|index| &self.state(index).exit);
        actions.map(|declared| declared.item)
    }

    /// What is done when such a change enters the other state: the entry actions of the states
    /// around it that are new, then its own. From nowhere, all are new.
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

    /// A state and those around it that are not around the other, from inside outwards.
    fn alone(&self, one: StateIndex, other: Option<StateIndex>) -> Vec<StateIndex> {
        let around = |index: StateIndex| {
            let parent = self.state(index).parent;
            std::iter::successors(parent, |index| self.state(*index).parent)
        };
        let shared: Vec<_> = other.into_iter().flat_map(around).collect();
        let alone = around(one).take_while(|index| !shared.contains(index));
        std::iter::once(one).chain(alone).collect()
    }

    /// The transition that a state takes on a stimulus, when `ask` answers the questions of the
    /// guards; see [`Guard::holds`]. `None` if nothing happens.
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

    /// The state that is active after a transition, itself without others within; `None` for a
    /// `pop`, which only the past decides, and for a state that does not exist.
    pub fn target(&self, from: StateIndex, transition: &Transition) -> Option<StateIndex> {
        match &transition.kind {
            TransitionKind::Internal | TransitionKind::Again => Some(from),
            TransitionKind::To(path) | TransitionKind::Push(path) => {
                self.find(path).map(|index| self.leaf(index))
            }
            TransitionKind::Pop => None,
        }
    }
}

fn key(path: &Name) -> String {
    path.to_string().to_ascii_lowercase()
}

impl Library {
    /// The state machines of a service, its own and the inherited ones merged, for example
    /// `ReceiveFSM`. A machine extends that of a base service which has the same unqualified name.
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

/// What one service says about a machine.
struct Part<'a> {
    service: &'a Service,
    machine: &'a StateMachine,
    /// Steps of inheritance up to the service.
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

/// A machine that is being put together.
#[derive(Default)]
struct Merge<'a> {
    states: Vec<MachineState<'a>>,
    paths: HashMap<String, StateIndex>,
}

impl<'a> Merge<'a> {
    /// Puts the parts together, the most derived first; `None` if there is no state at all.
    fn run(mut self, parts: &[Part<'a>]) -> Option<Machine<'a>> {
        for part in parts {
            for state in &part.machine.states {
                self.add(part, None, state);
            }
        }
        self.choose_initial_states();
        let first = parts.first()?;
        let mut starts = parts.iter().map(|part| key(&part.machine.start));
        let start = starts.find_map(|start| self.paths.get(&start).copied());
        // Without a start that exists it begins in its first state, if there is one.
        let start = start.or_else(|| (!self.states.is_empty()).then_some(StateIndex(0)))?;
        Some(Machine {
            name: &first.machine.name,
            start,
            states: self.states,
            paths: self.paths,
        })
    }

    /// Once all states are there: the initial state of a derived service may be one of its base.
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

    /// The place of a state, which may have been there already.
    fn place(&mut self, parent: Option<StateIndex>, state: &'a State) -> StateIndex {
        let mut path = parent.map_or_else(Vec::new, |parent| self.states[parent.0].path.0.clone());
        path.push(state.name.clone());
        let path = Name(path);
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
