//! Possible triggers of a service's transitions: events and messages of the service, its bases and
//! the services that it is a client of, and all triggers of its bases.
//!
//! If neither the service nor its bases declare events, any event is permitted.

use std::collections::{HashMap, HashSet};

use crate::behaviour::{Name, StateMachine};
use crate::library::Library;
use crate::model::{Id, Item, Service};

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
    /// By event or message: the names of what is in it. Without an entry they are not known.
    members: HashMap<String, HashSet<String>>,
    /// Whether unknown names are permitted.
    open: bool,
}

impl<'a> Triggers<'a> {
    pub(super) fn of(library: &'a Library, service: &'a Service, events: &Events<'_>) -> Self {
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
        for client in chain.iter().flat_map(|service| &service.client_of) {
            match library.service(&client.id) {
                Some(server) => {
                    let servers = library.lineage(server);
                    let known = servers.flat_map(|server| declared(server, events));
                    lineage[0].1.extend(known);
                }
                None => open = true,
            }
        }
        let members = members(library, &chain, events);
        Self {
            lineage,
            members,
            open,
        }
    }

    /// Whether a type of a parameter exists: a message or event, or the path of something in it.
    pub(super) fn have(&self, path: &str) -> bool {
        let Some(path) = Name::parse(path) else {
            return self.open;
        };
        let parts = path.parts();
        let whole = self.know(&path);
        // The name may follow aliases, and the path of a member may follow the name.
        let known = |(position, name): (usize, &String)| {
            let members = self.members.get(&name.to_ascii_lowercase());
            members.is_some_and(|members| {
                let inner = &parts[position + 1..];
                let has = |it: &String| members.contains(&it.to_ascii_lowercase());
                members.is_empty() || inner.iter().all(has)
            })
        };
        whole || parts.iter().enumerate().any(known)
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

/// What is in the events and messages of a lineage. The aliases of published definitions do not say
/// reliably whose they are, so the names of all are collected.
fn members(
    library: &Library,
    chain: &[&Service],
    events: &Events<'_>,
) -> HashMap<String, HashSet<String>> {
    let clients = chain.iter().flat_map(|service| &service.client_of);
    let servers = clients.filter_map(|client| library.service(&client.id));
    let servers = servers.flat_map(|server| library.lineage(server));
    let mut members: HashMap<String, HashSet<String>> = HashMap::new();
    for service in chain.iter().copied().chain(servers) {
        for event in events.get(&service.id).into_iter().flatten() {
            let inner = event.members.iter().map(|name| name.to_ascii_lowercase());
            let known = members.entry(event.name.to_ascii_lowercase());
            known.or_default().extend(inner);
        }
        for message in service.messages() {
            let known = members.entry(message.name.to_ascii_lowercase());
            let known = known.or_default();
            known.extend(["header", "body", "footer"].map(str::to_owned));
            let sections = [&message.header, &message.body, &message.footer];
            for item in sections.into_iter().flatten() {
                names(item, known);
            }
        }
    }
    members
}

fn names(item: &Item, known: &mut HashSet<String>) {
    known.insert(item.name.to_ascii_lowercase());
    for inner in item.shape.items() {
        names(inner, known);
    }
}
