//! What a service does when: the `protocol_behavior` of its definition.
//!
//! [`Service::behaviour`](crate::model::Service::behaviour) holds the [`StateMachine`]s as they
//! are written. A service that inherits from another writes down only what it adds to the
//! machines of that one; [`Machine`] puts the parts together and says which transitions a state
//! has for a message. [`Run`] lets it run, [`dot`] and [`mermaid`] draw it.

mod draw;
mod guard;
mod machine;
mod run;

use std::fmt;

use crate::source::{Location, Span};

pub use draw::{dot, mermaid};
pub use guard::{Argument, Call, Comparison, Guard};
pub use machine::{Declared, Machine, MachineState, StateIndex, Stimulus};
pub use run::{MOST_REMEMBERED, Outcome, Run};

/// Longer names are refused: findings repeat them.
const LONGEST: usize = 500;

/// Identifiers joined by dots: the path of a state from the outermost inwards, or a name with the
/// aliases of the services that lead to its declaration. Never empty.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Name(Vec<String>);

impl Name {
    /// Reads a whole text; `None` if it is anything else than identifiers and dots.
    pub fn parse(text: &str) -> Option<Self> {
        match guard::name(text) {
            Ok(("", name)) if text.len() <= LONGEST => Some(name),
            _ => None,
        }
    }

    pub(crate) fn of(parts: Vec<&str>) -> Self {
        Self(parts.into_iter().map(str::to_owned).collect())
    }

    /// The identifiers.
    pub fn parts(&self) -> &[String] {
        &self.0
    }

    /// The name of something inside what this name means.
    pub(crate) fn join(&self, inner: &str) -> Self {
        let parts = self.0.iter().cloned();
        Self(parts.chain([inner.to_owned()]).collect())
    }

    /// The last identifier, which is the name without its qualification.
    pub fn last(&self) -> &str {
        self.0.last().map_or("", String::as_str)
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join("."))
    }
}

/// A `state_machine`, as one service writes it down.
#[derive(Debug, Clone, PartialEq)]
pub struct StateMachine {
    /// Qualified by the aliases along `inherits_from` if it extends a machine of another service,
    /// for example `events.transport.ReceiveFSM`.
    pub name: Name,
    /// Path of the state in which it begins, from its `start`; if that is a composite one, in the
    /// initial state within.
    pub start: Name,
    /// The outermost states.
    pub states: Vec<State>,
    /// Where it stands.
    pub location: Location,
    pub(crate) span: Span,
}

impl StateMachine {
    /// All states with those inside them, each before those that it contains.
    pub fn all_states(&self) -> impl Iterator<Item = &State> {
        let mut waiting: Vec<_> = self.states.iter().rev().collect();
        std::iter::from_fn(move || {
            let state = waiting.pop()?;
            waiting.extend(state.children.iter().rev());
            Some(state)
        })
    }
}

/// A `state`.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Its own name, without those of the states around it.
    pub name: String,
    /// The state within that is entered first.
    pub initial: Option<String>,
    /// What is done when it is entered.
    pub entry: Vec<Action>,
    /// What is done when it is left.
    pub exit: Vec<Action>,
    /// Transitions that may be taken while it is active, in the order in which they are tried.
    pub transitions: Vec<Transition>,
    /// Transitions of its `default_state`, which are tried when no other can be taken.
    pub default_transitions: Vec<Transition>,
    /// The states within.
    pub children: Vec<Self>,
    /// Where it stands.
    pub location: Location,
    pub(crate) span: Span,
}

/// A `transition`.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// What it reacts to.
    pub trigger: Trigger,
    /// Under which condition it is taken.
    pub guard: Option<Guard>,
    /// Where it leads.
    pub kind: TransitionKind,
    /// What is done, in this order.
    pub actions: Vec<Action>,
    /// Where it stands.
    pub location: Location,
    pub(crate) span: Span,
}

impl Transition {
    /// The messages that its actions send, by name: the first quoted text that a `Send` is given.
    pub fn answers(&self) -> impl Iterator<Item = &str> {
        self.actions.iter().filter_map(Action::sent)
    }
}

/// The event that a transition reacts to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trigger {
    /// The event's name, qualified, for example `events.transport.Receive`.
    pub event: Name,
    /// What the event brings along.
    pub parameters: Vec<Parameter>,
}

impl Trigger {
    /// The name of the message that has to be received, for a trigger that says so.
    pub fn message(&self) -> Option<&str> {
        let kind = &self.parameters.first()?.kind;
        // Numbers have types of two words.
        let is_message = !kind.contains(' ') && !self.parameters[0].is_envelope();
        is_message.then(|| kind.rsplit('.').next().unwrap_or(kind))
    }

    /// Whether it takes what the transport knows about the message, such as the sender's address.
    pub fn has_envelope(&self) -> bool {
        self.parameters.iter().any(Parameter::is_envelope)
    }
}

/// A `parameter` of a trigger.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// A message's name, the path of a record in the event itself, or the type of a number.
    pub kind: String,
    /// What guards and actions call it.
    pub name: String,
}

impl Parameter {
    /// The record of the event `Receive` in which the transport describes the message.
    pub(crate) fn is_envelope(&self) -> bool {
        self.kind.ends_with(".ReceiveRec")
    }
}

/// Where a transition leads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TransitionKind {
    /// `internal`: nowhere, no state is left or entered.
    Internal,
    /// `simple` with an `end_state`: to the state with this path.
    To(Name),
    /// `simple` without an `end_state`: back into the same state, which is left and entered again.
    Again,
    /// `push`: to the state with this path, the present one being remembered.
    Push(Name),
    /// `pop`: back to the state that was remembered last.
    Pop,
}

/// An `action`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Action {
    /// Qualified by the aliases of the services on the way to the one that performs it.
    pub name: Name,
    /// What it is given.
    pub arguments: Vec<Argument>,
}

impl Action {
    /// The message that it sends, if it is the transport's `Send` of a message that it names.
    pub fn sent(&self) -> Option<&str> {
        let first = self.arguments.first()?;
        first.text().filter(|_| self.name.last() == "Send")
    }
}
