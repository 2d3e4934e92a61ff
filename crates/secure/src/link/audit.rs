//! The entries of the audit log about a secure link.

use jaus_audit::{Entry, Outcome};

use crate::transport::{Act, Record};

/// The entry of a record.
pub(super) fn entry(record: Record) -> Entry {
    let is_stranger = record.peer.is_none();
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
        Act::DisputedId {
            source,
            destination,
        } => {
            let entry = Entry::new(who, "message", Outcome::Refused);
            let why = "another program with the same key uses this id";
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
    let entry = match is_stranger {
        // With its port, each attempt of a flood would be an entry of its own.
        true => entry.address(record.address.ip()),
        false => entry.address(record.address),
    };
    match record.key {
        Some(key) => entry.key(key),
        None => entry,
    }
}

/// The entry about records that were not kept.
pub(super) fn loss(count: u64) -> Entry {
    let mut entry = Entry::new("jaus", "audit", Outcome::Failed);
    entry.times = count;
    entry.because("refusals not recorded, because too many came at once")
}
