//! Converts messages in the gateway and counts the ones without an equivalent.

use std::sync::{Arc, PoisonError, RwLock};
use std::time::Instant;

use bytes::Bytes;

use super::counters::{Counter, Tally};
use crate::convert::{Context, Refusal, to_jaus_with, to_ra_with};
use crate::ids::{IdTable, RaComponent};

/// Ids and known components, for messages that name components. Clones share one table.
#[derive(Debug, Clone)]
pub(super) struct Ids(Arc<RwLock<IdTable>>);

impl Ids {
    pub(super) fn new(table: IdTable) -> Self {
        Self(Arc::new(RwLock::new(table)))
    }

    /// Replaces the table after a component has come or gone.
    pub(super) fn set(&self, table: IdTable) {
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = table;
    }
}

/// Conversion context of a proxied component: ids, component type and service version.
#[derive(Debug, Clone)]
pub(super) struct Words {
    ids: Ids,
    part: RaComponent,
    minor: u8,
}

impl Words {
    /// The context of an RA component of this type, or of a JAUS component shown as this type with
    /// a service of this minor version.
    pub(super) const fn new(ids: Ids, part: u8, minor: u8) -> Self {
        Self {
            ids,
            part: RaComponent(part),
            minor,
        }
    }

    /// Converts the data of an RA message to a JAUS payload.
    pub(super) fn to_jaus(&self, code: u16, data: &[u8]) -> Result<Bytes, Refusal> {
        let ids = self.ids.0.read().unwrap_or_else(PoisonError::into_inner);
        to_jaus_with(self.context(&ids), code, data)
    }

    /// Converts a JAUS payload to code and data of an RA message.
    pub(super) fn to_ra(&self, payload: &Bytes) -> Result<(u16, Bytes), Refusal> {
        let ids = self.ids.0.read().unwrap_or_else(PoisonError::into_inner);
        to_ra_with(self.context(&ids), payload)
    }

    const fn context<'a>(&self, ids: &'a IdTable) -> Context<'a> {
        Context {
            ids: Some(ids),
            part: Some(self.part),
            minor: Some(self.minor),
        }
    }
}

/// Counts a refused message with this code.
pub(super) fn refuse(now: Instant, tally: &mut Tally, code: u16, refusal: &Refusal) {
    let counter = match refusal {
        Refusal::NoCounterpart(_) => Counter::NoCounterpart,
        _ => Counter::NotConverted,
    };
    tally.refuse(now, counter, code, refusal);
}
