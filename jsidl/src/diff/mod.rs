//! What changed between two sets of definitions, and whether the octets of a message, or what they
//! mean, are affected.
//!
//! The wire is affected if two parties, one built from each side, would misunderstand each other or
//! miss a message that one of them knew. A new message or a new service affects nothing that was
//! there. Descriptions and state machines are not compared.

mod item;
mod service;
mod shape;

use std::fmt;

use crate::library::Library;
use crate::model::{Id, Location, Service};

/// One difference. Displayed as a sentence without its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// The service, as the new side calls it, or the old one if it is gone.
    pub service: Id,
    /// The message, its code in hexadecimal behind it, and the members that lead to the change,
    /// for example `["ReportLights D101", "LightsRec", "Brightness"]`.
    pub path: Vec<String>,
    /// What is different, for example "the type is `unsigned byte`, was `byte`".
    pub message: String,
    /// Whether the wire is affected.
    pub wire: bool,
    /// Where it stood; `None` if it is new.
    pub old: Option<Location>,
    /// Where it stands; `None` if it is gone.
    pub new: Option<Location>,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// Compares two libraries, as far as `included` says of their services. A service is compared with
/// the one of the same identity; if there is none on either side, with another version.
pub fn compare(old: &Library, new: &Library, included: impl Fn(&Service) -> bool) -> Vec<Change> {
    let services = |library: &Library| -> Vec<_> {
        let services = library.services().filter(|service| included(service));
        services.cloned().collect()
    };
    let (old, new) = (services(old), services(new));
    let mut changes = Vec::new();
    let mut pairs: Vec<_> = old.iter().map(|old| (old, None)).collect();
    let mut added = Vec::new();
    for service in &new {
        let same = pairs.iter_mut().find(|(old, _)| old.id == service.id);
        match same {
            Some((_, new)) => *new = Some(service),
            None => added.push(service),
        }
    }
    // What is left over on both sides may be another version of the same service.
    added.retain(|service| {
        let mut others = pairs.iter_mut();
        let other = others.find(|(old, new)| new.is_none() && old.id.urn == service.id.urn);
        let Some((_, new)) = other else {
            return true;
        };
        *new = Some(service);
        false
    });
    for (old, new) in pairs {
        match new {
            Some(new) => service::compare(old, new, &mut changes),
            None => changes.push(whole(old, "the service is gone", true)),
        }
    }
    let added = added.into_iter();
    changes.extend(added.map(|service| whole(service, "the service is new", false)));
    changes
}

/// A change that concerns a service which is on one side only. What is gone affects the wire.
fn whole(service: &Service, message: &str, gone: bool) -> Change {
    let location = Some(service.location.clone());
    let (old, new) = if gone {
        (location, None)
    } else {
        (None, location)
    };
    Change {
        service: service.id.clone(),
        path: Vec::new(),
        message: message.to_owned(),
        wire: gone && service.messages().next().is_some(),
        old,
        new,
    }
}

/// Collects the changes of one service; knows on the way down where it is.
struct Walk<'c> {
    changes: &'c mut Vec<Change>,
    service: Id,
    path: Vec<String>,
    places: Vec<Places>,
}

/// The places of the thing that is looked at, on both sides.
#[derive(Clone)]
struct Places {
    old: Option<Location>,
    new: Option<Location>,
}

impl Walk<'_> {
    /// Looks at what is inside something.
    fn inside(
        &mut self,
        name: String,
        old: Option<&Location>,
        new: Option<&Location>,
        look: impl FnOnce(&mut Self),
    ) {
        self.path.push(name);
        self.places.push(Places {
            old: old.cloned(),
            new: new.cloned(),
        });
        look(self);
        self.path.pop();
        self.places.pop();
    }

    /// As [`inside`](Self::inside), for what has no place of its own.
    fn part(&mut self, name: String, look: impl FnOnce(&mut Self)) {
        self.path.push(name);
        look(self);
        self.path.pop();
    }

    fn report(&mut self, wire: bool, message: impl Into<String>) {
        let places = self.places.last().cloned();
        let (old, new) = places.map_or((None, None), |places| (places.old, places.new));
        self.changes.push(Change {
            service: self.service.clone(),
            path: self.path.clone(),
            message: message.into(),
            wire,
            old,
            new,
        });
    }

    /// Reports two values that differ.
    fn value<T: PartialEq + fmt::Display>(&mut self, wire: bool, what: &str, old: &T, new: &T) {
        if old != new {
            self.report(wire, format!("{what} is {new}, was {old}"));
        }
    }
}
