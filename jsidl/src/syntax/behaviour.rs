//! Reads `protocol_behavior`: state machines with their states, transitions and actions.
//!
//! What is wrong in a machine leaves that machine out, not the service: its messages do not
//! depend on it.

use roxmltree::Node as Xml;

use super::element::{FLAGS, Reader};
use crate::behaviour::{
    Action, Argument, Guard, Name, Parameter, State, StateMachine, Transition, TransitionKind,
    Trigger,
};
use crate::source::Spanned;

/// States of a service; published ones have up to 17.
const MOST_STATES: usize = 500;

impl Reader<'_> {
    /// The machines that could be read without an error.
    pub(super) fn behaviour(&mut self, xml: Xml<'_, '_>) -> Vec<StateMachine> {
        self.only(xml, &["is_stateless"]);
        if let Some(text) = self.attribute(xml, "is_stateless") {
            self.word(&text, "is_stateless", &FLAGS);
        }
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
                "start" => starts.extend(self.start(child)),
                "state_machine" => definitions.push(child),
                _ => self.misplaced(
                    child,
                    "protocol_behavior",
                    "a `start` and a `state_machine` for each machine",
                ),
            }
        }
        let machines = definitions.into_iter();
        machines
            .filter_map(|child| self.state_machine(child, &starts))
            .collect()
    }

    /// The name of a machine and the state in which it starts.
    fn start(&mut self, xml: Xml<'_, '_>) -> Option<(Name, Name)> {
        self.only(xml, &["state_machine_name", "state_name", "interpretation"]);
        let machine = self.dotted(xml, "state_machine_name");
        let state = self.dotted(xml, "state_name");
        Some((machine?.value, state?.value))
    }

    fn state_machine(&mut self, xml: Xml<'_, '_>, starts: &[(Name, Name)]) -> Option<StateMachine> {
        self.only(xml, &["name", "interpretation"]);
        let before = self.report.errors();
        let name = self.dotted(xml, "name");
        let mut states = Vec::new();
        for child in self.children(xml) {
            match child.tag_name().name() {
                "state" => self.add_state(&mut states, child),
                // Where a diagram editor draws the arrow to the first state.
                "pseudo_start_state" => {}
                _ => self.misplaced(child, "state_machine", "`state`s"),
            }
        }
        let name = name?.value;
        let start = starts.iter().find(|(machine, _)| *machine == name);
        let span = self.span(xml);
        if start.is_none() {
            let message = format!(
                "it is not said where `{name}` starts: add a `start` with this \
                 `state_machine_name`"
            );
            self.report.error(span, message);
        }
        let (_, start) = start.filter(|_| self.report.errors() == before)?;
        Some(StateMachine {
            name,
            start: start.clone(),
            states,
            location: self.location(xml),
            span,
        })
    }

    /// Adds a state that could be named to those beside it.
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
        let initial = self
            .attribute(xml, "initial_state")
            .and_then(|initial| self.identifier(initial));
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
                "default_transition" => self.not_understood(child),
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

    fn default_state(&mut self, xml: Xml<'_, '_>) -> Vec<Transition> {
        self.only(xml, &["interpretation"]);
        let mut transitions = Vec::new();
        for child in self.children(xml) {
            match child.tag_name().name() {
                "transition" => transitions.extend(self.transition(child)),
                "default_transition" => self.not_understood(child),
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
                "send_action" => self.not_understood(child),
                _ => self.misplaced(child, &parent, "`action`s"),
            }
        }
        actions
    }

    fn transition(&mut self, xml: Xml<'_, '_>) -> Option<Transition> {
        self.only(xml, &["name", "interpretation"]);
        let event = self.dotted(xml, "name");
        let (mut parameters, mut actions) = (Vec::new(), Vec::new());
        let (mut guard, mut kind) = (None, None);
        for child in self.children(xml) {
            match child.tag_name().name() {
                "parameter" => parameters.extend(self.parameter(child)),
                "guard" => self.once(&mut guard, child, xml),
                "internal" | "simple" | "push" | "pop" if kind.is_some() => {
                    let at = self.span(child);
                    let message = "a transition leads to one place: keep one of `internal`, \
                                   `simple`, `push` and `pop`";
                    self.report.error(at, message);
                }
                "internal" | "simple" | "push" | "pop" => kind = Some(child),
                "action" => actions.extend(self.action(child)),
                "send_action" => self.not_understood(child),
                _ => self.misplaced(
                    child,
                    "transition",
                    "`parameter`s, a `guard`, one of `internal`, `simple`, `push` and `pop`, and \
                     `action`s",
                ),
            }
        }
        let guard = match guard {
            Some(guard) => Some(self.guard(guard)?),
            None => None,
        };
        let kind = match kind {
            Some(kind) => self.kind(kind),
            None => {
                self.lacks(xml, "internal");
                None
            }
        };
        Some(Transition {
            trigger: Trigger {
                event: event?.value,
                parameters,
            },
            guard,
            kind: kind?,
            actions,
            location: self.location(xml),
            span: self.span(xml),
        })
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

    /// The standard lets a `pop` name a transition to be taken afterwards, with arguments; no
    /// published one does.
    fn pop(&mut self, xml: Xml<'_, '_>) -> TransitionKind {
        self.only(xml, &["transition", "interpretation"]);
        if let Some(transition) = self.attribute(xml, "transition") {
            let message = "passed over: the `transition` of a `pop` is not understood yet";
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
        let text = self.required(xml, "value")?;
        let read = Argument::parse(&text.value);
        self.understood(
            read,
            &text,
            "`value` must be a parameter's name or a text in `'`",
        )
    }

    /// Elements of the standard that no published definition has.
    fn not_understood(&mut self, xml: Xml<'_, '_>) {
        let name = xml.tag_name().name();
        let message = format!(
            "passed over: `{name}` is not understood yet; write a `transition` with `action`s"
        );
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
            let message = format!("`{attribute}` must be names joined by dots");
            self.report.error(text.span, message);
        }
        Some(Spanned {
            value: name?,
            span: text.span,
        })
    }
}
