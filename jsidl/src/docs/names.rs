//! Names of pages and anchors.

use std::collections::{BTreeMap, BTreeSet};

use crate::model::{Id, Message, Service};

/// The pages of services, by identity.
pub(crate) struct Names(BTreeMap<Id, String>);

impl Names {
    /// Assigns a page to every service, with a name that is unique even without letter case:
    /// `core.Discovery.1.1`.
    pub(crate) fn new<'a>(services: impl Iterator<Item = &'a Service>) -> Self {
        let mut taken = BTreeSet::from(["index".to_owned()]);
        let mut names = BTreeMap::new();
        for service in services {
            let wanted = wanted(&service.id);
            let mut name = wanted.clone();
            let mut number = 1;
            while !taken.insert(name.to_lowercase()) {
                number += 1;
                name = format!("{wanted}.{number}");
            }
            names.insert(service.id.clone(), name);
        }
        Self(names)
    }

    /// The page of a service, if it has one.
    pub(crate) fn page(&self, id: &Id) -> Option<&str> {
        self.0.get(id).map(String::as_str)
    }
}

fn wanted(id: &Id) -> String {
    let parts: Vec<_> = id.urn.split(':').collect();
    let last = &parts[parts.len().saturating_sub(2)..];
    let last: Vec<_> = last.iter().map(|part| plain(part)).collect();
    format!("{}.{}", last.join("."), id.version)
}

/// A name without special characters of file names and addresses.
fn plain(name: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || c == '-' {
            c
        } else {
            '_'
        }
    };
    name.chars().take(100).map(plain).collect()
}

/// The set that a service belongs to: its URN without the last part.
pub(super) fn set(id: &Id) -> &str {
    id.urn.rsplit_once(':').map_or("", |(set, _)| set)
}

/// The anchor of a message on its service's page.
pub(super) fn anchor(message: &Message) -> String {
    format!("{}-{:04X}", plain(&message.name), message.code)
}
