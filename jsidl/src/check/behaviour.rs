//! Rules for state machines: references resolve, with the same spelling, and an extended machine
//! keeps the guarantees of its base.
//!
//! A violation that no published definition has is an error. Where published definitions are
//! careless and the merged machine is still defined (letter case is ignored, a composite state
//! begins in its first state), it is a warning.

use super::triggers::{Events, Triggers};
use crate::behaviour::{
    Action, ActionKind, Argument, Call, Guard, Name, Parameter, State, StateMachine, Transition,
    TransitionKind,
};
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
        self.transitions(&own.default_transitions);
    }

    fn state(&mut self, path: &Name, own: &State) {
        self.initial(path, own);
        self.transitions(&own.transitions);
        self.transitions(&own.default_transitions);
        self.sent(own.span, own.entry.iter().chain(&own.exit));
        for child in &own.children {
            self.state(&path.join(&child.name), child);
        }
    }

    fn transitions(&mut self, transitions: &[Transition]) {
        self.distinct(transitions);
        for transition in transitions {
            self.target(transition);
            self.trigger(transition);
            self.variables(transition);
            self.sent(transition.span, transition.actions.iter());
        }
    }

    fn target(&mut self, transition: &Transition) {
        let span = transition.span;
        match &transition.kind {
            TransitionKind::To(end) => self.existing(span, "the `end_state`", end),
            TransitionKind::Push(push) => {
                self.existing(span, "the `end_state`", &push.to);
                if let Some(back) = &push.back {
                    self.existing(span, "the `end_state` of `simple`", back);
                }
                self.returning(span, &push.to);
            }
            TransitionKind::Pop(Some(then)) => self.followed(transition, then),
            TransitionKind::Internal | TransitionKind::Again | TransitionKind::Pop(None) => {}
        }
    }

    /// A state that is entered by a `push` has a way back.
    fn returning(&mut self, span: Span, path: &Name) {
        let Some(pushed) = self.machine.find(path) else {
            return;
        };
        if !self.machine.returns(pushed) {
            let message = format!(
                "nothing returns from `{path}` after this `push`: add a transition with a `pop` to \
                 that state, or make this one `simple`"
            );
            self.report.warning(span, message);
        }
    }

    /// The event that follows a `pop` needs nothing but numbers.
    fn followed(&mut self, transition: &Transition, then: &Call) {
        let name = then.name.last();
        let named = |other: &&Transition| {
            let event = other.trigger.name();
            event.is_some_and(|event| event.eq_ignore_ascii_case(name))
        };
        let mut all = self.machine.transitions().map(|declared| declared.item);
        let given = then.arguments.len();
        let is_number = |argument: &Argument| match argument {
            Argument::Integer(_) => true,
            Argument::Text(_) => false,
            Argument::Variable(name) => {
                let parameters = transition.trigger.parameters.iter();
                let mut known = parameters.filter(|it| it.name == name.to_string());
                known.any(Parameter::is_number)
            }
        };
        let found = all.find(named);
        let takes_numbers =
            |it: &Transition| it.trigger.parameters.iter().all(Parameter::is_number);
        if found.is_some_and(|other| !takes_numbers(other)) {
            let message = format!(
                "the `pop` only returns: `{name}`, which should follow, takes a message, and only \
                 an event without one can follow; add the actions to this transition"
            );
            self.report.warning(transition.span, message);
            return;
        }
        let message = match found {
            None => format!(
                "the `pop` is followed by `{name}`, but no state of the machine has that \
                 transition: add one, or remove the attribute `transition`"
            ),
            Some(other) if other.trigger.parameters.len() != given => format!(
                "`{name}` has {} parameters, but the `pop` has {given} `argument`s: give it one for \
                 each",
                other.trigger.parameters.len()
            ),
            Some(_) if !then.arguments.iter().all(is_number) => format!(
                "the `argument`s of the `pop` are numbers for `{name}`: write integers, or \
                 parameters of this transition with the type of a number"
            ),
            Some(_) => return,
        };
        self.report.error(transition.span, message);
    }

    fn trigger(&mut self, transition: &Transition) {
        let trigger = &transition.trigger;
        if let Some(event) = trigger.event.as_ref().filter(|it| !self.triggers.know(it)) {
            let message = format!(
                "nothing triggers this transition: `{event}` is neither an event nor a message of \
                 the service or a service it inherits from: declare it in the \
                 `internal_events_set`, or correct the name"
            );
            self.report.error(transition.span, message);
        }
        for parameter in &trigger.parameters {
            let kind = &parameter.kind;
            if !parameter.is_number() && !self.triggers.have(kind) {
                let message = format!(
                    "`{kind}` cannot be the type of a parameter: name a message, a record of an \
                     event such as `Receive.Body.ReceiveRec`, or an unsigned number"
                );
                self.report.error(transition.span, message);
            }
        }
    }

    /// Guards and actions use the parameters of their own transition only.
    fn variables(&mut self, transition: &Transition) {
        for name in unknown_variables(transition) {
            let message = if transition.trigger.event.is_some() {
                format!(
                    "`{name}` is not a parameter of this transition: add a `parameter`, or write a \
                     text in `'`"
                )
            } else {
                format!(
                    "`{name}` is not a text in `'`, and a `default_transition` has no parameters: \
                     write a `transition`, or a text"
                )
            };
            self.report.error(transition.span, message);
        }
        let compared = transition.guard.iter().flat_map(bare_names);
        let compared: Vec<_> = compared.map(ToString::to_string).collect();
        for name in compared {
            let message = format!(
                "`{name}` is not a condition: write a call such as `{name}()`, or compare it with \
                 something"
            );
            self.report.error(transition.span, message);
        }
    }

    /// A `send_action` names an event or a message.
    fn sent<'x>(&mut self, span: Span, actions: impl Iterator<Item = &'x Action>) {
        let sends = actions.filter(|action| action.kind == ActionKind::Send);
        for action in sends.filter(|action| !self.triggers.know(&action.name)) {
            let message = format!(
                "the `send_action` sends `{}`, which is neither an event nor a message of the \
                 service or a service it inherits from: correct the name, or use an `action`",
                action.name
            );
            self.report.error(span, message);
        }
    }

    /// The second of two transitions with the same trigger and guard is never taken. A
    /// `default_transition` of a state legally precedes that of its `default_state`.
    fn distinct(&mut self, transitions: &[Transition]) {
        for (position, transition) in transitions.iter().enumerate() {
            let Some(event) = &transition.trigger.event else {
                continue;
            };
            let same = |other: &&Transition| {
                other.trigger == transition.trigger && other.guard == transition.guard
            };
            let Some(first) = transitions[..position].iter().find(same) else {
                continue;
            };
            let message = format!(
                "the transition `{event}` appears twice with the same parameters and guard, so \
                 this one is never taken: remove it, or change the guard"
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

/// Names in guards, actions and a `pop` that are no parameters of the trigger.
fn unknown_variables(transition: &Transition) -> Vec<Name> {
    let mut names = Vec::new();
    if let Some(guard) = &transition.guard {
        guard_variables(guard, &mut names);
    }
    let mut arguments: Vec<_> = transition
        .actions
        .iter()
        .flat_map(|a| &a.arguments)
        .collect();
    if let TransitionKind::Pop(Some(then)) = &transition.kind {
        arguments.extend(&then.arguments);
    }
    names.extend(arguments.into_iter().filter_map(variable));
    let parameters = &transition.trigger.parameters;
    let unknown = |name: &&Name| parameters.iter().all(|p| p.name != name.parts()[0]);
    let mut unknown: Vec<_> = names.into_iter().filter(unknown).cloned().collect();
    unknown.sort();
    unknown.dedup();
    unknown
}

fn variable(argument: &Argument) -> Option<&Name> {
    match argument {
        Argument::Variable(name) => Some(name),
        Argument::Text(_) | Argument::Integer(_) => None,
    }
}

/// The arguments of all calls in a guard, and the names that it compares.
fn guard_variables<'g>(guard: &'g Guard, names: &mut Vec<&'g Name>) {
    match guard {
        Guard::Call(call) => names.extend(call.arguments.iter().filter_map(variable)),
        Guard::Not(inner) => guard_variables(inner, names),
        Guard::And(left, right) | Guard::Or(left, right) => {
            guard_variables(left, names);
            guard_variables(right, names);
        }
        Guard::Compare(_, left, right) => {
            for side in [left, right] {
                match side.as_ref() {
                    Guard::Name(name) if is_truth(name) => {}
                    Guard::Name(name) => names.push(name),
                    other => guard_variables(other, names),
                }
            }
        }
        Guard::Name(_) | Guard::Literal(_) => {}
    }
}

/// Whether a name in a comparison is a constant.
fn is_truth(name: &Name) -> bool {
    matches!(name.parts(), [one] if one == "true" || one == "false")
}

/// Names and literals that stand alone, where a guard needs a condition.
fn bare_names(guard: &Guard) -> Vec<&Guard> {
    match guard {
        Guard::Name(_) | Guard::Literal(_) => vec![guard],
        Guard::Not(inner) => bare_names(inner),
        Guard::And(left, right) | Guard::Or(left, right) => {
            let mut both = bare_names(left);
            both.extend(bare_names(right));
            both
        }
        Guard::Call(_) | Guard::Compare(..) => Vec::new(),
    }
}
