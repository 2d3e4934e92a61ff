//! Who wants to know what became of which message.

use std::collections::HashMap;
use std::sync::Arc;

use tokio::sync::oneshot;

use super::error::Undelivered;
use super::replies::Replies;
use crate::address::JausId;
use crate::endpoint::{Event, MessageHandle};
use crate::link::local::record::Reply;

/// Messages whose fate somebody waits for, at most. The endpoint gives up each of them some day,
/// so that this is only reached if it forgets to say so.
const MOST: usize = 65_536;

/// Who waits.
#[derive(Debug)]
pub(super) enum Waiter {
    /// A task of this process.
    Here(oneshot::Sender<Result<(), Undelivered>>),
    /// A component process, which knows the message by a number of its own.
    There { replies: Arc<Replies>, handle: u64 },
}

/// All who wait.
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

    /// Tells whoever waits for it.
    pub(super) fn handle_event(&mut self, event: &Event) {
        let (Event::Acknowledged { message, .. } | Event::NotAcknowledged { message, .. }) = event
        else {
            return;
        };
        match self.waiters.remove(message) {
            Some((_, Waiter::Here(sender))) => {
                // An error means that nobody waits any more.
                let _ = sender.send(outcome(event));
            }
            Some((_, Waiter::There { replies, handle })) => {
                if let Some(reply) = reply(event, handle) {
                    replies.push(reply);
                }
            }
            None => {}
        }
    }

    /// A component is gone, and nothing will be heard of its messages.
    pub(super) fn forget_source(&mut self, source: JausId) {
        self.waiters.retain(|_, (of, _)| *of != source);
    }

    /// Nothing will be heard of any message.
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

fn outcome(event: &Event) -> Result<(), Undelivered> {
    match *event {
        Event::NotAcknowledged {
            destination,
            reason,
            acknowledged,
            length,
            ..
        } => Err(Undelivered::NotAcknowledged {
            destination,
            reason,
            acknowledged,
            length,
        }),
        _ => Ok(()),
    }
}

fn reply(event: &Event, handle: u64) -> Option<Reply> {
    let octets = |octets: usize| u32::try_from(octets).unwrap_or(u32::MAX);
    match *event {
        Event::NotAcknowledged {
            destination,
            reason,
            acknowledged,
            length,
            ..
        } => Some(Reply::NotAcknowledged {
            handle,
            destination,
            reason,
            acknowledged: octets(acknowledged),
            length: octets(length),
        }),
        Event::Acknowledged { by, .. } => Some(Reply::Acknowledged { handle, by }),
        _ => None,
    }
}
