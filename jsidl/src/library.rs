//! A set of services that were loaded together, found by URN and version.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::model::{Id, Message, Service};

/// Services by identity. Everything in it is resolved and checked.
#[derive(Debug, Clone, Default)]
pub struct Library {
    services: BTreeMap<Id, Arc<Service>>,
}

impl Library {
    /// Adds a service; answers the one that had the same identity.
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

    /// A service and those it inherits from, the most derived first.
    pub fn lineage<'a>(&'a self, service: &'a Service) -> impl Iterator<Item = &'a Service> {
        std::iter::successors(Some(service), |s| {
            let base = s.inherits_from.as_ref()?;
            self.services.get(&base.id).map(AsRef::as_ref)
        })
    }

    /// Every declaration of a message code, with the service that declares it.
    pub fn by_code(&self, code: u16) -> impl Iterator<Item = (&Service, &Arc<Message>)> {
        self.services().flat_map(move |service| {
            service
                .messages()
                .filter(move |m| m.code == code)
                .map(|m| (service.as_ref(), m))
        })
    }
}
