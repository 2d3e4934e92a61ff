//! Step functions of a generated machine: the reaction of each state to each event.

use std::collections::{HashMap, HashSet};

use super::super::writer::Writer;
use super::states::States;
use super::vocabulary::{Event, Kind, Method, Value, Vocabulary, comparison, value};
use crate::behaviour::{Action, Call, Guard, Transition, TransitionKind, Trigger};
use crate::machine::{Declared, Machine, MachineState, StateIndex, Stimulus};

/// Input of the generator.
pub(super) struct Steps<'a> {
    pub(super) machine: &'a Machine<'a>,
    pub(super) states: &'a States,
    pub(super) vocabulary: &'a Vocabulary,
}

/// States by their reaction.
#[derive(Default)]
struct Groups {
    /// In the order of their first states.
    all: Vec<(Vec<StateIndex>, String)>,
    places: HashMap<String, usize>,
}

impl Groups {
    fn add(&mut self, state: StateIndex, reaction: String) {
        let place = *self.places.entry(reaction).or_insert_with_key(|reaction| {
            self.all.push((Vec::new(), reaction.clone()));
            self.all.len() - 1
        });
        self.all[place].0.push(state);
    }
}

/// The transitions that a machine can take on a stimulus. They are looked up once for all states
/// inside the same one.
struct Reactions<'a> {
    machine: &'a Machine<'a>,
    stimulus: Stimulus<'a>,
    /// The states with a transition of their own.
    concerned: HashSet<StateIndex>,
    known: HashMap<StateIndex, Vec<Declared<'a, Transition>>>,
}

impl<'a> Reactions<'a> {
    fn to(machine: &'a Machine<'a>, stimulus: Stimulus<'a>) -> Self {
        let reacts = |state: &MachineState<'_>| {
            let mut all = state.transitions.iter().chain(&state.default_transitions);
            all.any(|it| stimulus.triggers(it.item))
        };
        let concerned = machine.states().filter(|(_, state)| reacts(state));
        Self {
            machine,
            stimulus,
            concerned: concerned.map(|(index, _)| index).collect(),
            known: HashMap::new(),
        }
    }

    /// Those of a state and the states around it; `None` if there are none.
    fn of(&mut self, state: StateIndex) -> Option<&[Declared<'a, Transition>]> {
        let outwards = |index: &StateIndex| self.machine.state(*index).parent;
        let mut around = std::iter::successors(Some(state), outwards);
        let innermost = around.find(|index| self.concerned.contains(index))?;
        let candidates = || self.machine.candidates(innermost, self.stimulus);
        Some(self.known.entry(innermost).or_insert_with(candidates))
    }
}

impl Steps<'_> {
    /// Writes the function that handles an event.
    pub(super) fn handler(&self, out: &mut Writer, event: &Event, signature: &str) {
        out.gap();
        out.push(signature);
        let mut groups = Groups::default();
        let stimulus = event.stimulus();
        let mut reactions = Reactions::to(self.machine, stimulus);
        for &leaf in self.states.leaves() {
            let body = match reactions.of(leaf) {
                Some(candidates) => self.body(leaf, candidates),
                None => "Outcome::Ignored".into(),
            };
            groups.add(leaf, body);
        }
        let mut groups = groups.all;
        if let [(_, body)] = groups.as_slice() {
            out.push(body);
        } else {
            // The most common reaction, usually none, comes last.
            groups.sort_by_key(|(states, _)| states.len());
            out.push("match self.state {");
            let last = groups.len() - 1;
            for (number, (states, body)) in groups.iter().enumerate() {
                let pattern = if number == last {
                    "_".to_owned()
                } else {
                    self.pattern(states)
                };
                if body.contains('\n') {
                    out.push(format!("{pattern} => {{\n{body}\n}}"));
                } else {
                    out.push(format!("{pattern} => {body},"));
                }
            }
            out.push("}");
        }
        out.push("}");
    }

    /// Writes the function that follows the component's control through these states.
    pub(super) fn follow(&self, out: &mut Writer, inherited: &[StateIndex]) {
        out.gap();
        out.push("/// Enters the innermost state on this path, unless the machine is in it.");
        out.push(
            "pub fn follow<B: Behaviour + ?Sized>(&mut self, path: &[&str], behaviour: &mut B) {",
        );
        let branches = inherited.iter().map(|&state| {
            let path = self.machine.state(state).path.parts();
            format!(
                "if path.starts_with(&{path:?}) {{\n{}}}",
                self.entrance(state)
            )
        });
        out.push(branches.collect::<Vec<_>>().join(" else "));
        out.push("}");
    }

    /// Enters a state, unless the machine is in it.
    fn entrance(&self, state: StateIndex) -> String {
        let to = self.machine.leaf(state);
        let mut inside = Vec::new();
        let mut groups = Groups::default();
        for &leaf in self.states.leaves() {
            let mut around = std::iter::successors(Some(leaf), |it| self.machine.state(*it).parent);
            if around.any(|it| it == state) {
                inside.push(leaf);
                continue;
            }
            let leaving = self.actions(None, self.machine.leaving(leaf, to));
            let entering = self.actions(None, self.machine.entering(Some(leaf), to));
            groups.add(leaf, leaving + &entering);
        }
        let arms = groups.all.iter().filter(|(_, done)| !done.is_empty());
        let arms = arms.map(|(states, done)| format!("{} => {{\n{done}}}\n", self.pattern(states)));
        let arms: String = arms.collect();
        let actions = match arms.as_str() {
            "" => String::new(),
            arms => format!("match self.state {{\n{arms}_ => {{}}\n}}\n"),
        };
        format!(
            "if !matches!(self.state, {}) {{\n{actions}self.state = {};\n}}\n",
            self.pattern(&inside),
            self.state(to)
        )
    }

    fn pattern(&self, states: &[StateIndex]) -> String {
        let states = states.iter().map(|&state| self.state(state));
        states.collect::<Vec<_>>().join(" | ")
    }

    fn state(&self, state: StateIndex) -> String {
        format!("State::{}", self.states.ident(state))
    }

    /// The reaction of a state to an event, as an expression of type `Outcome`.
    fn body(&self, leaf: StateIndex, candidates: &[Declared<'_, Transition>]) -> String {
        let mut text = String::new();
        for Declared { item, .. } in candidates {
            let Some(effect) = self.effect(leaf, item) else {
                // Its target does not exist, so it is never taken.
                continue;
            };
            let Some(condition) = self.condition(item) else {
                let alone = text.is_empty();
                let last = format!("{effect}Outcome::Handled");
                text.push_str(&if alone {
                    last
                } else {
                    format!("{{\n{last}\n}}")
                });
                return text;
            };
            text.push_str(&format!(
                "if {condition} {{\n{effect}Outcome::Handled\n}} else "
            ));
        }
        if text.is_empty() {
            return "Outcome::Rejected".into();
        }
        text + "{\nOutcome::Rejected\n}"
    }

    /// The condition of a transition; `None` for unconditional ones.
    fn condition(&self, transition: &Transition) -> Option<String> {
        let room = match transition.kind {
            TransitionKind::Push(_) => Some("self.remembered.has_room()"),
            TransitionKind::Pop(_) => Some("self.remembered.is_used()"),
            _ => None,
        };
        let trigger = &transition.trigger;
        match (&transition.guard, room) {
            (None, room) => room.map(str::to_owned),
            (Some(guard), None) => Some(self.guard(trigger, guard, 0)),
            (Some(guard), Some(room)) => {
                Some(format!("{} && {room}", self.guard(trigger, guard, 1)))
            }
        }
    }

    /// A guard as a Rust condition; in parentheses if it binds less than `least`.
    fn guard(&self, trigger: &Trigger, guard: &Guard, least: u8) -> String {
        let (rank, text) = match guard {
            Guard::Or(left, right) => (
                0,
                [left, right]
                    .map(|it| self.guard(trigger, it, 0))
                    .join(" || "),
            ),
            Guard::And(left, right) => (
                1,
                [left, right]
                    .map(|it| self.guard(trigger, it, 1))
                    .join(" && "),
            ),
            Guard::Not(inner) => (2, format!("!{}", self.guard(trigger, inner, 2))),
            question => match comparison(trigger, question) {
                Some(condition) => (1, condition),
                None => {
                    let asked = self.vocabulary.question(trigger, question);
                    let call =
                        asked.map(|(method, values)| self.call(Some(trigger), method, &values));
                    (3, call.unwrap_or_else(|| "false".into()))
                }
            },
        };
        if rank < least {
            format!("({text})")
        } else {
            text
        }
    }

    /// The effect of a transition; `None` if it cannot be taken.
    fn effect(&self, leaf: StateIndex, transition: &Transition) -> Option<String> {
        let trigger = Some(&transition.trigger);
        let own = self.actions(trigger, transition.actions.iter());
        let text = match &transition.kind {
            TransitionKind::Internal => own,
            TransitionKind::Pop(then) => self.back(leaf, &own) + &self.then(trigger, then.as_ref()),
            TransitionKind::To(_) | TransitionKind::Again | TransitionKind::Push(_) => {
                let to = self.machine.target(leaf, transition)?;
                let leaving = self.actions(None, self.machine.leaving(leaf, to));
                let entering = self.actions(None, self.machine.entering(Some(leaf), to));
                let remember = match &transition.kind {
                    TransitionKind::Push(push) => {
                        let back = self.machine.remembered(leaf, push)?;
                        let back = match back == leaf {
                            true => "self.state".to_owned(),
                            false => self.state(back),
                        };
                        format!("self.remembered.push({back});\n")
                    }
                    _ => String::new(),
                };
                let state = self.state(to);
                let stays = to == leaf && remember.is_empty();
                let change = if stays {
                    String::new()
                } else {
                    format!("self.state = {state};\n")
                };
                format!("{remember}{leaving}{own}{entering}{change}")
            }
        };
        Some(text)
    }

    /// The event that follows a return, with its numbers.
    fn then(&self, trigger: Option<&Trigger>, then: Option<&Call>) -> String {
        let events = &self.vocabulary.events;
        let call = then.and_then(|then| {
            let named = |it: &&Event| it.name.eq_ignore_ascii_case(then.name.last());
            let event = events.iter().find(|it| it.message.is_none() && named(it))?;
            let numbers = then.arguments.iter().map(|it| match value(trigger, it) {
                Value::Number(number) => format!("number_{number}, "),
                Value::Text(digits) => format!("{digits}, "),
                Value::Message | Value::Envelope => String::new(),
            });
            let numbers: String = numbers.collect();
            Some(format!(
                "let _ = self.{}({numbers}behaviour);\n",
                event.handler
            ))
        });
        call.unwrap_or_default()
    }

    /// Returns to the state that was remembered last.
    fn back(&self, leaf: StateIndex, own: &str) -> String {
        let leaving = self.by_destination(|to| self.actions(None, self.machine.leaving(leaf, to)));
        let entering =
            self.by_destination(|to| self.actions(None, self.machine.entering(Some(leaf), to)));
        format!(
            "if let Some(to) = self.remembered.pop() {{\n{leaving}{own}{entering}self.state = to;\n}}\n"
        )
    }

    fn by_destination(&self, actions: impl Fn(StateIndex) -> String) -> String {
        let mut text = String::new();
        for &to in self.states.leaves() {
            let done = actions(to);
            if !done.is_empty() {
                text.push_str(&format!("{} => {{\n{done}}}\n", self.state(to)));
            }
        }
        if text.is_empty() {
            return text;
        }
        format!("match to {{\n{text}_ => {{}}\n}}\n")
    }

    /// Calls, one per line.
    pub(super) fn actions<'i>(
        &self,
        trigger: Option<&Trigger>,
        actions: impl Iterator<Item = &'i Action>,
    ) -> String {
        let calls = actions.filter_map(|action| {
            let (method, values) = self.vocabulary.action(trigger, action)?;
            Some(format!("{};\n", self.call(trigger, method, &values)))
        });
        calls.collect()
    }

    fn call(&self, trigger: Option<&Trigger>, method: &Method, values: &[Value]) -> String {
        let event = trigger.and_then(|trigger| self.vocabulary.event_of(trigger));
        let places = method.parameters().zip(values);
        let arguments = places.map(|((kind, given), value)| match value {
            Value::Message if kind == Kind::Message && given.events.len() > 1 => {
                let event = event.map_or("", |event| &self.vocabulary.events[event].ident);
                format!("{}::{event}(message)", method.message_type)
            }
            Value::Message => "message".to_owned(),
            Value::Envelope => "envelope".to_owned(),
            Value::Number(number) => format!("number_{number}"),
            Value::Text(text) => format!("{text:?}"),
        });
        let arguments: Vec<_> = arguments.collect();
        format!("behaviour.{}({})", method.ident, arguments.join(", "))
    }
}
