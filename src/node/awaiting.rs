//! The messages whose senders wait for an acknowledgement.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

use super::error::Undelivered;
use crate::address::JausId;
use crate::endpoint::{Event, MessageHandle};
use crate::link::local::Writer;
use crate::link::local::record::{Head, Outcome, Record};

/// Limit of waiting senders: that of an endpoint, so only the client of another process's node can
/// reach it.
pub(super) const MAX_AWAITED: usize = 4096;

/// All waiting senders.
#[derive(Debug, Default)]
pub(super) struct Awaiting(HashMap<MessageHandle, Awaited>);

/// A message with its waiting sender.
#[derive(Debug)]
struct Awaited {
    source: JausId,
    destination: JausId,
    waiter: Waiter,
}

/// A waiting sender.
#[derive(Debug)]
pub(super) enum Waiter {
    /// A task of this process.
    Here(oneshot::Sender<Result<(), Undelivered>>),
    /// A component process, with its own handle of the message.
    There { answers: Arc<Answers>, handle: u64 },
}

/// The writing half of a component process's connection: replies of the session, and outcomes of
/// the component's messages.
#[derive(Debug)]
pub(super) struct Answers(pub(super) Mutex<Writer>);

impl Awaiting {
    /// Adds a waiting sender; returns whether there was room.
    #[must_use]
    pub(super) fn insert(
        &mut self,
        message: MessageHandle,
        (source, destination): (JausId, JausId),
        waiter: Waiter,
    ) -> bool {
        let has_room = self.0.len() < MAX_AWAITED;
        if has_room {
            let awaited = Awaited {
                source,
                destination,
                waiter,
            };
            self.0.insert(message, awaited);
        }
        has_room
    }

    /// Notifies the waiting sender of an outcome at the endpoint.
    pub(super) fn handle_event(&mut self, event: &Event) {
        let (message, outcome) = match *event {
            Event::Acknowledged { message, .. } => (message, Ok(())),
            Event::NotAcknowledged { message, shortfall } => (message, Err(shortfall.into())),
            _ => return,
        };
        if let Some(waiter) = self.remove(message) {
            waiter.notify(outcome);
        }
    }

    pub(super) fn remove(&mut self, message: MessageHandle) -> Option<Waiter> {
        self.0.remove(&message).map(|it| it.waiter)
    }

    /// The message, with its destination, that a component process knows by this handle.
    pub(super) fn of_process(
        &self,
        source: JausId,
        handle: u64,
    ) -> Option<(MessageHandle, JausId)> {
        let is_meant = |it: &Awaited| {
            let known = match it.waiter {
                Waiter::There { handle, .. } => Some(handle),
                Waiter::Here(_) => None,
            };
            it.source == source && known == Some(handle)
        };
        let (message, it) = self.0.iter().find(|(_, it)| is_meant(it))?;
        Some((*message, it.destination))
    }

    /// Drops the waiters of a component that is gone.
    pub(super) fn forget_source(&mut self, source: JausId) {
        self.0.retain(|_, it| it.source != source);
    }

    /// Drops all waiters: no more outcomes will be known.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

impl Waiter {
    pub(super) fn notify(self, outcome: Result<(), Undelivered>) {
        match self {
            // An error means that the sender no longer waits.
            Self::Here(sender) => drop(sender.send(outcome)),
            Self::There { answers, handle } => answers.send(handle, outcome),
        }
    }
}

impl Answers {
    /// Sends the outcome of a message.
    pub(super) fn send(&self, handle: u64, outcome: Result<(), Undelivered>) {
        let (outcome, why) = match outcome {
            Ok(()) => (Outcome::Acknowledged, String::new()),
            Err(Undelivered::NotAcknowledged(it)) => (Outcome::NotAcknowledged(it), String::new()),
            Err(error) => (Outcome::Rejected, error.to_string()),
        };
        let head = Head::Outcome { handle, outcome };
        self.lock().send(&Record::with_text(head, &why));
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Writer> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
