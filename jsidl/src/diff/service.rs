//! Compares two services message by message, and their state machines.

use std::sync::Arc;

use super::{Change, Walk};
use crate::model::{Item, Message, Reference, Service};

/// A message and whether the service receives or sends it.
type Vocabulary<'s> = Vec<(&'static str, &'s Arc<Message>)>;

pub(super) fn compare(old: &Service, new: &Service, changes: &mut Vec<Change>) {
    let mut walk = Walk {
        changes,
        service: new.id.clone(),
        path: Vec::new(),
        places: vec![super::Places {
            old: Some(old.location.clone()),
            new: Some(new.location.clone()),
        }],
    };
    walk.value(false, "the name", &old.name, &new.name);
    walk.value(false, "the version", &old.id.version, &new.id.version);
    walk.base(old.inherits_from.as_ref(), new.inherits_from.as_ref());
    walk.vocabulary(&vocabulary(old), &vocabulary(new));
    walk.machines(&old.behaviour, &new.behaviour);
}

fn vocabulary(service: &Service) -> Vocabulary<'_> {
    let inputs = service.inputs.iter().map(|message| ("receives", message));
    let outputs = service.outputs.iter().map(|message| ("sends", message));
    inputs.chain(outputs).collect()
}

fn named(message: &Message) -> String {
    format!("{} {:04X}", message.name, message.code)
}

impl Walk<'_> {
    fn base(&mut self, old: Option<&Reference>, new: Option<&Reference>) {
        let id = |reference: Option<&Reference>| {
            reference.map_or_else(|| "nothing".to_owned(), |r| format!("`{}`", r.id))
        };
        let urn = |reference: Option<&Reference>| reference.map(|r| r.id.urn.clone());
        let wire = old.is_some() && urn(old) != urn(new);
        self.value(wire, "the base service", &id(old), &id(new));
    }

    fn vocabulary(&mut self, old: &Vocabulary<'_>, new: &Vocabulary<'_>) {
        let mut gone = Vec::new();
        let mut left: Vec<_> = new.iter().collect();
        for (direction, message) in old {
            // Match by name and direction, then by code, then by name alone.
            let name = |other: &Message| other.name == message.name;
            let code = |other: &Message| other.code == message.code;
            let position = left
                .iter()
                .position(|(d, m)| d == direction && name(m))
                .or_else(|| left.iter().position(|(d, m)| d == direction && code(m)))
                .or_else(|| left.iter().position(|(_, m)| name(m)));
            match position {
                Some(position) => {
                    let (now, other) = left.remove(position);
                    let places = (Some(&message.location), Some(&other.location));
                    self.inside(named(other), places.0, places.1, |walk| {
                        if now != direction {
                            let message =
                                format!("the service now {now} it, and no longer {direction} it");
                            walk.report(true, message);
                        }
                        walk.message(message, other);
                    });
                }
                None => gone.push((direction, message)),
            }
        }
        for (direction, message) in gone {
            self.inside(named(message), Some(&message.location), None, |walk| {
                walk.report(
                    true,
                    format!("the message was removed: the service no longer {direction} it"),
                );
            });
        }
        for (direction, message) in left {
            self.inside(named(message), None, Some(&message.location), |walk| {
                walk.report(
                    false,
                    format!("the message was added: the service {direction} it"),
                );
            });
        }
    }

    fn message(&mut self, old: &Message, new: &Message) {
        self.value(false, "the name", &old.name, &new.name);
        if old.code != new.code {
            let message = format!("the code is {:04X}, was {:04X}", new.code, old.code);
            self.report(true, message);
        }
        if old.is_command != new.is_command {
            let message = if new.is_command {
                "it is now a command: only the controlling client may send it"
            } else {
                "it is no longer a command: any client may send it"
            };
            self.report(false, message);
        }
        self.section("the header", old.header.as_ref(), new.header.as_ref());
        self.section("the body", old.body.as_ref(), new.body.as_ref());
        self.section("the footer", old.footer.as_ref(), new.footer.as_ref());
    }

    fn section(&mut self, what: &str, old: Option<&Item>, new: Option<&Item>) {
        match (old, new) {
            (Some(old), Some(new)) => self.item(old, new),
            (Some(old), None) => {
                self.report(true, format!("{what} is empty, was `{}`", old.name));
            }
            (None, Some(new)) => {
                self.report(true, format!("{what} is `{}`, was empty", new.name));
            }
            (None, None) => {}
        }
    }
}
