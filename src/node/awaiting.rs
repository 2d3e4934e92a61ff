//! The messages whose senders wait for an acknowledgement.

use std::collections::HashMap;
use std::sync::Arc;

use tokio::sync::oneshot;

use super::answers::Answers;
use super::error::Undelivered;
use crate::address::JausId;
use crate::endpoint::{Event, MessageHandle};

/// Limit of messages. The endpoint eventually gives up each message, so this is only reached if it
/// fails to report that.
const MOST: usize = 65_536;

/// A waiting sender.
#[derive(Debug)]
pub(super) enum Waiter {
    /// A task of this process.
    Here(oneshot::Sender<Result<(), Undelivered>>),
    /// A component process, with its own handle of the message.
    There { answers: Arc<Answers>, handle: u64 },
}

/// All waiting senders.
#[derive(Debug, Default)]
pub(super) struct Awaiting {
    waiters: HashMap<MessageHandle, (JausId, Waiter)>,
}

impl Awaiting {
    pub(super) fn insert(&mut self, message: MessageHandle, source: JausId, waiter: Waiter) {
        if self.waiters.len() >= MOST {
            self.waiters.retain(|_, (_, waiter)| waiter.waits());
        }
        if self.waiters.len() < MOST {
            self.waiters.insert(message, (source, waiter));
        }
    }

    /// Notifies the waiting sender of an outcome.
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
        match self.waiters.remove(&message) {
            Some((_, Waiter::Here(sender))) => {
                // An error means that the sender no longer waits.
                let _ = sender.send(outcome);
            }
            Some((_, Waiter::There { answers, handle })) => answers.send(handle, outcome),
            None => {}
        }
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
    fn waits(&self) -> bool {
        match self {
            Self::Here(sender) => !sender.is_closed(),
            Self::There { .. } => true,
        }
    }
}
