//! Possible triggers of a service's transitions: events and messages of the service, its bases and
//! the services that it is a client of, and all triggers of its bases.
//!
//! If neither the service nor its bases declare events, any event is permitted.

use std::collections::{HashMap, HashSet};

use crate::behaviour::{Name, StateMachine};
use crate::library::Library;
use crate::model::{Id, Item, Message, Service};

/// Internal events of services.
pub(crate) type Events<'a> = HashMap<&'a Id, Vec<InternalEvent<'a>>>;

/// An internal event.
pub(crate) struct InternalEvent<'a> {
    pub(crate) name: &'a str,
    /// The names of its sections and of everything in them; empty if they are declared elsewhere.
    pub(crate) members: Vec<&'a str>,
}

/// Names of events and messages, in lower case, because published definitions differ in it.
pub(super) struct Triggers<'a> {
    /// From the service itself to its outermost base, each with its alias and the names known from
    /// there.
    lineage: Vec<(&'a str, HashSet<String>)>,
    /// The services of the lineage, and those that they are clients of with their lineages.
    services: Vec<&'a Service>,
    events: &'a Events<'a>,
    /// Whether unknown names are permitted.
    open: bool,
}

impl<'a> Triggers<'a> {
    pub(super) fn of(library: &'a Library, service: &'a Service, events: &'a Events<'a>) -> Self {
        let chain: Vec<_> = library.lineage(service).collect();
        // A base may use an event of a base of its own that declares none, as the core services do
        // with `Receive`.
        let mut names: HashSet<_> = chain.iter().skip(1).flat_map(|it| used(it)).collect();
        let mut lineage = Vec::new();
        for (position, declaring) in chain.iter().enumerate().rev() {
            names.extend(declared(declaring, events));
            let heir = position.checked_sub(1).map(|heir| chain[heir]);
            let alias = heir.and_then(|heir| heir.inherits_from.as_ref());
            lineage.push((alias.map_or("", |r| r.name.as_str()), names.clone()));
        }
        lineage.reverse();
        let silent = |service: &&Service| events.get(&service.id).is_none_or(Vec::is_empty);
        let mut open = chain.iter().all(silent);
        let mut services = chain.clone();
        for client in chain.iter().flat_map(|service| &service.client_of) {
            match library.service(&client.id) {
                Some(server) => {
                    for server in library.lineage(server) {
                        lineage[0].1.extend(declared(server, events));
                        services.push(server);
                    }
                }
                None => open = true,
            }
        }
        Self {
            lineage,
            services,
            events,
            open,
        }
    }

    /// Whether a type of a parameter exists: a message or event, or the path of something in it.
    pub(super) fn have(&self, path: &str) -> bool {
        let Some(path) = Name::parse(path) else {
            return self.open;
        };
        // The name may follow aliases, and the path of a member may follow the name. The aliases of
        // published definitions do not say reliably whose it is.
        let parts = path.parts();
        let mut names = parts.iter().enumerate();
        self.know(&path) || names.any(|(position, name)| self.holds(name, &parts[position + 1..]))
    }

    /// Whether an event or message with this name has members with all these names.
    fn holds(&self, name: &str, inner: &[String]) -> bool {
        let is_named = |other: &str| other.eq_ignore_ascii_case(name);
        let in_event = |event: &InternalEvent<'_>| {
            let has = |it: &String| event.members.iter().any(|m| m.eq_ignore_ascii_case(it));
            is_named(event.name) && (event.members.is_empty() || inner.iter().all(has))
        };
        let in_message = |message: &Message| {
            is_named(&message.name) && inner.iter().all(|it| has_member(message, it))
        };
        self.services.iter().any(|service| {
            let mut events = self.events.get(&service.id).into_iter().flatten();
            let mut messages = service.messages();
            events.any(in_event) || messages.any(|message| in_message(message))
        })
    }

    /// Whether an event or message exists. An alias before the name selects its service; an unknown
    /// alias is ignored.
    pub(super) fn know(&self, event: &Name) -> bool {
        let aliases = &event.parts()[..event.parts().len() - 1];
        let below = self.lineage.iter().skip(1);
        let followed = aliases.iter().zip(below);
        let steps = followed
            .take_while(|(alias, (name, _))| alias.eq_ignore_ascii_case(name))
            .count();
        let step = if steps == aliases.len() { steps } else { 0 };
        let name = event.last().to_ascii_lowercase();
        let known = self.lineage.get(step);
        self.open || known.is_some_and(|(_, names)| names.contains(&name))
    }
}

fn declared(service: &Service, events: &Events<'_>) -> Vec<String> {
    let own = events.get(&service.id).into_iter().flatten();
    let own = own.map(|event| event.name);
    let messages = service.messages().map(|message| message.name.as_str());
    own.chain(messages).map(str::to_ascii_lowercase).collect()
}

fn used(service: &Service) -> impl Iterator<Item = String> {
    let machines = service.behaviour.iter();
    let transitions = machines.flat_map(StateMachine::transitions);
    let names = transitions.filter_map(|transition| transition.trigger.name());
    names.map(str::to_ascii_lowercase)
}

/// Whether a message has a section or an item with this name.
fn has_member(message: &Message, name: &str) -> bool {
    fn is_within(item: &Item, name: &str) -> bool {
        item.name.eq_ignore_ascii_case(name) || item.shape.items().any(|it| is_within(it, name))
    }
    let sections = [&message.header, &message.body, &message.footer];
    let named = ["header", "body", "footer"];
    named
        .iter()
        .any(|section| section.eq_ignore_ascii_case(name))
        || sections
            .into_iter()
            .flatten()
            .any(|item| is_within(item, name))
}
