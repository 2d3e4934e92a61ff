//! Reads the protocol behaviour of the compact form.
//!
//! A machine's start and the mark of an initial state stand with the machine and the state, where
//! the compact form has them, until the whole behaviour is read: see [`nested`] and [`flat`].

use super::cursor::{Cursor, Place, Read, Start};
use super::lexer::{Fault, Kind, unquoted};
use super::tree::{Element, Text};
use super::words;

/// The word before `transition`, and the element of its target.
pub(super) const TARGETS: [&str; 4] = ["internal", "simple", "push", "pop"];

/// The attribute of a state that its parent enters first.
const INITIAL: &str = "initial";

/// Puts starts into machines, and marks initial states. `false` if a start has no machine or a
/// machine no start.
pub(super) fn nested(element: &mut Element) -> bool {
    let mut fits = true;
    if element.name == "protocol_behavior" {
        let children = std::mem::take(&mut element.children);
        let (starts, mut rest): (Vec<_>, Vec<_>) =
            children.into_iter().partition(|it| it.name == "start");
        fits = starts.len() == rest.len();
        for (start, machine) in starts.into_iter().zip(&mut rest) {
            fits &= start.value("state_machine_name") == machine.value("name");
            machine
                .comments
                .splice(0..0, start.comments.iter().cloned());
            machine.children.push(start);
        }
        element.children = rest;
    }
    let initial = element.value("initial_state").to_owned();
    if element.name == "state" && !initial.is_empty() {
        let mut states = element.children.iter_mut();
        if let Some(state) = states.find(|it| it.name == "state" && it.value("name") == initial) {
            let at = state.at;
            state.set(INITIAL, "true", at);
        }
    }
    element
        .children
        .iter_mut()
        .fold(fits, |fits, it| nested(it) && fits)
}

/// Undoes [`nested`].
pub(super) fn flat(element: &mut Element) {
    element.children.iter_mut().for_each(flat);
    if element.name == "protocol_behavior" {
        let mut starts = Vec::new();
        for machine in &mut element.children {
            let place = machine.children.iter().position(|it| it.name == "start");
            if machine.name == "state_machine"
                && let Some(place) = place
            {
                starts.push(machine.children.remove(place));
            }
        }
        element.children.splice(0..0, starts);
    }
    for child in &mut element.children {
        child.attributes.retain(|it| it.name != INITIAL);
    }
}

impl Cursor<'_> {
    pub(super) fn protocol(&mut self) -> Read<Element> {
        let at = self.here();
        let is_stateless = self.accept("stateless");
        self.expect("protocol")?;
        let mut behaviour = Element::new("protocol_behavior", at);
        if is_stateless {
            behaviour.set("is_stateless", "true", at);
        }
        self.fill(&mut behaviour, Place::Protocol)?;
        Ok(behaviour)
    }

    /// `state_machine name (start state) { … }`
    pub(super) fn machine(&mut self) -> Read<Element> {
        let at = self.here();
        self.expect("state_machine")?;
        let (name, name_at) = self.path()?;
        self.expect("(")?;
        let interpretation = self.interpretation();
        let start_at = self.here();
        self.expect("start")?;
        let (state, state_at) = self.path()?;
        self.expect(")")?;
        let mut start = Element::new("start", start_at)
            .with("state_machine_name", &*name, name_at)
            .with("state_name", state, state_at);
        explained(&mut start, interpretation);
        let mut machine = Element::new("state_machine", at).with("name", name, name_at);
        self.fill(&mut machine, Place::Machine)?;
        for state in &machine.children {
            if state.attribute(INITIAL).is_some() {
                let message =
                    "the first state of a machine stands after `start`: leave `initial` out";
                return Err(Fault::new(state.at, message));
            }
        }
        self.accept(";");
        Ok(machine.holding(start))
    }

    /// A state or the default state.
    pub(super) fn state(&mut self) -> Read<Element> {
        let at = self.here();
        let is_initial = self.accept("initial");
        self.expect("state")?;
        let mut state = if self.accept("default") {
            Element::new("default_state", at)
        } else {
            let (name, name_at) = self.path()?;
            Element::new("state", at).with("name", name, name_at)
        };
        self.fill(&mut state, Place::State)?;
        let mut initial = None;
        for child in state
            .children
            .iter()
            .filter(|it| it.attribute(INITIAL).is_some())
        {
            if initial.is_some() {
                return Err(Fault::new(
                    child.at,
                    "a second state is `initial`: keep one",
                ));
            }
            initial = Some((child.value("name").to_owned(), child.at));
        }
        if let Some((name, at)) = initial {
            state.set("initial_state", name, at);
        }
        if is_initial {
            state.set(INITIAL, "true", at);
        }
        self.accept(";");
        Ok(state)
    }

    pub(super) fn part_of_state(&mut self) -> Read<Element> {
        let element = match self.next() {
            "entry" => self.reaction("entry"),
            "exit" => self.reaction("exit"),
            "default" => {
                self.take();
                self.transition(false)
            }
            "initial" | "state" => self.state(),
            word if TARGETS.contains(&word) => self.transition(true),
            _ => Err(self.unexpected("`entry`, `exit`, a transition or a state")),
        }?;
        self.accept(";");
        Ok(element)
    }

    /// `entry { … }` and `exit { … }`
    fn reaction(&mut self, name: &'static str) -> Read<Element> {
        let (_, at) = self.take();
        let mut element = Element::new(name, at);
        self.fill(&mut element, Place::Reaction)?;
        Ok(element)
    }

    /// `actions { … }` or `send actions { … }`
    pub(super) fn actions(&mut self) -> Read<Vec<Element>> {
        let place = if self.accept("send") {
            Place::SendActions
        } else {
            Place::Actions
        };
        self.expect("actions")?;
        let mut list = Element::default();
        self.fill(&mut list, place)?;
        self.stray.append(&mut list.trailing);
        self.accept(";");
        Ok(list.children)
    }

    /// `name(first, second);`
    pub(super) fn action(&mut self, name: &'static str) -> Read<Element> {
        let (action, at) = self.path()?;
        let mut element = Element::new(name, at).with("name", action, at);
        element.children = self.arguments()?;
        self.expect(";")?;
        Ok(element)
    }

    /// `(first, second)`
    fn arguments(&mut self) -> Read<Vec<Element>> {
        self.expect("(")?;
        let mut arguments = Vec::new();
        while !self.accept(")") {
            if !arguments.is_empty() {
                self.expect(",")?;
            }
            let interpretation = self.interpretation();
            let at = self.here();
            let value = match self.kind() {
                Kind::Text => format!("'{}'", unquoted(self.take().0)),
                _ => self.expression(&[",", ")"])?.0,
            };
            let mut argument = Element::new("argument", at).with("value", value, at);
            explained(&mut argument, interpretation);
            arguments.push(argument);
        }
        Ok(arguments)
    }

    /// A transition; one without a trigger is a default transition.
    fn transition(&mut self, has_trigger: bool) -> Read<Element> {
        let at = self.here();
        let Some(kind) = TARGETS.into_iter().find(|it| self.next() == *it) else {
            return Err(self.unexpected("`internal`, `simple`, `push` or `pop`"));
        };
        self.take();
        self.expect("transition")?;
        let mut transition = if has_trigger {
            let (name, name_at) = self.path()?;
            Element::new("transition", at).with("name", name, name_at)
        } else {
            Element::new("default_transition", at)
        };
        if has_trigger && self.next() == "(" {
            transition.children = self.parameters()?;
        }
        let first = transition.children.len();
        self.fill(&mut transition, Place::Transition)?;
        let mut targets = transition.children[first..]
            .iter_mut()
            .filter(|it| TARGETS.contains(&it.name));
        match (targets.next(), kind) {
            // It is read without knowing the kind of the transition.
            (Some(target), "push") if target.name == "simple" => target.name = "push",
            (Some(target), _) if target.name == kind => {}
            (Some(target), _) => {
                return Err(Fault::new(
                    target.at,
                    format!("a `{kind} transition` has no such end"),
                ));
            }
            (None, "internal") => transition.children.push(Element::new("internal", at)),
            (None, _) => {
                return Err(Fault::new(
                    at,
                    format!("a `{kind} transition` needs an end, such as `-> state;`"),
                ));
            }
        }
        Ok(transition)
    }

    /// `(type name, …)`
    fn parameters(&mut self) -> Read<Vec<Element>> {
        self.expect("(")?;
        let mut parameters = Vec::new();
        while !self.accept(")") {
            if !parameters.is_empty() {
                self.expect(",")?;
            }
            let interpretation = self.interpretation();
            let (kind, at) = self.path()?;
            let (name, name_at) = self.name()?;
            let kind = words::parameter(&kind).map_or(kind.as_str(), |it| it);
            let mut parameter = Element::new("parameter", at)
                .with("type", kind, at)
                .with("value", name, name_at);
            explained(&mut parameter, interpretation);
            parameters.push(parameter);
        }
        Ok(parameters)
    }

    /// What is in a transition beside actions. An interpretation alone belongs to `internal`.
    pub(super) fn guard_or_target(&mut self, start: &Start) -> Read<Element> {
        match self.next() {
            "guard" => self.guard(),
            "secondary" | ";" => {
                let mut target = Element::new("pop", self.here());
                if self.accept("secondary") {
                    let (name, at) = self.path()?;
                    target.set("transition", name, at);
                    target.children = self.arguments()?;
                }
                self.expect(";")?;
                Ok(target)
            }
            "}" if start.has_interpretation() => Ok(Element::new("internal", start.at)),
            "->" | "next" => self.target(),
            _ if self.kind() == Kind::Interpretation => self.target(),
            _ => Err(self.unexpected("`guard`, `actions`, `->` or `secondary`")),
        }
    }

    /// `guard : condition ;`
    fn guard(&mut self) -> Read<Element> {
        let (_, at) = self.take();
        self.expect(":")?;
        let start = self.here();
        let mut condition = String::new();
        while self.kind() != Kind::End && self.next() != ";" {
            if !condition.is_empty() && self.here() > self.end() {
                condition.push(' ');
            }
            let is_text = self.kind() == Kind::Text;
            let (written, _) = self.take();
            if is_text {
                condition.push_str(&format!("'{}'", unquoted(written)));
            } else if written == "=" {
                condition.push_str("==");
            } else {
                condition.push_str(written);
            }
        }
        self.expect(";")?;
        Ok(Element::new("guard", at).with("condition", condition, start))
    }

    /// `-> state;`, and `popto` after a push. Without that it is read as `simple`.
    fn target(&mut self) -> Read<Element> {
        let at = self.here();
        let end = self.end_state()?;
        if !self.accept("popto") {
            return Ok(Element::new("simple", at).holding(end));
        }
        let interpretation = self.interpretation();
        let mut simple = Element::new("simple", self.here());
        explained(&mut simple, interpretation);
        simple.children.push(self.end_state()?);
        Ok(Element::new("push", at).holding(end).holding(simple))
    }

    /// `-> state;` or `next state;`
    fn end_state(&mut self) -> Read<Element> {
        let interpretation = self.interpretation();
        let at = self.here();
        if !self.accept("next") {
            self.expect("->")?;
        }
        let (state, state_at) = self.path()?;
        self.expect(";")?;
        let mut end = Element::new("end_state", at).with("state", state, state_at);
        explained(&mut end, interpretation);
        Ok(end)
    }
}

fn explained(element: &mut Element, interpretation: Option<Text>) {
    if let Some(Text { value, at }) = interpretation {
        element.set("interpretation", value, at);
    }
}
