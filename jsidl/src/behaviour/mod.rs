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
    /// Transitions of its own `default_state`, tried in every state when no other can be taken.
    pub default_transitions: Vec<Transition>,
    /// Position of the declaration.
    pub location: Location,
    pub(crate) span: Span,
}

impl StateMachine {
    /// All transitions: those of all states, then its own default ones.
    pub fn transitions(&self) -> impl Iterator<Item = &Transition> {
        let of_states = self.all_states().flat_map(State::all_transitions);
        of_states.chain(&self.default_transitions)
    }

    /// Whether it has one state, in which nothing happens.
    pub(crate) fn is_silent(&self) -> bool {
        let [state] = self.states.as_slice() else {
            return false;
        };
        state.children.is_empty()
            && state.entry.is_empty()
            && state.exit.is_empty()
            && self.transitions().next().is_none()
    }

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
    /// Transitions that are tried when no other can be taken: those of its `default_state`, and
    /// `default_transition`s, which have no trigger.
    pub default_transitions: Vec<Transition>,
    /// The substates.
    pub children: Vec<Self>,
    /// Position of the declaration.
    pub location: Location,
    pub(crate) span: Span,
}

impl State {
    /// Its transitions, then the default ones; not those of its substates.
    pub fn all_transitions(&self) -> impl Iterator<Item = &Transition> {
        self.transitions.iter().chain(&self.default_transitions)
    }
}

/// A `transition` or a `default_transition`.
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
    /// The event's name, qualified, for example `events.transport.Receive`. `None` in a
    /// `default_transition`, which every event triggers that triggers nothing else.
    pub event: Option<Name>,
    /// Parameters of the event.
    pub parameters: Vec<Parameter>,
}

impl Trigger {
    /// The event's unqualified name; `None` in a `default_transition`.
    pub fn name(&self) -> Option<&str> {
        self.event.as_ref().map(Name::last)
    }

    /// The name of the message that must be received, if the trigger has one.
    pub fn message(&self) -> Option<&str> {
        let first = self.parameters.first()?;
        let kind = &first.kind;
        // Unknown types of two words are numbers of a kind, too.
        let is_message = !first.is_number() && !kind.contains(' ') && !first.is_envelope();
        is_message.then(|| kind.rsplit('.').next().unwrap_or(kind))
    }

    /// Whether it has the transport's data about the message, such as the sender's address.
    pub fn has_envelope(&self) -> bool {
        self.parameters.iter().any(Parameter::is_envelope)
    }
}

/// Types of numeric parameters: those of the parameters' own rule, and those of fields.
const NUMBERS: [&str; 8] = [
    "unsigned byte",
    "unsigned short",
    "unsigned int",
    "unsigned long",
    "unsigned short integer",
    "unsigned integer",
    "unsigned long integer",
    "byte",
];

/// A `parameter` of a trigger.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// A message's name, the path of a record in the event itself, or the type of a number.
    pub kind: String,
    /// Its name in guards and actions.
    pub name: String,
}

impl Parameter {
    /// Whether it is a number, not a message or a part of one.
    pub(crate) fn is_number(&self) -> bool {
        NUMBERS.contains(&self.kind.as_str())
    }

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
    /// `push`: to a state, with another one remembered for the next `pop`.
    Push(Push),
    /// `pop`: the state that was remembered last. If it names a transition, that event follows
    /// when the state is entered.
    Pop(Option<Call>),
}

/// A `push`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Push {
    /// Path of the state that is entered.
    pub to: Name,
    /// Path of the remembered state, from its `simple`; `None` for the current one.
    pub back: Option<Name>,
}

/// An `action` or a `send_action`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Action {
    /// Whether it calls a function or sends an event.
    pub kind: ActionKind,
    /// Qualified by the aliases of the services up to the one that implements it.
    pub name: Name,
    /// Arguments of the action.
    pub arguments: Vec<Argument>,
}

/// The two kinds of actions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActionKind {
    /// `action`: a function of the service.
    Call,
    /// `send_action`: sends an event or a message.
    Send,
}

impl Action {
    /// The message that it sends, if it is the transport's `Send` with a message name.
    pub fn sent(&self) -> Option<&str> {
        let first = self.arguments.first()?;
        first.text().filter(|_| self.name.last() == "Send")
    }
}
