//! Possible triggers of a service's transitions: events and messages of the service, its bases and
//! the services that it is a client of, and all triggers of its bases.
//!
//! If neither the service nor its bases declare events, any event is permitted.

use std::collections::{HashMap, HashSet};

use crate::behaviour::Name;
use crate::library::Library;
use crate::model::{Id, Service};

/// Internal events of services, by name.
pub(crate) type Events<'a> = HashMap<&'a Id, Vec<&'a str>>;

/// Names of events and messages, in lower case, because published definitions differ in it.
pub(super) struct Triggers<'a> {
    /// From the service itself to its outermost base, each with its alias and the names known from
    /// there.
    lineage: Vec<(&'a str, HashSet<String>)>,
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
        Self { lineage, open }
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
    let own = events.get(&service.id).into_iter().flatten().copied();
    let messages = service.messages().map(|message| message.name.as_str());
    own.chain(messages).map(str::to_ascii_lowercase).collect()
}

fn used(service: &Service) -> impl Iterator<Item = String> {
    let machines = service.behaviour.iter();
    let states = machines.flat_map(|machine| machine.all_states());
    let transitions = states.flat_map(|s| s.transitions.iter().chain(&s.default_transitions));
    transitions.map(|transition| transition.trigger.event.last().to_ascii_lowercase())
}
