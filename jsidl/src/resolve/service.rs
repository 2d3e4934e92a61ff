//! Resolves services: their vocabulary and the services that they reference.

use std::collections::HashSet;
use std::sync::Arc;

use super::{LONGEST_LINEAGE, Resolved, Resolver};
use crate::check;
use crate::library::Library;
use crate::model::{Id, Message, Reference, Service, Version};
use crate::source::Span;
use crate::syntax::{
    Content, Declaration, DeclarationKind, Program, ServiceDef, ServiceRef, Target, TypeSetIndex,
};

/// Maximum number of states of all services, inherited ones counted again: a long lineage must not
/// multiply a large machine. All published definitions together have 20 000.
const MOST_STATES: usize = 500_000;

/// Messages of a set, each with its position in the service.
type Vocabulary = Vec<(Arc<Message>, Span)>;

impl Resolver<'_> {
    /// Resolves all services and keeps the sound ones.
    pub(super) fn library(&mut self) -> Library {
        let mut library = Library::default();
        let mut kept = Vec::new();
        for definition in &self.program.services {
            let (service, places) = self.service(definition);
            if !definition.sound || !self.lineage_is_sound(definition) {
                continue;
            }
            if let Some(first) = library.service(&service.id) {
                check::same_service(self.report, definition, first, &service);
            } else {
                let service = Arc::new(service);
                library.insert(Arc::clone(&service));
                kept.push((service, places));
            }
        }
        for (service, places) in &kept {
            check::ambiguous_codes(self.report, &library, service, places);
            check::ambiguous_names(self.report, service, places);
            check::declared_again(self.report, &library, service, places);
        }
        let events = internal_events(self.program);
        let mut states_left = MOST_STATES;
        for (service, _) in &kept {
            check::behaviour(self.report, &library, service, &events, &mut states_left);
        }
        library
    }

    /// A service with the positions of its messages.
    fn service(&mut self, definition: &ServiceDef) -> (Service, Vec<Span>) {
        let scope = definition.types;
        let inputs = self.vocabulary(scope, definition, &definition.inputs);
        let outputs = self.vocabulary(scope, definition, &definition.outputs);
        self.events(scope, &definition.events);
        self.clients(definition);
        let (inputs, input_places): (Vec<_>, Vec<_>) = inputs.into_iter().unzip();
        let (outputs, output_places): (Vec<_>, Vec<_>) = outputs.into_iter().unzip();
        let clients = definition.client_of.iter();
        let service = Service {
            name: definition.name.clone(),
            id: definition.id.clone(),
            description: definition.description.clone(),
            inherits_from: definition.inherits_from.as_ref().map(|r| self.reference(r)),
            client_of: clients.map(|r| self.reference(r)).collect(),
            inputs,
            outputs,
            behaviour: definition.behaviour.clone(),
            location: self.location(definition.span),
        };
        (service, [input_places, output_places].concat())
    }

    fn reference(&self, reference: &ServiceRef) -> Reference {
        Reference {
            name: reference.name.clone(),
            id: self.meant(reference),
            location: self.location(reference.span),
        }
    }

    /// The identity that a reference means. One that is not loaded has 0 in place of a wildcard.
    fn meant(&self, reference: &ServiceRef) -> Id {
        let services = &self.index.services;
        services.newest(reference).unwrap_or_else(|| Id {
            urn: reference.urn.clone(),
            version: Version {
                major: reference.version.major.unwrap_or(0),
                minor: reference.version.minor.unwrap_or(0),
            },
        })
    }

    fn is_lost(&self, reference: &ServiceRef) -> bool {
        self.lost.iter().any(|id| reference.admits(id))
    }

    /// The sound messages of an input or output set.
    fn vocabulary(
        &mut self,
        scope: TypeSetIndex,
        service: &ServiceDef,
        declarations: &[Declaration],
    ) -> Vocabulary {
        let names = declarations.iter().map(|d| (d.name.as_str(), d.span));
        self.report.unique("messages", names);
        let mut names = HashSet::new();
        let mut messages = Vec::new();
        for declaration in declarations {
            let message = match &declaration.kind {
                DeclarationKind::Message(message) => self.message(scope, declaration, message),
                DeclarationKind::Reference(target) => {
                    self.message_elsewhere(scope, service, declaration, target)
                }
                _ => None,
            };
            // The first of two messages with one name counts.
            let message = message.filter(|_| declaration.sound && names.insert(&declaration.name));
            messages.extend(message.map(|message| (message, declaration.span)));
        }
        messages
    }

    /// A message that a type set declares.
    fn message_elsewhere(
        &mut self,
        scope: TypeSetIndex,
        service: &ServiceDef,
        declaration: &Declaration,
        target: &Target,
    ) -> Option<Arc<Message>> {
        let before = self.report.errors();
        match self.follow(scope, target) {
            Some(Resolved::Message(message)) => self.renamed(message, declaration),
            // The cause is reported at its own position, which may be far away.
            None if self.report.errors() == before => {
                check::left_out(self.report, service, declaration);
                None
            }
            _ => None,
        }
    }

    fn events(&mut self, scope: TypeSetIndex, declarations: &[Declaration]) {
        self.report.unique(
            "events",
            declarations.iter().map(|d| (d.name.as_str(), d.span)),
        );
        for declaration in declarations {
            // Events do not leave the component: their mistakes are only reported.
            match &declaration.kind {
                DeclarationKind::Event(event) => drop(self.event(scope, event)),
                DeclarationKind::Reference(target) => drop(self.follow(scope, target)),
                _ => {}
            }
        }
    }

    fn clients(&mut self, definition: &ServiceDef) {
        let references = definition.client_of.iter().chain(&definition.inherits_from);
        let names = references.map(|r| (r.name.as_str(), r.span));
        self.report.unique("references", names);
        for client in &definition.client_of {
            if self.is_lost(client) || self.index.services.service(client).is_some() {
                continue;
            }
            let advice = self.index.services.advice(&client.urn);
            let message =
                format!("this service is a client of `{client}`, which is not loaded: {advice}");
            self.report.warning(client.span, message);
        }
    }

    /// Whether every base of this service exists.
    fn lineage_is_sound(&mut self, heir: &ServiceDef) -> bool {
        let program = self.program;
        let Some(own) = &heir.inherits_from else {
            return true;
        };
        let mut service = heir;
        for _ in 0..=LONGEST_LINEAGE {
            let Some(base) = &service.inherits_from else {
                return true;
            };
            if base.admits(&heir.id) {
                let message = format!("`{}` inherits from itself: break the cycle", heir.id);
                self.report.error(own.span, message);
                return false;
            }
            let Some(position) = self.index.services.service(base) else {
                self.missing_base(heir, own, service, base);
                return false;
            };
            service = &program.services[position];
        }
        self.report.error(
            own.span,
            format!(
                "`{}` is omitted: it inherits from more than {LONGEST_LINEAGE} services, or from \
                 a cycle of them",
                heir.id
            ),
        );
        false
    }

    /// Each service that is left out is reported at its own `inherits_from`.
    fn missing_base(
        &mut self,
        heir: &ServiceDef,
        own: &ServiceRef,
        service: &ServiceDef,
        base: &ServiceRef,
    ) {
        let message = if self.is_lost(base) {
            format!(
                "`{}` is omitted: it inherits from `{base}`, which has errors",
                heir.id
            )
        } else if heir.id == service.id {
            let advice = self.index.services.advice(&base.urn);
            format!("the base service `{base}` is not loaded: {advice}")
        } else {
            format!(
                "`{}` is omitted: it inherits from `{}`, which needs `{base}`, which is not loaded",
                heir.id, service.id
            )
        };
        self.report.error(own.span, message);
    }
}

/// The events that each service declares; the first of two services with one identity counts.
fn internal_events(program: &Program) -> check::Events<'_> {
    let mut events = check::Events::new();
    for service in program.services.iter().filter(|s| s.sound) {
        let declared = service.events.iter().map(|event| check::InternalEvent {
            name: &event.name,
            members: members(event),
        });
        events
            .entry(&service.id)
            .or_insert_with(|| declared.collect());
    }
    events
}

/// The names of an event's sections and of their content; none if a part is declared elsewhere.
fn members(event: &Declaration) -> Vec<&str> {
    let DeclarationKind::Event(definition) = &event.kind else {
        return Vec::new();
    };
    let mut names = vec!["header", "body", "footer"];
    for section in &definition.sections {
        names.push(&section.name);
        match &section.content {
            Content::Node(node) => node.names(&mut names),
            Content::Empty => {}
            Content::Reference(_) | Content::Faulty => return Vec::new(),
        }
    }
    names
}
