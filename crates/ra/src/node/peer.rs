//! A peer subsystem: its known state and the open queries.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::Settings;
use super::subsystem::{RaComponentEntry, RaNodeEntry, RaServiceEntry, RaSubsystemEntry};
use crate::RaId;

/// A discovery query, in query order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Question {
    /// The subsystem's name, from its communicator.
    Subsystem,
    /// Its nodes and components.
    Configuration,
    /// Subscription to configuration changes.
    Subscription,
    /// The name of a node, from its manager.
    Node(u8),
    /// The name of a component, from the component itself.
    Name(RaId),
    /// Its services.
    Services(RaId),
}

impl Question {
    /// Whether the answer is part of the subsystem reported to the owner.
    const fn is_detail(self) -> bool {
        !matches!(self, Self::Configuration | Self::Subscription)
    }
}

/// Number of attempts of a query and the time of the next one.
#[derive(Clone, Copy, Debug)]
struct Attempts {
    made: u32,
    next: Instant,
}

/// A peer subsystem.
#[derive(Debug)]
pub(super) struct Peer {
    pub(super) subsystem: RaSubsystemEntry,
    pub(super) communicator: RaId,
    /// Time of its last message.
    pub(super) heard: Instant,
    /// Whether it has reported its nodes and components.
    pub(super) configured: bool,
    pub(super) subscribed: bool,
    /// Whether it differs from the subsystem last reported to the owner.
    changed: bool,
    /// Whether parts have vanished; the owner is notified before all queries are answered.
    shrunk: bool,
    questions: BTreeMap<Question, Attempts>,
    next_refresh: Instant,
    next_review: Instant,
    /// When to send it our configuration, unless it has subscribed by then.
    pub(super) greet: Option<Instant>,
    /// When work is due.
    pub(super) next: Instant,
}

impl Peer {
    pub(super) fn new(now: Instant, communicator: RaId, settings: &Settings) -> Self {
        let mut peer = Self {
            subsystem: RaSubsystemEntry {
                id: communicator.subsystem,
                ..RaSubsystemEntry::default()
            },
            communicator,
            heard: now,
            configured: false,
            subscribed: false,
            changed: false,
            shrunk: false,
            questions: BTreeMap::new(),
            next_refresh: now + settings.refresh,
            next_review: now + settings.review,
            greet: Some(now + settings.silence),
            next: now,
        };
        peer.wonder(now, Question::Subsystem);
        peer
    }

    /// The node manager beside the communicator.
    pub(super) fn manager(&self) -> RaId {
        RaId {
            component: RaId::NODE_MANAGER,
            instance: 1,
            ..self.communicator
        }
    }

    /// Opens a query, unless it is open already.
    pub(super) fn wonder(&mut self, now: Instant, question: Question) {
        let attempts = Attempts { made: 0, next: now };
        self.questions.entry(question).or_insert(attempts);
        self.next = self.next.min(now);
    }

    /// Closes a query; closing the first one opens the next ones.
    pub(super) fn settle(&mut self, now: Instant, question: Question) {
        let was_open = self.questions.remove(&question).is_some();
        if was_open && question == Question::Subsystem && !self.configured {
            self.wonder(now, Question::Configuration);
            self.wonder(now, Question::Subscription);
        }
    }

    /// The next due query, which counts as sent now. A query without answers after the last attempt
    /// is closed until the next refresh.
    pub(super) fn poll_question(&mut self, now: Instant, settings: &Settings) -> Option<Question> {
        loop {
            let due = self.questions.iter_mut();
            let (&question, attempts) = due.into_iter().find(|(_, a)| a.next <= now)?;
            if attempts.made < settings.tries {
                attempts.made += 1;
                attempts.next = now + settings.patience;
                return Some(question);
            }
            self.settle(now, question);
        }
    }

    /// Postpones a due query that could not be sent.
    pub(super) fn postpone(&mut self, question: Question, until: Instant) {
        if let Some(attempts) = self.questions.get_mut(&question) {
            attempts.made -= 1;
            attempts.next = until;
        }
    }

    /// Reopens queries for state that may have changed unnoticed.
    pub(super) fn refresh(&mut self, now: Instant, settings: &Settings) {
        if self.next_refresh <= now {
            self.next_refresh = now + settings.refresh;
            if self.subsystem.name.is_empty() {
                self.wonder(now, Question::Subsystem);
            }
            self.wonder(now, Question::Configuration);
            if !self.subscribed {
                self.wonder(now, Question::Subscription);
            }
            self.wonder_about_parts(now, false);
        }
        if self.next_review <= now {
            self.next_review = now + settings.review;
            self.wonder_about_parts(now, true);
        }
    }

    /// Opens queries for names and services: all, or only the unknown ones.
    fn wonder_about_parts(&mut self, now: Instant, all: bool) {
        let nodes = self.subsystem.nodes.iter();
        let nodes = nodes.filter(|node| all || node.name.is_empty());
        let nodes = nodes.map(|node| Question::Node(node.id));
        let components = self.subsystem.components();
        let components = components.flat_map(|(id, component)| {
            let name = all || component.name.is_empty();
            let services = all || component.services.is_empty();
            let name = name.then_some(Question::Name(id));
            name.into_iter()
                .chain(services.then_some(Question::Services(id)))
        });
        let questions: Vec<_> = nodes.chain(components).collect();
        for question in questions {
            self.wonder(now, question);
        }
    }

    /// Sets when work is due next. Queries wait while no local component `asks`.
    pub(super) fn schedule(&mut self, silence: Duration, asks: bool) {
        let questions = self.questions.values().map(|attempts| attempts.next);
        let question = questions.min().filter(|_| asks);
        let times = [
            Some(self.next_refresh),
            Some(self.next_review),
            question,
            self.greet,
        ];
        let times = times.into_iter().flatten();
        self.next = times.fold(self.heard + silence, Instant::min);
    }

    /// Whether it is complete: every query is answered or given up.
    pub(super) fn is_settled(&self) -> bool {
        self.configured && !self.questions.keys().any(|question| question.is_detail())
    }

    /// Whether the owner must be notified; clears the notification.
    pub(super) fn take_news(&mut self) -> bool {
        let news = self.configured && (self.shrunk || (self.changed && self.is_settled()));
        if news {
            self.changed &= !self.is_settled();
            self.shrunk = false;
        }
        news
    }

    /// Stores the subsystem's name.
    pub(super) fn name_subsystem(&mut self, name: String) {
        self.changed |= replace(&mut self.subsystem.name, name);
    }

    /// Stores the name of a node.
    pub(super) fn name_node(&mut self, id: u8, name: String) {
        let nodes = &mut self.subsystem.nodes;
        if let Some(node) = nodes.iter_mut().find(|node| node.id == id) {
            self.changed |= replace(&mut node.name, name);
        }
    }

    /// Stores the name of a component.
    pub(super) fn name_component(&mut self, id: RaId, name: String) {
        if let Some(component) = component(&mut self.subsystem, id) {
            self.changed |= replace(&mut component.name, name);
        }
    }

    /// Stores the services of a component.
    pub(super) fn set_services(&mut self, id: RaId, services: Vec<RaServiceEntry>) {
        if let Some(component) = component(&mut self.subsystem, id) {
            self.changed |= replace(&mut component.services, services);
        }
    }

    /// Number of messages in the services of all other components.
    pub(super) fn commands_but_of(&self, id: RaId) -> usize {
        let others = self
            .subsystem
            .components()
            .filter(|&(other, _)| other != id);
        others
            .map(|(_, component)| commands(&component.services))
            .sum()
    }

    /// Replaces nodes and components; queries names and services of new ones.
    pub(super) fn configure(&mut self, now: Instant, nodes: Vec<RaNodeEntry>) {
        self.changed |= !self.configured;
        self.configured = true;
        let mut old = std::mem::take(&mut self.subsystem);
        self.subsystem = RaSubsystemEntry {
            id: old.id,
            name: std::mem::take(&mut old.name),
            nodes,
        };
        let mut questions = Vec::new();
        for node in &mut self.subsystem.nodes {
            match old.nodes.iter_mut().find(|known| known.id == node.id) {
                Some(known) => node.name = std::mem::take(&mut known.name),
                None => questions.push(Question::Node(node.id)),
            }
            for new in &mut node.components {
                let id = RaId::new(old.id, node.id, new.component, new.instance);
                match component(&mut old, id) {
                    Some(known) => *new = std::mem::take(known),
                    None => questions.extend([Question::Name(id), Question::Services(id)]),
                }
            }
        }
        // Moving known components leaves entries without number behind.
        let kept = |node: &RaNodeEntry| self.subsystem.nodes.iter().any(|new| new.id == node.id);
        self.shrunk |= !old.nodes.iter().all(kept);
        self.shrunk |= old.components().any(|(id, _)| id.component != 0);
        self.changed |= self.shrunk || !questions.is_empty();
        for question in questions {
            self.wonder(now, question);
        }
        let subsystem = &self.subsystem;
        self.questions.retain(|question, _| match *question {
            Question::Node(node) => subsystem.nodes.iter().any(|known| known.id == node),
            Question::Name(id) | Question::Services(id) => {
                subsystem.components().any(|(known, _)| known == id)
            }
            _ => true,
        });
    }
}

/// Number of messages that services list.
pub(super) fn commands(services: &[RaServiceEntry]) -> usize {
    let in_one = |service: &RaServiceEntry| 1 + service.inputs.len() + service.outputs.len();
    services.iter().map(in_one).sum()
}

fn component(subsystem: &mut RaSubsystemEntry, id: RaId) -> Option<&mut RaComponentEntry> {
    let node = subsystem.nodes.iter_mut().find(|node| node.id == id.node)?;
    let mut components = node.components.iter_mut();
    components.find(|known| (known.component, known.instance) == (id.component, id.instance))
}

/// Replaces a value and returns whether it changed.
fn replace<T: PartialEq>(old: &mut T, new: T) -> bool {
    let other = *old != new;
    *old = new;
    other
}
