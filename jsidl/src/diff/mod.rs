//! Compares two sets of definitions, and determines which changes affect the wire.
//!
//! A change affects the wire if two parties built from different sides would misinterpret a message
//! or miss one that was known. New messages and services do not, nor does a change of behaviour.
//! Descriptions are not compared.

mod behaviour;
mod item;
mod service;
mod shape;

use std::fmt;

use crate::library::Library;
use crate::model::{Id, Location, Service};

/// One difference. Displayed as a sentence without its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// The service, as named on the new side, or on the old side if it was removed.
    pub service: Id,
    /// The message with its hexadecimal code, and the members down to the change, for example
    /// `["ReportLights D101", "LightsRec", "Brightness"]`; or the state machine, the states and the
    /// transition.
    pub path: Vec<String>,
    /// The difference, for example "the type is `unsigned byte`, was `byte`".
    pub message: String,
    /// Whether the wire is affected.
    pub wire: bool,
    /// Position on the old side; `None` if it is new.
    pub old: Option<Location>,
    /// Position on the new side; `None` if it was removed.
    pub new: Option<Location>,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// Compares two libraries, for the services that `included` selects. A service is compared with the
/// one of the same identity, or else with another version.
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
    // Unpaired services on both sides may be versions of the same service.
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
            None => changes.push(whole(old, "the service was removed", true)),
        }
    }
    let added = added.into_iter();
    changes.extend(added.map(|service| whole(service, "the service was added", false)));
    changes
}

/// A change of a service on one side only. A removal affects the wire.
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

/// Collects the changes of one service, and tracks the current position.
struct Walk<'c> {
    changes: &'c mut Vec<Change>,
    service: Id,
    path: Vec<String>,
    places: Vec<Places>,
}

/// Positions of the current item on both sides.
#[derive(Clone)]
struct Places {
    old: Option<Location>,
    new: Option<Location>,
}

impl Walk<'_> {
    /// Compares the inside of an item.
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

    /// As [`inside`](Self::inside), for a part without a position.
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
