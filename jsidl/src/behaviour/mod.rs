//! Protocol behaviour of a service: the `protocol_behavior` of its definition.
//!
//! [`Service::behaviour`](crate::model::Service::behaviour) holds the [`StateMachine`]s as written.
//! A derived service declares only its additions to the machines of its base;
//! [`machine`](crate::machine) merges the parts.

mod guard;

use std::fmt;

use crate::source::{Location, Span};

pub use guard::{Argument, Call, Comparison, Guard};

/// Maximum length of a name: findings repeat names.
const LONGEST: usize = 500;

/// Identifiers joined by dots: the path of a state from the outermost inwards, or a name qualified
/// by the aliases of the services up to its declaration. Never empty.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Name(Vec<String>);

impl Name {
    /// Parses a whole text; `None` if it has anything except identifiers and dots.
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

    /// The name of a member of what this name refers to.
    pub(crate) fn join(&self, inner: &str) -> Self {
        let parts = self.0.iter().cloned();
        Self(parts.chain([inner.to_owned()]).collect())
    }

    /// The last identifier: the unqualified name.
    pub fn last(&self) -> &str {
        self.0.last().map_or("", String::as_str)
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join("."))
    }
}

/// A `state_machine` as declared by one service.
#[derive(Debug, Clone, PartialEq)]
pub struct StateMachine {
    /// Qualified by the aliases along `inherits_from` if it extends a machine of another service,
    /// for example `events.transport.ReceiveFSM`.
    pub name: Name,
    /// Path of its `start` state; a composite state starts in its initial state.
    pub start: Name,
    /// The outermost states.
    pub states: Vec<State>,
    /// Position of the declaration.
    pub location: Location,
    pub(crate) span: Span,
}

impl StateMachine {
    /// All states with their substates, each before its substates.
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
    /// Its own name, without the enclosing states.
    pub name: String,
    /// The substate that is entered first.
    pub initial: Option<String>,
    /// Actions on entry.
    pub entry: Vec<Action>,
    /// Actions on exit.
    pub exit: Vec<Action>,
    /// Transitions that can be taken while it is active, in trial order.
    pub transitions: Vec<Transition>,
    /// Transitions of its `default_state`, tried when no other can be taken.
    pub default_transitions: Vec<Transition>,
    /// The substates.
    pub children: Vec<Self>,
    /// Position of the declaration.
    pub location: Location,
    pub(crate) span: Span,
}

/// A `transition`.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// The triggering event.
    pub trigger: Trigger,
    /// The condition.
    pub guard: Option<Guard>,
    /// The target.
    pub kind: TransitionKind,
    /// The actions, in order.
    pub actions: Vec<Action>,
    /// Position of the declaration.
    pub location: Location,
    pub(crate) span: Span,
}

impl Transition {
    /// The names of the messages that its actions send: the first quoted text of each `Send`.
    pub fn answers(&self) -> impl Iterator<Item = &str> {
        self.actions.iter().filter_map(Action::sent)
    }
}

/// The event that triggers a transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trigger {
    /// The event's name, qualified, for example `events.transport.Receive`.
    pub event: Name,
    /// Parameters of the event.
    pub parameters: Vec<Parameter>,
}

impl Trigger {
    /// The name of the message that must be received, if the trigger has one.
    pub fn message(&self) -> Option<&str> {
        let kind = &self.parameters.first()?.kind;
        // Types of numbers have two words.
        let is_message = !kind.contains(' ') && !self.parameters[0].is_envelope();
        is_message.then(|| kind.rsplit('.').next().unwrap_or(kind))
    }

    /// Whether it has the transport's data about the message, such as the sender's address.
    pub fn has_envelope(&self) -> bool {
        self.parameters.iter().any(Parameter::is_envelope)
    }
}

/// A `parameter` of a trigger.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// A message's name, the path of a record in the event itself, or the type of a number.
    pub kind: String,
    /// Its name in guards and actions.
    pub name: String,
}

impl Parameter {
    /// Whether it is the record of the event `Receive` that describes the message's transport.
    pub(crate) fn is_envelope(&self) -> bool {
        self.kind.ends_with(".ReceiveRec")
    }
}

/// Target of a transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TransitionKind {
    /// `internal`: no state is left or entered.
    Internal,
    /// `simple` with an `end_state`: to the state with this path.
    To(Name),
    /// `simple` without an `end_state`: the same state, which is left and entered again.
    Again,
    /// `push`: the state with this path; the current one is remembered.
    Push(Name),
    /// `pop`: the state that was remembered last.
    Pop,
}

/// An `action`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Action {
    /// Qualified by the aliases of the services up to the one that implements it.
    pub name: Name,
    /// Arguments of the action.
    pub arguments: Vec<Argument>,
}

impl Action {
    /// The message that it sends, if it is the transport's `Send` with a message name.
    pub fn sent(&self) -> Option<&str> {
        let first = self.arguments.first()?;
        first.text().filter(|_| self.name.last() == "Send")
    }
}
