//! Rules for state machines: references resolve, with the same spelling, and an extended machine
//! keeps the guarantees of its base.
//!
//! A violation that no published definition has is an error. Where published definitions are
//! careless and the merged machine is still defined (letter case is ignored, a composite state
//! begins in its first state), it is a warning.

use super::triggers::{Events, Triggers};
use crate::behaviour::{Argument, Guard, Name, State, StateMachine, Transition, TransitionKind};
use crate::diagnostic::Report;
use crate::library::Library;
use crate::machine::{Machine, MachineState};
use crate::model::Service;
use crate::source::Span;

/// Checks the machines that a service declares, against its inherited ones. `states_left` bounds
/// the work for all services together.
pub(crate) fn behaviour(
    report: &mut Report,
    library: &Library,
    service: &Service,
    events: &Events<'_>,
    states_left: &mut usize,
) {
    let Some(first) = service.behaviour.first() else {
        return;
    };
    let lineage = library.lineage(service).flat_map(|base| &base.behaviour);
    let states: usize = lineage.map(|machine| machine.all_states().count()).sum();
    let Some(left) = states_left.checked_sub(states) else {
        let message = "the services inherit too many states: this and the following state \
            machines are not checked";
        if *states_left > 0 {
            report.warning(first.span, message);
        }
        *states_left = 0;
        return;
    };
    *states_left = left;
    let machines = library.machines(service);
    let base = library.lineage(service).nth(1);
    let inherited = base.map_or_else(Vec::new, |base| library.machines(base));
    let triggers = Triggers::of(library, service, events);
    for own in &service.behaviour {
        let same = |machine: &&Machine<'_>| machine.name() == &own.name;
        let last = own.name.last();
        let extended = |machine: &&Machine<'_>| machine.name().last().eq_ignore_ascii_case(last);
        if let Some(machine) = machines.iter().find(same) {
            let mut check = Check {
                report,
                machine,
                base: inherited.iter().find(extended),
                triggers: &triggers,
            };
            check.machine(own);
        }
    }
}

struct Check<'a> {
    report: &'a mut Report,
    machine: &'a Machine<'a>,
    /// The base machine that this one extends.
    base: Option<&'a Machine<'a>>,
    triggers: &'a Triggers<'a>,
}

impl Check<'_> {
    fn machine(&mut self, own: &StateMachine) {
        self.existing(own.span, "the start", &own.start);
        self.refining(own);
        for state in &own.states {
            self.state(&Name::of(vec![&state.name]), state);
        }
    }

    fn state(&mut self, path: &Name, own: &State) {
        self.initial(path, own);
        for transitions in [&own.transitions, &own.default_transitions] {
            self.distinct(transitions);
            for transition in transitions {
                self.transition(transition);
            }
        }
        for child in &own.children {
            self.state(&path.join(&child.name), child);
        }
    }

    fn transition(&mut self, transition: &Transition) {
        if let TransitionKind::To(end) | TransitionKind::Push(end) = &transition.kind {
            self.existing(transition.span, "the `end_state`", end);
        }
        let event = &transition.trigger.event;
        if !self.triggers.know(event) {
            let message = format!(
                "nothing triggers this transition: `{event}` is neither an event nor a message of \
                 the service or a service it inherits from: declare it in the \
                 `internal_events_set`, or correct the name"
            );
            self.report.error(transition.span, message);
        }
        for name in unknown_variables(transition) {
            let message = format!(
                "`{name}` is not a parameter of this transition: add a `parameter`, or write a \
                 text in `'`"
            );
            self.report.error(transition.span, message);
        }
    }

    /// The second of two transitions with the same trigger and guard is never taken.
    fn distinct(&mut self, transitions: &[Transition]) {
        for (position, transition) in transitions.iter().enumerate() {
            let same = |other: &&Transition| {
                other.trigger == transition.trigger && other.guard == transition.guard
            };
            let Some(first) = transitions[..position].iter().find(same) else {
                continue;
            };
            let message = format!(
                "the transition `{}` appears twice with the same parameters and guard, so this \
                 one is never taken: remove it, or change the guard",
                transition.trigger.event
            );
            self.report
                .error(transition.span, message)
                .note(first.span, "the one that is taken");
        }
    }

    /// A composite state names its initial state, the same as its base does.
    fn initial(&mut self, path: &Name, own: &State) {
        let merged = self.machine.find(path);
        let merged = merged.map(|index| self.machine.state(index));
        if let Some(initial) = &own.initial {
            self.named_initial(own, &path.join(initial), merged);
            self.same_as_in_base(path, own, initial);
            return;
        }
        let Some(first) = own.children.first() else {
            return;
        };
        if merged.is_some_and(|merged| merged.wanted_initial.is_some()) {
            return;
        }
        if own.children.len() > 1 {
            let message = format!(
                "the state `{path}` has {} inner states: choose its first one with `initial_state`",
                own.children.len()
            );
            self.report.error(own.span, message);
        } else {
            let message = format!(
                "the state `{path}` has inner states, but no `initial_state`: `{}` is assumed",
                first.name
            );
            self.report.warning(own.span, message);
        }
    }

    /// Published machines name states that exist only in other services; the merged machine then
    /// begins in its first state.
    fn named_initial(&mut self, own: &State, path: &Name, merged: Option<&MachineState<'_>>) {
        if self.machine.find(path).is_some() {
            self.existing(own.span, "the `initial_state`", path);
            return;
        }
        let children = merged.map_or(&[][..], |merged| &merged.children);
        let message = match children.first() {
            None => format!(
                "the `initial_state` `{path}` does not exist, nor any other inner state: remove \
                 the attribute"
            ),
            Some(first) => format!(
                "the `initial_state` `{path}` does not exist: `{}` is assumed",
                self.machine.state(*first).path.last()
            ),
        };
        self.report.warning(own.span, message);
    }

    fn same_as_in_base(&mut self, path: &Name, own: &State, initial: &str) {
        let Some(base) = self.base else { return };
        let inherited = base.find(path).map(|index| base.state(index));
        let Some(wanted) = inherited.and_then(|state| state.wanted_initial) else {
            return;
        };
        if !wanted.eq_ignore_ascii_case(initial) {
            let message = format!(
                "the `initial_state` of `{path}` is `{wanted}` in the inherited service: write \
                 the same"
            );
            self.report.warning(own.span, message);
        }
    }

    /// A derived machine starts in its base's start state, or in a substate of it.
    fn refining(&mut self, own: &StateMachine) {
        let Some(base) = self.base else { return };
        let promised = &base.state(base.start()).path;
        let start = &self.machine.state(self.machine.start()).path;
        let same = |(a, b): (&String, &String)| a.eq_ignore_ascii_case(b);
        let within = start.parts().len() >= promised.parts().len()
            && promised.parts().iter().zip(start.parts()).all(same);
        if !within {
            let message = format!(
                "`{}` starts in `{start}`, but the machine it extends starts in `{promised}`: \
                 start there, or in one of its inner states",
                own.name
            );
            self.report.warning(own.span, message);
        }
    }

    fn existing(&mut self, span: Span, what: &str, path: &Name) {
        let found = self.machine.find(path);
        match found.map(|index| &self.machine.state(index).path) {
            None => {
                let name = self.machine.name();
                let message = format!(
                    "{what} `{path}` is not a state of `{name}`: add the state, or name one by \
                     its full path"
                );
                self.report.error(span, message);
            }
            Some(spelled) if spelled != path => {
                let message = format!("{what} `{path}` is spelled `{spelled}` elsewhere");
                self.report.warning(span, message);
            }
            Some(_) => {}
        }
    }
}

/// Arguments of guards and actions that are no parameters of the trigger.
fn unknown_variables(transition: &Transition) -> Vec<&Name> {
    let mut arguments = Vec::new();
    if let Some(guard) = &transition.guard {
        given(guard, &mut arguments);
    }
    arguments.extend(transition.actions.iter().flat_map(|a| &a.arguments));
    let parameters = &transition.trigger.parameters;
    let unknown = arguments.into_iter().filter_map(|argument| match argument {
        Argument::Variable(name) => Some(name),
        Argument::Text(_) | Argument::Integer(_) => None,
    });
    let mut unknown: Vec<_> = unknown
        .filter(|name| parameters.iter().all(|p| p.name != name.parts()[0]))
        .collect();
    unknown.sort();
    unknown.dedup();
    unknown
}

/// The arguments of all calls in a guard.
fn given<'g>(guard: &'g Guard, arguments: &mut Vec<&'g Argument>) {
    match guard {
        Guard::Call(call) => arguments.extend(&call.arguments),
        Guard::Not(inner) => given(inner, arguments),
        Guard::And(left, right) | Guard::Or(left, right) | Guard::Compare(_, left, right) => {
            given(left, arguments);
            given(right, arguments);
        }
        Guard::Name(_) | Guard::Literal(_) => {}
    }
}
