//! Rules for state machines: the states that they speak of should exist, in the same spelling.
//!
//! All of them are warnings. The merged machine has an answer for each: a composite state begins in
//! its first state, the case of letters is passed over, and a transition to nowhere leads nowhere.

use crate::behaviour::{Machine, Name, State, StateMachine, TransitionKind};
use crate::diagnostic::Report;
use crate::library::Library;
use crate::model::Service;
use crate::source::Span;

/// Looks at what a service itself says about its machines, beside what it inherits.
/// `states_left` bounds the work for all services together.
pub(crate) fn behaviour(
    report: &mut Report,
    library: &Library,
    service: &Service,
    states_left: &mut usize,
) {
    let Some(first) = service.behaviour.first() else {
        return;
    };
    let lineage = library.lineage(service).flat_map(|base| &base.behaviour);
    let states: usize = lineage.map(|machine| machine.all_states().count()).sum();
    let Some(left) = states_left.checked_sub(states) else {
        let message = "the services inherit too many states from each other: the state machines \
                       from here on are not checked";
        if *states_left > 0 {
            report.warning(first.span, message);
        }
        *states_left = 0;
        return;
    };
    *states_left = left;
    let machines = library.machines(service);
    for own in &service.behaviour {
        let same = |machine: &&Machine<'_>| machine.name() == &own.name;
        if let Some(machine) = machines.iter().find(same) {
            Check { report, machine }.machine(own);
        }
    }
}

struct Check<'a> {
    report: &'a mut Report,
    machine: &'a Machine<'a>,
}

impl Check<'_> {
    fn machine(&mut self, own: &StateMachine) {
        self.existing(own.span, "the start", &own.start);
        for state in &own.states {
            self.state(&Name::of(vec![&state.name]), state);
        }
    }

    fn state(&mut self, path: &Name, own: &State) {
        self.initial(path, own);
        for transition in own.transitions.iter().chain(&own.default_transitions) {
            if let TransitionKind::To(end) | TransitionKind::Push(end) = &transition.kind {
                self.existing(transition.span, "the `end_state`", end);
            }
        }
        for child in &own.children {
            self.state(&path.join(&child.name), child);
        }
    }

    /// A state with others inside says in which of them it begins.
    fn initial(&mut self, path: &Name, own: &State) {
        if let Some(initial) = &own.initial {
            self.existing(own.span, "the `initial_state`", &path.join(initial));
            return;
        }
        let merged = self
            .machine
            .find(path)
            .map(|index| self.machine.state(index));
        if let Some(merged) = merged
            && merged.wanted_initial.is_none()
            && let Some(first) = own.children.first()
        {
            let message = format!(
                "the state `{path}` has others inside, but no `initial_state`: it is taken to \
                 begin in `{}`",
                first.name
            );
            self.report.warning(own.span, message);
        }
    }

    fn existing(&mut self, span: Span, what: &str, path: &Name) {
        let found = self.machine.find(path);
        match found.map(|index| &self.machine.state(index).path) {
            None => {
                let name = self.machine.name();
                let message = format!("{what} `{path}` is not a state of `{name}`: correct it");
                self.report.warning(span, message);
            }
            Some(spelled) if spelled != path => {
                let message = format!("{what} `{path}` is spelled `{spelled}` elsewhere");
                self.report.warning(span, message);
            }
            Some(_) => {}
        }
    }
}
