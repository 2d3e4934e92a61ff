//! The node's replies to a component process: the outcomes of its messages.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::error::Undelivered;
use crate::link::local::Writer;
use crate::link::local::record::{Head, Outcome, Record};

/// The writing half of a component's connection: replies of the session, and outcomes of the
/// component's messages.
#[derive(Debug)]
pub(super) struct Answers(Mutex<Writer>);

impl Answers {
    pub(super) const fn new(writer: Writer) -> Self {
        Self(Mutex::new(writer))
    }

    /// Sends the outcome of a message.
    pub(super) fn send(&self, handle: u64, outcome: Result<(), Undelivered>) {
        let octets = |octets: usize| u32::try_from(octets).unwrap_or(u32::MAX);
        let outcome = match outcome {
            Ok(()) => Outcome::Acknowledged,
            Err(Undelivered::NotAcknowledged {
                destination,
                reason,
                acknowledged,
                length,
            }) => Outcome::NotAcknowledged {
                destination,
                reason,
                acknowledged: octets(acknowledged),
                length: octets(length),
            },
            Err(error) => {
                let rejected = Record::rejected(handle, &error.to_string());
                return self.lock().send(&rejected);
            }
        };
        self.lock().send(&Head::Outcome { handle, outcome }.into());
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Writer> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
