//! Set of services that were loaded together, indexed by URN and version.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::model::{Id, Message, Service, Version};

/// Services by identity, all resolved and checked.
#[derive(Debug, Clone, Default)]
pub struct Library {
    services: BTreeMap<Id, Arc<Service>>,
}

impl Library {
    /// Adds a service; returns the previous service with the same identity.
    pub fn insert(&mut self, service: Arc<Service>) -> Option<Arc<Service>> {
        self.services.insert(service.id.clone(), service)
    }

    /// The service with exactly this identity.
    pub fn service(&self, id: &Id) -> Option<&Arc<Service>> {
        self.services.get(id)
    }

    /// All services, ordered by URN, then version.
    pub fn services(&self) -> impl Iterator<Item = &Arc<Service>> + Clone {
        self.services.values()
    }

    /// All versions of a service, the oldest first.
    pub fn versions(&self, urn: &str) -> impl Iterator<Item = &Arc<Service>> {
        let first = Id {
            urn: urn.into(),
            version: Version { major: 0, minor: 0 },
        };
        let from_there = self.services.range(first..).map(|(_, service)| service);
        from_there.take_while(move |service| &*service.id.urn == urn)
    }

    /// A service and those it inherits from, the most derived first.
    pub fn lineage<'a>(&'a self, service: &'a Service) -> impl Iterator<Item = &'a Service> {
        let chain = std::iter::successors(Some(service), |s| {
            let base = s.inherits_from.as_ref()?;
            self.services.get(&base.id).map(AsRef::as_ref)
        });
        // The loader rejects inheritance cycles, `insert` does not check.
        chain.take(self.services.len() + 1)
    }

    /// All messages of a service, each with the service that declares it: its own messages, then
    /// the inherited ones. A message in both sets of a service comes twice.
    pub fn vocabulary<'a>(
        &'a self,
        service: &'a Service,
    ) -> impl Iterator<Item = (&'a Service, &'a Arc<Message>)> {
        self.lineage(service)
            .flat_map(|declaring| declaring.messages().map(move |m| (declaring, m)))
    }

    /// Every declaration of a message code, with the declaring service.
    pub fn by_code(&self, code: u16) -> impl Iterator<Item = (&Service, &Arc<Message>)> {
        self.services().flat_map(move |service| {
            service
                .messages()
                .filter(move |m| m.code == code)
                .map(|m| (service.as_ref(), m))
        })
    }
}
