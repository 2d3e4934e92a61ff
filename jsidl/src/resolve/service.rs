//! Resolves services: their vocabulary and the services that they refer to.

use std::collections::HashSet;
use std::sync::Arc;

use super::{Resolved, Resolver};
use crate::check;
use crate::library::Library;
use crate::model::{Message, Reference, Service};
use crate::syntax::{Declaration, DeclarationKind, ServiceDef, SetRef, TypeSetIndex};

impl Resolver<'_> {
    /// Resolves all services and keeps the sound ones.
    pub(super) fn library(&mut self) -> Library {
        let mut library = Library::default();
        for (position, definition) in self.program.services.iter().enumerate() {
            let service = self.service(definition);
            if !self.lineage_is_sound(position) {
                continue;
            }
            if let Some(kept) = library.service(&service.id) {
                check::same_service(self.report, definition, kept, &service);
            } else {
                library.insert(Arc::new(service));
            }
        }
        check::ambiguities(self.report, self.program, &library);
        library
    }

    fn service(&mut self, definition: &ServiceDef) -> Service {
        let scope = definition.types;
        let mut lost = Vec::new();
        let inputs = self.vocabulary(scope, &definition.inputs, &mut lost);
        let outputs = self.vocabulary(scope, &definition.outputs, &mut lost);
        self.events(scope, &definition.events);
        check::incomplete(self.report, definition, &lost);
        self.clients(definition);
        Service {
            name: definition.name.clone(),
            id: definition.id.clone(),
            description: definition.description.clone(),
            inherits_from: definition.inherits_from.as_ref().map(|r| self.reference(r)),
            client_of: definition
                .client_of
                .iter()
                .map(|r| self.reference(r))
                .collect(),
            inputs,
            outputs,
            location: self.location(definition.span),
        }
    }

    fn reference(&self, reference: &SetRef) -> Reference {
        Reference {
            name: reference.name.clone(),
            id: reference.id.clone(),
            location: self.location(reference.span),
        }
    }

    /// The messages of an input or output set; the names of those that had to be left out because
    /// something they refer to is wrong go to `lost`.
    fn vocabulary(
        &mut self,
        scope: TypeSetIndex,
        declarations: &[Declaration],
        lost: &mut Vec<String>,
    ) -> Vec<Arc<Message>> {
        check::unique(
            self.report,
            "message",
            declarations.iter().map(|d| (d.name.as_str(), d.span)),
        );
        let mut names = HashSet::new();
        let mut messages = Vec::new();
        for declaration in declarations {
            let message = match &declaration.kind {
                DeclarationKind::Message(message) => self.message(scope, declaration, message),
                DeclarationKind::Reference(target) => match self.follow(scope, target) {
                    Some(Resolved::Message(message)) => self.renamed(message, declaration),
                    _ => None,
                },
                _ => None,
            };
            match message {
                Some(message) if names.insert(&declaration.name) => messages.push(message),
                Some(_) => {}
                None => lost.push(declaration.name.clone()),
            }
        }
        messages
    }

    fn events(&mut self, scope: TypeSetIndex, declarations: &[Declaration]) {
        check::unique(
            self.report,
            "event",
            declarations.iter().map(|d| (d.name.as_str(), d.span)),
        );
        for declaration in declarations {
            // Events do not leave the component: what is wrong with them is reported, no more.
            match &declaration.kind {
                DeclarationKind::Event(event) => drop(self.event(scope, event)),
                DeclarationKind::Reference(target) => drop(self.follow(scope, target)),
                _ => {}
            }
        }
    }

    fn clients(&mut self, definition: &ServiceDef) {
        check::unique(
            self.report,
            "reference",
            definition
                .client_of
                .iter()
                .chain(&definition.inherits_from)
                .map(|r| (r.name.as_str(), r.span)),
        );
        for client in &definition.client_of {
            let lost = self.program.lost_services.contains(&client.id);
            if !lost && self.index.service(&client.id).is_none() {
                self.report.warning(
                    client.span,
                    format!(
                        "the service `{}`, of which this one is a client, is not loaded",
                        client.id
                    ),
                );
            }
        }
    }

    /// Whether every service that this one inherits from is there.
    fn lineage_is_sound(&mut self, position: usize) -> bool {
        let first = &self.program.services[position];
        let mut visited = HashSet::from([&first.id]);
        let mut service = first;
        while let Some(base) = &service.inherits_from {
            let Some(index) = self.index.service(&base.id) else {
                self.missing_base(first, service, base);
                return false;
            };
            if !visited.insert(&base.id) {
                self.report.error(
                    base.span,
                    format!("`{}` inherits from itself: break the circle", service.id),
                );
                return false;
            }
            service = &self.program.services[index];
        }
        true
    }

    /// Each service that is left out says why, at its own `inherits_from`.
    fn missing_base(&mut self, heir: &ServiceDef, service: &ServiceDef, base: &SetRef) {
        let own = heir.inherits_from.as_ref().map_or(heir.span, |r| r.span);
        let message = if self.program.lost_services.contains(&base.id) {
            format!(
                "`{}` is left out: it inherits from `{}`, which has errors",
                heir.id, base.id
            )
        } else if heir.id == service.id {
            let versions = self.index.versions_of_service(&base.id.urn);
            let advice = match versions.as_slice() {
                [] => "load the file that declares it as well".to_owned(),
                some => format!("of that service only version {} is loaded", some.join(", ")),
            };
            format!(
                "the service `{}` to inherit from is not loaded: {advice}",
                base.id
            )
        } else {
            format!(
                "`{}` is left out: it inherits from `{}`, which needs `{}`, which is not loaded",
                heir.id, service.id, base.id
            )
        };
        self.report.error(own, message);
    }
}
