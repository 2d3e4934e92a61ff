//! Answers for a component of another process that do not come from its mailbox: what has become of
//! its messages, and what it asked its node.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Waker};

use crate::link::local::Outbox;
use crate::link::local::record::Reply;

/// Answers that may wait before nothing more is read from their component.
const MAX_REPLIES: usize = 4096;

/// Answers for a component that do not come from its mailbox.
#[derive(Debug, Default)]
pub(super) struct Replies(Mutex<(VecDeque<Reply>, Option<Waker>)>);

impl Replies {
    pub(super) fn push(&self, reply: Reply) {
        let (replies, waker) = &mut *self.lock();
        replies.push_back(reply);
        if let Some(waker) = waker.take() {
            waker.wake();
        }
    }

    /// Whether nothing more may be asked until answers have been taken.
    pub(super) fn is_full(&self) -> bool {
        self.lock().0.len() >= MAX_REPLIES
    }

    /// Moves the answers to where they are written.
    pub(super) fn drain(&self, cx: &Context<'_>, outbox: &mut Outbox) {
        let (replies, waker) = &mut *self.lock();
        for reply in replies.drain(..) {
            outbox.reply(&reply);
        }
        match waker {
            Some(known) if known.will_wake(cx.waker()) => {}
            _ => *waker = Some(cx.waker().clone()),
        }
    }

    fn lock(&self) -> MutexGuard<'_, (VecDeque<Reply>, Option<Waker>)> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
