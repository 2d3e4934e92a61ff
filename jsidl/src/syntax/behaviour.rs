//! Reads `protocol_behavior`: state machines with their states, transitions and actions.
//!
//! A mistake in a machine drops that machine but not the service: its messages do not depend on it.

use roxmltree::Node as Xml;

use super::element::{FLAGS, Faulty, Reader, shortened};
use crate::behaviour::{
    Action, Argument, Guard, Name, Parameter, State, StateMachine, Transition, TransitionKind,
    Trigger,
};
use crate::source::{Span, Spanned};

/// Maximum number of states of a service; published ones have up to 17.
const MOST_STATES: usize = 500;

/// `start`
struct Start {
    span: Span,
    machine: Name,
    state: Name,
}

/// Parts of a `transition` or `default_transition`.
struct TransitionParts {
    parameters: Vec<(Span, Parameter)>,
    guard: Result<Option<Guard>, Faulty>,
    /// `None` if it is missing or invalid.
    kind: Option<TransitionKind>,
    actions: Vec<Action>,
}

impl Reader<'_> {
    /// The machines without errors.
    pub(super) fn behaviour(&mut self, xml: Xml<'_, '_>) -> Vec<StateMachine> {
        self.only(xml, &["is_stateless"]);
        let stateless = self.attribute(xml, "is_stateless");
        let stateless = stateless.filter(|text| {
            let word = self.word(text, "is_stateless", &FLAGS);
            word == Some(true)
        });
        let states = xml.descendants().filter(|x| x.tag_name().name() == "state");
        if states.count() > MOST_STATES {
            let at = self.span(xml);
            let message = format!("there are more than {MOST_STATES} states: split the service");
            self.report.error(at, message);
            return Vec::new();
        }
        let (mut starts, mut definitions) = (Vec::new(), Vec::new());
        for child in self.children(xml) {
            match child.tag_name().name() {
                "start" => self.add_start(&mut starts, child),
                "state_machine" => definitions.push(child),
                _ => self.misplaced(
                    child,
                    "protocol_behavior",
                    "a `start` and a `state_machine` for each machine",
                ),
            }
        }
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
        if let Some(flag) = stateless {
            self.stateless(&flag, &machines);
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
        self.only(xml, &["state_machine_name", "state_name", "interpretation"]);
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
        self.only(xml, &["name", "interpretation"]);
        let before = self.report.errors();
        let name = self.dotted(xml, "name");
        let mut states = Vec::new();
        for child in self.children(xml) {
            match child.tag_name().name() {
                "state" => self.add_state(&mut states, child),
                // The position of the start arrow in a diagram editor.
                "pseudo_start_state" => {}
                _ => self.misplaced(child, "state_machine", "`state`s"),
            }
        }
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
            location: self.location(xml),
            span,
        })
    }

    /// Adds a named state to its siblings.
    fn add_state(&mut self, states: &mut Vec<State>, xml: Xml<'_, '_>) {
        let Some(state) = self.state(xml) else {
            return;
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

    fn state(&mut self, xml: Xml<'_, '_>) -> Option<State> {
        self.only(xml, &["name", "initial_state", "interpretation"]);
        let name = self.name(xml);
        let initial = self.initial_state(xml);
        let mut state = State {
            name: name.unwrap_or_default(),
            initial,
            entry: Vec::new(),
            exit: Vec::new(),
            transitions: Vec::new(),
            default_transitions: Vec::new(),
            children: Vec::new(),
            location: self.location(xml),
            span: self.span(xml),
        };
        let mut once = [None, None, None];
        for child in self.children(xml) {
            match child.tag_name().name() {
                "state" => self.add_state(&mut state.children, child),
                "transition" => state.transitions.extend(self.transition(child)),
                "entry" => self.once(&mut once[0], child, xml),
                "exit" => self.once(&mut once[1], child, xml),
                "default_state" => self.once(&mut once[2], child, xml),
                "default_transition" => self.default_transition(child),
                _ => self.misplaced(
                    child,
                    "state",
                    "`entry`, `exit`, `transition`s, `state`s and a `default_state`",
                ),
            }
        }
        let [entry, exit, default] = once;
        state.entry = entry.map_or_else(Vec::new, |xml| self.effects(xml));
        state.exit = exit.map_or_else(Vec::new, |xml| self.effects(xml));
        state.default_transitions = default.map_or_else(Vec::new, |xml| self.default_state(xml));
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
        self.only(xml, &["interpretation"]);
        let mut transitions = Vec::new();
        for child in self.children(xml) {
            match child.tag_name().name() {
                "transition" => transitions.extend(self.transition(child)),
                "default_transition" => self.default_transition(child),
                _ => self.misplaced(child, "default_state", "`transition`s"),
            }
        }
        transitions
    }

    /// The actions of an `entry` or `exit`.
    fn effects(&mut self, xml: Xml<'_, '_>) -> Vec<Action> {
        self.only(xml, &["interpretation"]);
        let parent = xml.tag_name().name().to_owned();
        let mut actions = Vec::new();
        for child in self.children(xml) {
            match child.tag_name().name() {
                "action" => actions.extend(self.action(child)),
                "send_action" => self.send_action(child),
                _ => self.misplaced(child, &parent, "`action`s"),
            }
        }
        actions
    }

    fn transition(&mut self, xml: Xml<'_, '_>) -> Option<Transition> {
        self.only(xml, &["name", "interpretation"]);
        let event = self.dotted(xml, "name");
        let parts = self.transition_parts(xml, "transition");
        let parameters = parts.parameters.into_iter();
        Some(Transition {
            trigger: Trigger {
                event: event?.value,
                parameters: parameters.map(|(_, parameter)| parameter).collect(),
            },
            guard: parts.guard.ok()?,
            kind: parts.kind?,
            actions: parts.actions,
            location: self.location(xml),
            span: self.span(xml),
        })
    }

    fn transition_parts(&mut self, xml: Xml<'_, '_>, parent: &str) -> TransitionParts {
        let (mut parameters, mut actions) = (Vec::new(), Vec::new());
        let (mut guard, mut kind) = (None, None);
        for child in self.children(xml) {
            match child.tag_name().name() {
                "parameter" => {
                    let at = self.span(child);
                    parameters.extend(self.parameter(child).map(|parameter| (at, parameter)));
                }
                "guard" => self.once(&mut guard, child, xml),
                "internal" | "simple" | "push" | "pop" if kind.is_some() => {
                    let at = self.span(child);
                    let message = "a transition has one target: keep one of `internal`, `simple`, \
                        `push` and `pop`";
                    self.report.error(at, message);
                }
                "internal" | "simple" | "push" | "pop" => kind = Some(child),
                "action" => actions.extend(self.action(child)),
                "send_action" => self.send_action(child),
                _ => self.misplaced(
                    child,
                    parent,
                    "`parameter`s, a `guard`, one of `internal`, `simple`, `push` and `pop`, and \
                     `action`s",
                ),
            }
        }
        let named = parameters.iter().map(|(at, p)| (p.name.as_str(), *at));
        self.report.unique("parameters", named);
        let guard = match guard {
            Some(guard) => self.guard(guard).map(Some).ok_or(Faulty),
            None => Ok(None),
        };
        let kind = match kind {
            Some(kind) => self.kind(kind),
            None => {
                self.lacks(xml, "internal");
                None
            }
        };
        TransitionParts {
            parameters,
            guard,
            kind,
            actions,
        }
    }

    fn kind(&mut self, xml: Xml<'_, '_>) -> Option<TransitionKind> {
        let element = xml.tag_name().name().to_owned();
        if element == "pop" {
            return Some(self.pop(xml));
        }
        self.only(xml, &["interpretation"]);
        let leads = matches!(element.as_str(), "simple" | "push");
        let mut end = None;
        for child in self.children(xml) {
            match child.tag_name().name() {
                "end_state" if leads => self.once(&mut end, child, xml),
                _ if leads => self.misplaced(child, &element, "an `end_state`"),
                _ => self.misplaced(child, &element, "nothing"),
            }
        }
        let end = match end {
            Some(end) => {
                self.only(end, &["state", "interpretation"]);
                Some(self.dotted(end, "state")?.value)
            }
            None => None,
        };
        Some(match (element.as_str(), end) {
            ("simple", Some(end)) => TransitionKind::To(end),
            ("simple", None) => TransitionKind::Again,
            ("push", Some(end)) => TransitionKind::Push(end),
            ("push", None) => {
                self.lacks(xml, "end_state");
                return None;
            }
            _ => TransitionKind::Internal,
        })
    }

    /// The standard permits a subsequent transition with arguments in a `pop`; published
    /// definitions have none.
    fn pop(&mut self, xml: Xml<'_, '_>) -> TransitionKind {
        self.only(xml, &["transition", "interpretation"]);
        if let Some(transition) = self.attribute(xml, "transition") {
            let message = "ignored: the `transition` of a `pop` is not supported";
            self.report.warning(transition.span, message);
        }
        for child in self.children(xml) {
            if child.tag_name().name() != "argument" {
                self.misplaced(child, "pop", "`argument`s");
            }
        }
        TransitionKind::Pop
    }

    fn parameter(&mut self, xml: Xml<'_, '_>) -> Option<Parameter> {
        self.only(xml, &["type", "value", "interpretation"]);
        let kind = self.required(xml, "type");
        let name = self.required(xml, "value");
        Some(Parameter {
            kind: kind?.value,
            name: name.and_then(|name| self.identifier(name))?,
        })
    }

    fn guard(&mut self, xml: Xml<'_, '_>) -> Option<Guard> {
        self.only(xml, &["condition", "interpretation"]);
        let text = self.required(xml, "condition")?;
        let read = Guard::parse(&text.value);
        self.understood(
            read,
            &text,
            "`condition` must be made of calls, `!`, `&&` and `||`",
        )
    }

    fn action(&mut self, xml: Xml<'_, '_>) -> Option<Action> {
        self.only(xml, &["name", "interpretation"]);
        let name = self.dotted(xml, "name");
        let mut arguments = Vec::new();
        for child in self.children(xml) {
            match child.tag_name().name() {
                "argument" => arguments.extend(self.argument(child)),
                _ => self.misplaced(child, "action", "`argument`s"),
            }
        }
        Some(Action {
            name: name?.value,
            arguments,
        })
    }

    fn argument(&mut self, xml: Xml<'_, '_>) -> Option<Argument> {
        self.only(xml, &["value", "interpretation"]);
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

    /// As a transition, but without trigger parameters.
    fn default_transition(&mut self, xml: Xml<'_, '_>) {
        self.only(xml, &["interpretation"]);
        let parts = self.transition_parts(xml, "default_transition");
        if let Some(parameter) = parts.parameters.first() {
            let at = parameter.0;
            let message = "a `default_transition` matches every event, so it has no parameters: \
                remove them, or write a `transition`";
            self.report.error(at, message);
        }
        let variable = parts.actions.iter().flat_map(|action| &action.arguments);
        let mut variables = variable.filter_map(|argument| match argument {
            Argument::Variable(name) => Some(name),
            Argument::Text(_) | Argument::Integer(_) => None,
        });
        if let Some(name) = variables.next() {
            let at = self.span(xml);
            let message = format!(
                "`{name}` is not a text in `'`, and a `default_transition` has no parameters: \
                 write a `transition`, or a text"
            );
            self.report.error(at, message);
        }
        self.not_understood(xml);
    }

    fn send_action(&mut self, xml: Xml<'_, '_>) {
        // Its mistakes are reported nevertheless.
        let _ = self.action(xml);
        self.not_understood(xml);
    }

    /// Elements of the standard without support, as no published definition uses them.
    fn not_understood(&mut self, xml: Xml<'_, '_>) {
        let name = xml.tag_name().name();
        let message =
            format!("ignored: `{name}` is not supported; write a `transition` with `action`s");
        let at = self.span(xml);
        self.report.warning(at, message);
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
