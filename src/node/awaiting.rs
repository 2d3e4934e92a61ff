//! The messages whose senders wait for an acknowledgement.

use std::collections::HashMap;
use std::sync::Arc;

use tokio::sync::oneshot;

use super::answers::Answers;
use super::error::Undelivered;
use crate::address::JausId;
use crate::endpoint::{Event, MessageHandle};

/// A waiting sender.
#[derive(Debug)]
pub(super) enum Waiter {
    /// A task of this process.
    Here(oneshot::Sender<Result<(), Undelivered>>),
    /// A component process, with its own handle of the message.
    There { answers: Arc<Answers>, handle: u64 },
}

/// All waiting senders.
#[derive(Debug)]
pub(super) struct Awaiting {
    limit: usize,
    waiters: HashMap<MessageHandle, (JausId, Waiter)>,
}

impl Awaiting {
    /// At most `limit` senders can wait.
    pub(super) fn new(limit: usize) -> Self {
        let waiters = HashMap::new();
        Self { limit, waiters }
    }

    /// Adds a waiting sender; returns whether there was room.
    #[must_use]
    pub(super) fn insert(
        &mut self,
        message: MessageHandle,
        source: JausId,
        waiter: Waiter,
    ) -> bool {
        if self.waiters.len() >= self.limit {
            self.waiters.retain(|_, (_, waiter)| waiter.waits());
        }
        let has_room = self.waiters.len() < self.limit;
        if has_room {
            self.waiters.insert(message, (source, waiter));
        }
        has_room
    }

    /// Notifies the waiting sender of an outcome at the endpoint.
    pub(super) fn handle_event(&mut self, event: &Event) {
        let (message, outcome) = match *event {
            Event::Acknowledged { message, .. } => (message, Ok(())),
            Event::NotAcknowledged {
                message,
                destination,
                reason,
                acknowledged,
                length,
            } => {
                let undelivered = Undelivered::NotAcknowledged {
                    destination,
                    reason,
                    acknowledged,
                    length,
                };
                (message, Err(undelivered))
            }
            _ => return,
        };
        if let Some(waiter) = self.remove(message) {
            waiter.notify(outcome);
        }
    }

    pub(super) fn remove(&mut self, message: MessageHandle) -> Option<Waiter> {
        self.waiters.remove(&message).map(|(_, waiter)| waiter)
    }

    /// Drops the waiters of a component that is gone.
    pub(super) fn forget_source(&mut self, source: JausId) {
        self.waiters.retain(|_, (of, _)| *of != source);
    }

    /// Drops all waiters: no more outcomes will be known.
    pub(super) fn clear(&mut self) {
        self.waiters.clear();
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

    fn waits(&self) -> bool {
        match self {
            Self::Here(sender) => !sender.is_closed(),
            Self::There { .. } => true,
        }
    }
}
