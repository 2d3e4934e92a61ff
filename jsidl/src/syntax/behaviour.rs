//! Reads `protocol_behavior`: state machines with their states, transitions and actions.
//!
//! A mistake in a machine drops that machine but not the service: its messages do not depend on it.

use roxmltree::Node as Xml;

use super::element::{Children, FLAGS, Reader};
use crate::behaviour::{
    Action, ActionKind, Argument, Call, Guard, Name, Parameter, Push, State, StateMachine,
    Transition, TransitionKind, Trigger,
};
use crate::source::{Span, Spanned};
use crate::spelling::shortened;

/// Maximum number of states of a service; published ones have up to 17.
const MOST_STATES: usize = 500;

/// `start`
struct Start {
    span: Span,
    machine: Name,
    state: Name,
}

impl Reader<'_> {
    /// The machines without errors.
    pub(super) fn behaviour(&mut self, xml: Xml<'_, '_>) -> Vec<StateMachine> {
        let states = xml.descendants().filter(|x| x.tag_name().name() == "state");
        if states.count() > MOST_STATES {
            let at = self.span(xml);
            let message = format!("there are more than {MOST_STATES} states: split the service");
            self.report.error(at, message);
            return Vec::new();
        }
        let children = self.enter(xml);
        let stateless = self.attribute(xml, "is_stateless");
        let stateless = stateless.filter(|text| {
            let word = self.word(text, "is_stateless", &FLAGS);
            word == Some(true)
        });
        let mut starts = Vec::new();
        for start in children.named("start") {
            self.add_start(&mut starts, start);
        }
        let definitions: Vec<_> = children.named("state_machine").collect();
        self.starts_of_nothing(&starts, &definitions);
        let names = definitions.iter().map(|&xml| {
            let name = xml.attribute("name").unwrap_or_default();
            (name, self.source.span(xml.range().start))
        });
        self.report.unique("state machines", names);
        let machines = definitions.into_iter();
        let machines: Vec<_> = machines
            .filter_map(|child| self.state_machine(child, &starts))
            .collect();
        if let Some(flag) = &stateless {
            self.stateless(flag, &machines);
        }
        // The standard demands a machine even of a service without behaviour.
        if stateless.is_some() && machines.iter().all(StateMachine::is_silent) {
            return Vec::new();
        }
        machines
    }

    /// A service declared stateless has machines of one state each.
    fn stateless(&mut self, flag: &Spanned<String>, machines: &[StateMachine]) {
        for machine in machines {
            let states = machine.all_states().count();
            if states > 1 {
                let message = format!(
                    "`is_stateless` is `{}`, but the machine `{}` has {states} states: set it to \
                     `false`",
                    flag.value, machine.name
                );
                self.report
                    .warning(flag.span, message)
                    .note(machine.span, "the machine with states");
            }
        }
    }

    /// Adds the start state of a machine; once per machine.
    fn add_start(&mut self, starts: &mut Vec<Start>, xml: Xml<'_, '_>) {
        self.enter(xml);
        let machine = self.dotted(xml, "state_machine_name");
        let state = self.dotted(xml, "state_name");
        let (Some(machine), Some(state)) = (machine, state) else {
            return;
        };
        let span = self.span(xml);
        if let Some(first) = starts.iter().find(|start| start.machine == machine.value) {
            let message = format!("`{}` has two `start` elements: keep one", machine.value);
            self.report
                .error(span, message)
                .note(first.span, "the other one");
            return;
        }
        starts.push(Start {
            span,
            machine: machine.value,
            state: state.value,
        });
    }

    fn starts_of_nothing(&mut self, starts: &[Start], definitions: &[Xml<'_, '_>]) {
        for start in starts {
            let name = start.machine.to_string();
            let named = |xml: &Xml<'_, '_>| xml.attribute("name").is_some_and(|n| n.trim() == name);
            if !definitions.iter().any(named) {
                let message = format!(
                    "there is no `state_machine` named `{name}` to start: add it, or correct \
                     `state_machine_name`"
                );
                self.report.error(start.span, message);
            }
        }
    }

    fn state_machine(&mut self, xml: Xml<'_, '_>, starts: &[Start]) -> Option<StateMachine> {
        let before = self.report.errors();
        let children = self.enter(xml);
        let name = self.dotted(xml, "name");
        let states = self.states(&children);
        let default = children.find("default_state");
        let default = default.map_or_else(Vec::new, |xml| self.default_state(xml));
        let name = name?.value;
        let start = starts.iter().find(|start| start.machine == name);
        let span = self.span(xml);
        if states.is_empty() && self.report.errors() == before {
            let message = format!("the machine `{name}` has no states: add one, or remove it");
            self.report.error(span, message);
        }
        if start.is_none() {
            let message =
                format!("`{name}` has no `start`: add one with this `state_machine_name`");
            self.report.error(span, message);
        }
        let start = start.filter(|_| self.report.errors() == before)?;
        Some(StateMachine {
            name,
            start: start.state.clone(),
            states,
            default_transitions: default,
            location: self.location(xml),
            span,
        })
    }

    /// The named states of a machine or an enclosing state.
    fn states(&mut self, children: &Children<'_, '_>) -> Vec<State> {
        let mut states: Vec<State> = Vec::new();
        for xml in children.named("state") {
            let Some(state) = self.state(xml) else {
                continue;
            };
            if let Some(first) = states
                .iter()
                .find(|s| s.name.eq_ignore_ascii_case(&state.name))
            {
                let message = format!("there are two states `{}`: rename one", state.name);
                self.report
                    .error(state.span, message)
                    .note(first.span, "the other one");
            }
            states.push(state);
        }
        states
    }

    fn state(&mut self, xml: Xml<'_, '_>) -> Option<State> {
        let children = self.enter(xml);
        let name = self.name(xml);
        let initial = self.initial_state(xml);
        let [entry, exit] = ["entry", "exit"].map(|effect| {
            let effect = children.find(effect);
            effect.map_or_else(Vec::new, |xml| self.effects(xml))
        });
        let transitions = children.named("transition");
        let transitions = transitions.filter_map(|it| self.transition(it)).collect();
        let default = children.find("default_state");
        let default = default.map_or_else(Vec::new, |xml| self.default_state(xml));
        let otherwise = children.named("default_transition");
        let otherwise: Vec<_> = otherwise
            .filter_map(|it| self.default_transition(it))
            .collect();
        let state = State {
            name: name.unwrap_or_default(),
            initial,
            entry,
            exit,
            transitions,
            default_transitions: in_trial_order(otherwise, default),
            children: self.states(&children),
            location: self.location(xml),
            span: self.span(xml),
        };
        (!state.name.is_empty()).then_some(state)
    }

    fn initial_state(&mut self, xml: Xml<'_, '_>) -> Option<String> {
        let initial = self.attribute(xml, "initial_state")?;
        if initial.value.is_empty() {
            let message = "the attribute `initial_state` is empty: name the first inner state, or \
                remove it";
            self.report.error(initial.span, message);
            return None;
        }
        self.identifier(initial)
    }

    fn default_state(&mut self, xml: Xml<'_, '_>) -> Vec<Transition> {
        let children = self.enter(xml);
        let transitions = children.named("transition");
        let mut transitions: Vec<_> = transitions.filter_map(|it| self.transition(it)).collect();
        let otherwise = children.named("default_transition");
        transitions.extend(otherwise.filter_map(|it| self.default_transition(it)));
        transitions
    }

    /// The actions of an `entry` or `exit`.
    fn effects(&mut self, xml: Xml<'_, '_>) -> Vec<Action> {
        let children = self.enter(xml);
        self.actions(&children)
    }

    fn transition(&mut self, xml: Xml<'_, '_>) -> Option<Transition> {
        let children = self.enter(xml);
        let event = self.dotted(xml, "name");
        let parameters = children.named("parameter");
        let parameters = parameters.filter_map(|child| {
            let at = self.span(child);
            self.parameter(child).map(|parameter| (at, parameter))
        });
        let parameters: Vec<_> = parameters.collect();
        let named = parameters.iter().map(|(at, p)| (p.name.as_str(), *at));
        self.report.unique("parameters", named);
        let parameters = parameters.into_iter().map(|(_, parameter)| parameter);
        let trigger = event.map(|event| Trigger {
            event: Some(event.value),
            parameters: parameters.collect(),
        });
        self.reaction(xml, &children, trigger)
    }

    /// As a transition, but every event triggers it.
    fn default_transition(&mut self, xml: Xml<'_, '_>) -> Option<Transition> {
        let children = self.enter(xml);
        let trigger = Trigger {
            event: None,
            parameters: Vec::new(),
        };
        self.reaction(xml, &children, Some(trigger))
    }

    /// The parts of a transition besides its trigger.
    fn reaction(
        &mut self,
        xml: Xml<'_, '_>,
        children: &Children<'_, '_>,
        trigger: Option<Trigger>,
    ) -> Option<Transition> {
        let before = self.report.errors();
        let guard = children.find("guard");
        let guard = guard.and_then(|guard| self.guard(guard));
        let targets = ["internal", "simple", "push", "pop"];
        let target = targets.into_iter().find_map(|name| children.find(name));
        let kind = target.and_then(|target| self.kind(target));
        let guard_is_sound = self.report.errors() == before;
        let actions = self.actions(children);
        Some(Transition {
            trigger: trigger?,
            guard,
            kind: kind.filter(|_| guard_is_sound)?,
            actions,
            location: self.location(xml),
            span: self.span(xml),
        })
    }

    fn kind(&mut self, xml: Xml<'_, '_>) -> Option<TransitionKind> {
        match xml.tag_name().name() {
            "simple" => Some(match self.simple(xml) {
                Some(end) => TransitionKind::To(end?),
                None => TransitionKind::Again,
            }),
            "push" => self.push(xml),
            "pop" => self.pop(xml),
            _ => {
                self.enter(xml);
                Some(TransitionKind::Internal)
            }
        }
    }

    /// The `end_state` of a `simple`: `None` without one, `Some(None)` if it is unreadable.
    fn simple(&mut self, xml: Xml<'_, '_>) -> Option<Option<Name>> {
        let end = self.enter(xml).find("end_state")?;
        Some(self.end_state(end))
    }

    fn end_state(&mut self, xml: Xml<'_, '_>) -> Option<Name> {
        self.enter(xml);
        Some(self.dotted(xml, "state")?.value)
    }

    fn push(&mut self, xml: Xml<'_, '_>) -> Option<TransitionKind> {
        let children = self.enter(xml);
        let to = children.find("end_state");
        let to = to.and_then(|end| self.end_state(end));
        let back = match children.find("simple").map(|it| self.simple(it)) {
            Some(Some(back)) => Some(back?),
            Some(None) | None => None,
        };
        Some(TransitionKind::Push(Push { to: to?, back }))
    }

    fn pop(&mut self, xml: Xml<'_, '_>) -> Option<TransitionKind> {
        let children = self.enter(xml);
        let arguments = self.arguments(&children);
        let Some(name) = self.attribute(xml, "transition") else {
            if let Some(argument) = children.find("argument") {
                let at = self.span(argument);
                let message = "an `argument` of a `pop` belongs to the event that its attribute \
                    `transition` names: add that, or remove the argument";
                self.report.error(at, message);
            }
            return Some(TransitionKind::Pop(None));
        };
        let name = self.identifier(name)?;
        Some(TransitionKind::Pop(Some(Call {
            name: Name::of(vec![&name]),
            arguments,
        })))
    }

    fn parameter(&mut self, xml: Xml<'_, '_>) -> Option<Parameter> {
        self.enter(xml);
        let kind = self.required(xml, "type");
        let name = self.required(xml, "value");
        Some(Parameter {
            kind: kind?.value,
            name: name.and_then(|name| self.identifier(name))?,
        })
    }

    fn guard(&mut self, xml: Xml<'_, '_>) -> Option<Guard> {
        self.enter(xml);
        let text = self.required(xml, "condition")?;
        let read = Guard::parse(&text.value);
        self.understood(
            read,
            &text,
            "`condition` must be made of calls, `!`, `&&` and `||`",
        )
    }

    /// The actions among the children of a transition, an `entry` or an `exit`.
    fn actions(&mut self, children: &Children<'_, '_>) -> Vec<Action> {
        let mut actions = Vec::new();
        for child in children.all() {
            actions.extend(match child.tag_name().name() {
                "action" => self.action(child, ActionKind::Call),
                "send_action" => self.action(child, ActionKind::Send),
                _ => None,
            });
        }
        actions
    }

    fn action(&mut self, xml: Xml<'_, '_>, kind: ActionKind) -> Option<Action> {
        let children = self.enter(xml);
        let name = self.dotted(xml, "name");
        let arguments = self.arguments(&children);
        Some(Action {
            kind,
            name: name?.value,
            arguments,
        })
    }

    fn arguments(&mut self, children: &Children<'_, '_>) -> Vec<Argument> {
        let arguments = children.named("argument");
        arguments.filter_map(|it| self.argument(it)).collect()
    }

    fn argument(&mut self, xml: Xml<'_, '_>) -> Option<Argument> {
        self.enter(xml);
        let mut text = self.required(xml, "value")?;
        let quotes = text.value.strip_prefix('‘');
        let curly = quotes.and_then(|rest| rest.strip_suffix('’'));
        if let Some(quoted) = curly.map(|inner| format!("'{inner}'")) {
            let message = format!("`{}` has curly quotes: write `{quoted}`", text.value);
            self.report.warning(text.span, message);
            text.value = quoted;
        }
        let read = Argument::parse(&text.value);
        self.understood(
            read,
            &text,
            "`value` must be a parameter's name or a text in `'`",
        )
    }

    fn understood<T>(
        &mut self,
        read: Result<T, String>,
        text: &Spanned<String>,
        rule: &str,
    ) -> Option<T> {
        read.map_err(|reason| {
            self.report.error(text.span, format!("{rule}: {reason}"));
        })
        .ok()
    }

    /// A required attribute that holds identifiers joined by dots.
    fn dotted(&mut self, xml: Xml<'_, '_>, attribute: &str) -> Option<Spanned<Name>> {
        let text = self.required(xml, attribute)?;
        let name = Name::parse(&text.value);
        if name.is_none() {
            let message = format!(
                "`{}` cannot be a `{attribute}`: use names made of letters, digits and \
                 underscores, joined by dots",
                shortened(&text.value)
            );
            self.report.error(text.span, message);
        }
        Some(Spanned {
            value: name?,
            span: text.span,
        })
    }
}

/// The default transitions of a state: those with a trigger before those without, as the public
/// tool set tries them.
fn in_trial_order(own: Vec<Transition>, default_state: Vec<Transition>) -> Vec<Transition> {
    let split = |it: &Transition| it.trigger.event.is_some();
    let (mut all, otherwise): (Vec<_>, Vec<_>) = default_state.into_iter().partition(split);
    all.extend(own);
    all.extend(otherwise);
    all
}
