//! The entries of the audit log about a secure link.

use jaus_audit::{Entry, Outcome};

use crate::transport::{Act, Record};

/// The entry of a record.
pub(super) fn entry(record: Record) -> Entry {
    let who = record.peer.as_deref().unwrap_or("unknown");
    let entry = match record.act {
        Act::Connected => Entry::new(who, "connect", Outcome::Allowed),
        Act::Disconnected { reason } => {
            Entry::new(who, "disconnect", Outcome::Allowed).because(reason)
        }
        Act::HandshakeFailed(fault) => Entry::new(who, "connect", Outcome::Refused).because(fault),
        Act::ForeignId {
            source,
            destination,
        } => {
            let entry = Entry::new(who, "message", Outcome::Refused);
            let why = "the key may not speak for this id";
            entry.id(source).to(destination).because(why)
        }
        Act::Message {
            name,
            source,
            destination,
            refusal,
        } => {
            let result = refusal.map_or(Outcome::Allowed, |_| Outcome::Refused);
            let entry = Entry::new(who, name, result).id(source).to(destination);
            match refusal {
                Some(refusal) => entry.because(refusal),
                None => entry,
            }
        }
        Act::Control {
            component,
            client,
            is_granted,
        } => {
            let result = if is_granted {
                Outcome::Allowed
            } else {
                Outcome::Refused
            };
            let entry = Entry::new(who, "control", result);
            entry
                .id(client)
                .to(component)
                .because("the component's answer")
        }
    };
    let entry = entry.address(record.address);
    match record.key {
        Some(key) => entry.key(key),
        None => entry,
    }
}
