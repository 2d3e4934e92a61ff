//! The entries of the audit log about a secure link.

use jaus_audit::{Action, Entry, Outcome};

use crate::transport::{Act, Record};

/// The entry of a record.
pub(super) fn entry(record: Record) -> Entry {
    let is_stranger = record.peer.is_none();
    let who = record.peer.as_deref().unwrap_or("unknown");
    let entry = match record.act {
        Act::Connected => Entry::new(who, Action::Connect, Outcome::Allowed),
        Act::Disconnected { reason } => {
            Entry::new(who, Action::Disconnect, Outcome::Allowed).because(reason)
        }
        Act::HandshakeFailed(fault) => {
            Entry::new(who, Action::Connect, Outcome::Refused).because(fault)
        }
        Act::DisputedId {
            source,
            destination,
        } => {
            let entry = Entry::new(who, "message", Outcome::Refused);
            let why = "another program with the same key uses this id";
            entry.id(source).to(destination).because(why)
        }
        Act::Decided(decision) => Entry::of(who, &decision),
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
    let entry = Entry::new("jaus", Action::EntriesLost, Outcome::Failed).times(count);
    entry.because("too much came at once")
}
