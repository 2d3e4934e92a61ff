//! Vocabulary of a machine: its events, and the methods of its trait.

use std::collections::{BTreeSet, HashMap};

use heck::ToSnakeCase;

use super::super::ident::Names;
use crate::behaviour::{Action, Argument, Comparison, Guard, Transition, Trigger};
use crate::machine::{Machine, Stimulus};
use crate::model::Service;

/// All names in the generated types of one machine.
pub(super) struct Vocabulary {
    pub(super) events: Vec<Event>,
    pub(super) methods: Vec<Method>,
    pub(super) choices: Vec<Choice>,
    /// The places of events and methods.
    known_events: HashMap<(String, Option<String>), usize>,
    known_methods: HashMap<Key, usize>,
}

/// Several message types for one parameter.
pub(super) struct Choice {
    pub(super) ident: String,
    pub(super) events: BTreeSet<usize>,
}

/// A choice of more messages is named after its method, not after the messages.
const MOST_NAMED: usize = 2;

/// An event of the machine.
pub(super) struct Event {
    /// Unqualified name from the definition.
    pub(super) name: String,
    pub(super) message: Option<String>,
    /// Variant of the enum.
    pub(super) ident: String,
    /// Name of the handler function.
    pub(super) handler: String,
    /// Whether it carries the transport's data about the message.
    pub(super) envelope: bool,
    /// Number of its numeric parameters.
    pub(super) numbers: usize,
}

/// An action, or a guard's call.
pub(super) struct Method {
    key: Key,
    pub(super) ident: String,
    /// Unqualified name from the definition.
    pub(super) name: String,
    /// By position: the events whose messages are passed, and the texts.
    pub(super) arguments: Vec<Given>,
    /// Name of the enum of messages, if there are several.
    pub(super) message_type: String,
}

/// Argument of a method at one position.
#[derive(Default)]
pub(super) struct Given {
    pub(super) events: BTreeSet<usize>,
    pub(super) texts: BTreeSet<String>,
}

/// Methods with the same key are merged.
#[derive(PartialEq, Eq, Clone, Hash)]
struct Key {
    base: String,
    asks: bool,
    kinds: Vec<Kind>,
}

/// Kind of a method's parameter.
#[derive(PartialEq, Eq, Clone, Copy, Hash)]
pub(super) enum Kind {
    Message,
    Envelope,
    Number,
    Text,
}

/// An argument of a call, in the generated code.
pub(super) enum Value {
    Message,
    Envelope,
    /// Index of the event's numeric parameter.
    Number(usize),
    Text(String),
}

impl Value {
    const fn kind(&self) -> Kind {
        match self {
            Self::Message => Kind::Message,
            Self::Envelope => Kind::Envelope,
            Self::Number(_) => Kind::Number,
            Self::Text(_) => Kind::Text,
        }
    }
}

/// A call of a method, with its name and arguments.
struct Spoken {
    key: Key,
    name: String,
    values: Vec<Value>,
}

impl Event {
    /// What the machine reacts to.
    pub(super) fn stimulus(&self) -> Stimulus<'_> {
        Stimulus {
            event: &self.name,
            message: self.message.as_deref(),
        }
    }
}

/// What triggers with the same event have in common; not the case of its letters.
pub(super) fn event_key(name: &str, message: Option<&str>) -> (String, Option<String>) {
    (
        name.to_ascii_lowercase(),
        message.map(str::to_ascii_lowercase),
    )
}

impl Method {
    pub(super) fn asks(&self) -> bool {
        self.key.asks
    }

    /// The kinds of its parameters, with their arguments.
    pub(super) fn parameters(&self) -> impl Iterator<Item = (Kind, &Given)> {
        self.key.kinds.iter().copied().zip(&self.arguments)
    }
}

impl Vocabulary {
    pub(super) fn of(machine: &Machine<'_>, types: &mut Names) -> Self {
        let mut collected = Self {
            events: Vec::new(),
            methods: Vec::new(),
            choices: Vec::new(),
            known_events: HashMap::new(),
            known_methods: HashMap::new(),
        };
        for (_, state) in machine.states() {
            for effect in state.entry.iter().chain(&state.exit) {
                collected.add_action(None, effect.item);
            }
            let all = state.transitions.iter().chain(&state.default_transitions);
            for declared in all {
                collected.add_transition(declared.item);
                // Also what has no transition of its own triggers a default transition.
                if declared.item.trigger.event.is_none() {
                    collected.add_inputs(declared.service);
                }
            }
        }
        collected.name_all(types);
        collected
    }

    pub(super) fn has_envelope(&self) -> bool {
        self.events.iter().any(|event| event.envelope)
    }

    pub(super) fn event_of(&self, trigger: &Trigger) -> Option<usize> {
        let key = event_key(trigger.name()?, trigger.message());
        self.known_events.get(&key).copied()
    }

    /// The arrival of each message that a service receives.
    fn add_inputs(&mut self, service: &Service) {
        for message in &service.inputs {
            let arrives = |event: &Event| {
                let name = event.message.as_deref();
                name.is_some_and(|name| name.eq_ignore_ascii_case(&message.name))
            };
            if !self.events.iter().any(arrives) {
                self.add_event("Receive", Some(&message.name));
            }
        }
    }

    fn add_event(&mut self, name: &str, message: Option<&str>) -> usize {
        self.events.push(Event {
            name: name.to_owned(),
            message: message.map(str::to_owned),
            ident: String::new(),
            handler: String::new(),
            envelope: false,
            numbers: 0,
        });
        let event = self.events.len() - 1;
        self.known_events.insert(event_key(name, message), event);
        event
    }

    fn add_transition(&mut self, transition: &Transition) {
        let trigger = &transition.trigger;
        let Some(name) = trigger.name() else {
            let actions = transition.actions.iter();
            actions.for_each(|action| self.add_action(None, action));
            if let Some(guard) = &transition.guard {
                self.add_guard(None, trigger, guard);
            }
            return;
        };
        let known = self.event_of(trigger);
        let event = known.unwrap_or_else(|| self.add_event(name, trigger.message()));
        let numbers = numbers(trigger).count();
        let known = &mut self.events[event];
        known.envelope |= trigger.has_envelope();
        known.numbers = known.numbers.max(numbers);
        if let Some(guard) = &transition.guard {
            self.add_guard(Some(event), trigger, guard);
        }
        for action in &transition.actions {
            self.add_action(Some((event, trigger)), action);
        }
    }

    fn add_guard(&mut self, event: Option<usize>, trigger: &Trigger, guard: &Guard) {
        match guard {
            Guard::Not(inner) => self.add_guard(event, trigger, inner),
            Guard::And(left, right) | Guard::Or(left, right) => {
                self.add_guard(event, trigger, left);
                self.add_guard(event, trigger, right);
            }
            question if comparison(trigger, question).is_some() => {}
            question => self.add(event, question_of(Some(trigger), question)),
        }
    }

    fn add_action(&mut self, event: Option<(usize, &Trigger)>, action: &Action) {
        let spoken = action_of(event.map(|(_, trigger)| trigger), action);
        self.add(event.map(|(event, _)| event), spoken);
    }

    fn add(&mut self, event: Option<usize>, spoken: Spoken) {
        let known = self.known_methods.get(&spoken.key).copied();
        let method = known.unwrap_or_else(|| {
            self.known_methods
                .insert(spoken.key.clone(), self.methods.len());
            self.methods.push(Method {
                ident: String::new(),
                name: spoken.name,
                arguments: spoken.values.iter().map(|_| Given::default()).collect(),
                message_type: String::new(),
                key: spoken.key,
            });
            self.methods.len() - 1
        });
        for (given, value) in self.methods[method].arguments.iter_mut().zip(spoken.values) {
            match value {
                Value::Message => given.events.extend(event),
                Value::Text(text) => _ = given.texts.insert(text),
                Value::Envelope | Value::Number(_) => {}
            }
        }
    }

    fn name_all(&mut self, types: &mut Names) {
        let (mut alternatives, mut handlers) = (Names::default(), Names::reserving(&["step"]));
        for event in &mut self.events {
            let name = match &event.message {
                // An event with its message's name needs no other name.
                Some(message) if event.name == "Receive" || event.name == *message => {
                    message.clone()
                }
                Some(message) => format!("{} {message}", event.name),
                None => event.name.clone(),
            };
            event.ident = alternatives.camel(&name);
            event.handler = handlers.snake(&format!("on {name}"));
        }
        let mut methods = Names::default();
        for method in &mut self.methods {
            method.ident = methods.snake(&method.key.base);
            let mut given = method.arguments.iter().map(|given| &given.events);
            let Some(several) = given.find(|events| events.len() > 1) else {
                continue;
            };
            let known = self.choices.iter().find(|choice| choice.events == *several);
            method.message_type = match known {
                Some(known) => known.ident.clone(),
                None => {
                    let alternatives = several.iter().map(|&it| self.events[it].ident.as_str());
                    let name = if several.len() > MOST_NAMED {
                        format!("{} message", method.ident)
                    } else {
                        alternatives.collect::<Vec<_>>().join(" or ")
                    };
                    let ident = types.camel(&name);
                    let events = several.clone();
                    self.choices.push(Choice { ident, events });
                    self.choices
                        .last()
                        .map_or_else(String::new, |it| it.ident.clone())
                }
            };
        }
    }

    /// The method of an action, with the arguments.
    pub(super) fn action(
        &self,
        trigger: Option<&Trigger>,
        action: &Action,
    ) -> Option<(&Method, Vec<Value>)> {
        self.find(action_of(trigger, action))
    }

    /// The method of a guard's call, with the arguments.
    pub(super) fn question(
        &self,
        trigger: &Trigger,
        question: &Guard,
    ) -> Option<(&Method, Vec<Value>)> {
        self.find(question_of(Some(trigger), question))
    }

    fn find(&self, spoken: Spoken) -> Option<(&Method, Vec<Value>)> {
        let method = *self.known_methods.get(&spoken.key)?;
        Some((&self.methods[method], spoken.values))
    }
}

/// The trigger's parameters except the message and the transport's data.
fn numbers(trigger: &Trigger) -> impl Iterator<Item = &str> {
    let parameters = trigger.parameters.iter().enumerate();
    let numbers = parameters.filter(|&(position, parameter)| {
        let message = position == 0 && trigger.message().is_some();
        !message && !parameter.is_envelope()
    });
    numbers.map(|(_, parameter)| parameter.name.as_str())
}

/// The sent message is part of the method's name: `Send('ReportStatus', …)` and
/// `Send('RejectControl', …)` are different actions.
fn action_of(trigger: Option<&Trigger>, action: &Action) -> Spoken {
    let last = action.name.last();
    let (name, rest) = match (action.sent(), action.arguments.split_first()) {
        (Some(message), Some((_, rest))) => (format!("{last} {message}"), rest),
        _ => (last.to_owned(), action.arguments.as_slice()),
    };
    spoken(trigger, name, rest, false)
}

/// A side of a comparison that the generated code knows.
#[derive(PartialEq)]
enum Operand {
    /// Index of the event's numeric parameter.
    Number(usize),
    Integer(i64),
    Text(String),
}

impl Operand {
    fn of(trigger: &Trigger, guard: &Guard) -> Option<Self> {
        match guard {
            Guard::Name(name) => match value(Some(trigger), &Argument::Variable(name.clone())) {
                Value::Number(number) => Some(Self::Number(number)),
                _ => None,
            },
            Guard::Literal(Argument::Integer(digits)) => digits.parse().ok().map(Self::Integer),
            Guard::Literal(Argument::Text(text)) => Some(Self::Text(text.clone())),
            _ => None,
        }
    }

    fn code(&self) -> Option<String> {
        match self {
            Self::Number(number) => Some(format!("number_{number}")),
            Self::Integer(integer) => Some(integer.to_string()),
            Self::Text(_) => None,
        }
    }
}

/// A comparison as a Rust condition, if numbers of the event and constants decide it; `None` if the
/// service is asked.
pub(super) fn comparison(trigger: &Trigger, guard: &Guard) -> Option<String> {
    let Guard::Compare(comparison, left, right) = guard else {
        return None;
    };
    let [left, right] = [left, right].map(|it| Operand::of(trigger, it));
    let (left, right) = (left?, right?);
    let decided = match (&left, &right) {
        (Operand::Integer(left), Operand::Integer(right)) => Some(left.cmp(right)),
        (Operand::Text(left), Operand::Text(right)) => Some(left.cmp(right)),
        _ => (left == right).then_some(std::cmp::Ordering::Equal),
    };
    Some(match decided {
        Some(order) => comparison.holds(order).to_string(),
        None => format!("{} {} {}", left.code()?, comparison.sign(), right.code()?),
    })
}

fn question_of(trigger: Option<&Trigger>, question: &Guard) -> Spoken {
    match question {
        Guard::Call(call) => spoken(trigger, call.name.last().to_owned(), &call.arguments, true),
        // A comparison or a bare name: its words are the method's name, and it gets all parameters.
        other => {
            let words = words(other);
            let all = trigger.into_iter().flat_map(|trigger| &trigger.parameters);
            let all = all.filter_map(|parameter| Argument::parse(&parameter.name).ok());
            Spoken {
                name: other.to_string(),
                ..spoken(trigger, words, &all.collect::<Vec<_>>(), true)
            }
        }
    }
}

/// A guard in words, so that different comparisons of the same operands have different names.
fn words(guard: &Guard) -> String {
    match guard {
        Guard::Compare(comparison, left, right) => {
            let verb = match comparison {
                Comparison::Equal => "is",
                Comparison::Unequal => "is not",
                Comparison::Less => "is less than",
                Comparison::Greater => "is greater than",
            };
            format!("{} {verb} {}", words(left), words(right))
        }
        other => other.to_string().replace('-', "minus "),
    }
}

fn spoken(trigger: Option<&Trigger>, name: String, arguments: &[Argument], asks: bool) -> Spoken {
    let values: Vec<_> = arguments.iter().map(|it| value(trigger, it)).collect();
    let key = Key {
        base: name.to_snake_case(),
        asks,
        kinds: values.iter().map(Value::kind).collect(),
    };
    Spoken { key, name, values }
}

/// An argument that is no parameter of the event is a text.
pub(super) fn value(trigger: Option<&Trigger>, argument: &Argument) -> Value {
    let Argument::Variable(name) = argument else {
        return Value::Text(match argument {
            Argument::Text(text) | Argument::Integer(text) => text.clone(),
            Argument::Variable(name) => name.to_string(),
        });
    };
    let name = name.to_string();
    let known = trigger.and_then(|trigger| {
        let position = trigger.parameters.iter().position(|it| it.name == name)?;
        if trigger.parameters[position].is_envelope() {
            return Some(Value::Envelope);
        }
        if position == 0 && trigger.message().is_some() {
            return Some(Value::Message);
        }
        let number = numbers(trigger).position(|number| number == name)?;
        Some(Value::Number(number))
    });
    known.unwrap_or(Value::Text(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn different_comparisons_have_methods_of_their_own() {
        let guards = ["n == 0", "n != 0", "n < 3", "n > 3", "n == 3", "n == -3"];
        let names: BTreeSet<_> = guards
            .iter()
            .map(|text| {
                let guard = Guard::parse(text).unwrap();
                question_of(None, &guard).key.base
            })
            .collect();
        assert_eq!(names.len(), guards.len(), "{names:?}");
    }
}
