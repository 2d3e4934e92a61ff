//! The mailbox of a component: a bounded queue of unread messages, most urgent first.
//!
//! A component that does not read must not block the node, so a full mailbox drops messages. **It
//! drops the oldest message of the lowest priority present**. If all waiting messages are more
//! urgent than the new one, it drops the new one. Every drop is counted.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

#[cfg(feature = "serde")]
use super::config::units;
use crate::endpoint::Received;
use crate::link::backlog::{Backlog, Bounds};
use crate::wire::Priority;

/// A writer that waits for room is woken when the number of messages is a multiple of this.
const WAKE_WRITER: usize = 128;

/// The limits of a mailbox.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct MailboxLimits {
    /// Limit of waiting messages, at least 1.
    pub messages: usize,
    /// Limit of waiting octets of payload. A single larger message is accepted if no other waits.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "units::read_size"))]
    pub octets: usize,
}

impl Default for MailboxLimits {
    fn default() -> Self {
        Self {
            messages: 4096,
            octets: 8 << 20,
        }
    }
}

/// Counts of a component's messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct MailboxCounters {
    /// Messages received.
    pub delivered: u64,
    /// Messages dropped because the component did not read in time.
    pub dropped: u64,
    /// Messages waiting now.
    pub waiting: usize,
}

/// A queue with one writer (the node) and one reader (the component's port).
#[derive(Debug)]
pub(super) struct Mailbox {
    inner: Mutex<Inner>,
}

#[derive(Debug)]
struct Inner {
    messages: Backlog<Received>,
    delivered: u64,
    dropped: u64,
    closed: bool,
    reader: Option<Waker>,
    /// The writer's waker while it waits for room.
    writer: Option<Waker>,
}

impl Mailbox {
    pub(super) fn new(limits: MailboxLimits) -> Self {
        let bounds = Bounds {
            items: limits.messages,
            octets: limits.octets,
        };
        Self {
            inner: Mutex::new(Inner {
                messages: Backlog::new(bounds),
                delivered: 0,
                dropped: 0,
                closed: false,
                reader: None,
                writer: None,
            }),
        }
    }

    /// Queues a message.
    pub(super) fn push(&self, message: Received) {
        let mut inner = self.lock();
        inner.delivered += 1;
        inner.dropped += inner
            .messages
            .push(message.priority, message.payload.len(), message);
        inner.wake();
    }

    /// The oldest message of the highest priority; `None` when the mailbox is closed and empty.
    pub(super) fn poll_pop(&self, cx: &mut Context<'_>) -> Poll<Option<Received>> {
        let mut inner = self.lock();
        if let Some(message) = inner.pop() {
            return Poll::Ready(Some(message));
        }
        if inner.closed {
            return Poll::Ready(None);
        }
        inner.await_more(cx);
        Poll::Pending
    }

    pub(super) fn pop(&self) -> Option<Received> {
        self.lock().pop()
    }

    /// Passes messages to `each` while it returns `true`, in the order of [`poll_pop`]. Ready when
    /// the mailbox is closed and empty.
    ///
    /// [`poll_pop`]: Self::poll_pop
    pub(super) fn poll_drain(
        &self,
        cx: &mut Context<'_>,
        mut each: impl FnMut(Received) -> bool,
    ) -> Poll<()> {
        let mut inner = self.lock();
        while let Some(message) = inner.pop() {
            if !each(message) {
                return Poll::Pending;
            }
        }
        if inner.closed {
            return Poll::Ready(());
        }
        inner.await_more(cx);
        Poll::Pending
    }

    /// Waits until `messages` more fit, or the mailbox is empty.
    pub(super) fn poll_room(&self, cx: &mut Context<'_>, messages: usize) -> Poll<()> {
        let mut inner = self.lock();
        if inner.has_room(messages) {
            return Poll::Ready(());
        }
        match &inner.writer {
            Some(waker) if waker.will_wake(cx.waker()) => {}
            _ => inner.writer = Some(cx.waker().clone()),
        }
        Poll::Pending
    }

    /// Whether `messages` more fit, or the mailbox is empty.
    pub(super) fn has_room(&self, messages: usize) -> bool {
        self.lock().has_room(messages)
    }

    /// Whether a message that is acknowledged now is sure to stay until it is read: the other half
    /// of the room is for messages that cannot be refused.
    pub(super) fn has_reserve(&self, priority: Priority) -> bool {
        self.lock().messages.has_reserve(priority)
    }

    /// The number of messages read so far.
    pub(super) fn taken(&self) -> u64 {
        let inner = self.lock();
        inner.delivered - inner.dropped - inner.messages.len() as u64
    }

    /// Closes the mailbox. Waiting messages can still be read.
    pub(super) fn close(&self) {
        let mut inner = self.lock();
        inner.closed = true;
        inner.wake();
    }

    pub(super) fn counters(&self) -> MailboxCounters {
        let inner = self.lock();
        MailboxCounters {
            delivered: inner.delivered,
            dropped: inner.dropped,
            waiting: inner.messages.len(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    fn has_room(&self, messages: usize) -> bool {
        self.messages.is_empty() || self.messages.has_room(messages)
    }

    fn pop(&mut self) -> Option<Received> {
        let message = self.messages.pop();
        if let Some(writer) = self
            .writer
            .take_if(|_| self.messages.len().is_multiple_of(WAKE_WRITER))
        {
            writer.wake();
        }
        message
    }

    fn await_more(&mut self, cx: &Context<'_>) {
        match &self.reader {
            Some(waker) if waker.will_wake(cx.waker()) => {}
            _ => self.reader = Some(cx.waker().clone()),
        }
    }

    fn wake(&mut self) {
        if let Some(reader) = self.reader.take() {
            reader.wake();
        }
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::address::JausId;
    use crate::wire::Broadcast;

    fn message(priority: Priority) -> Received {
        Received {
            source: JausId::new(1, 1, 1),
            destination: JausId::new(2, 1, 1),
            to: JausId::new(2, 1, 1),
            priority,
            broadcast: Broadcast::None,
            payload: Bytes::from_static(b"12345678"),
            path: None,
        }
    }

    #[test]
    fn what_was_acknowledged_stays_whatever_comes_that_cannot_be_refused() {
        let mailbox = Mailbox::new(MailboxLimits {
            messages: 8,
            octets: 1000,
        });
        let mut acknowledged = 0;
        while mailbox.has_reserve(Priority::Standard) {
            mailbox.push(message(Priority::Standard));
            acknowledged += 1;
        }
        (0..4).for_each(|_| mailbox.push(message(Priority::Standard)));
        assert_eq!((acknowledged, mailbox.counters().dropped), (4, 0));
        assert!(
            mailbox.has_reserve(Priority::SafetyCritical),
            "a stop gets in"
        );
    }

    #[test]
    fn what_is_dropped_is_counted() {
        let mailbox = Mailbox::new(MailboxLimits {
            messages: 2,
            octets: 1000,
        });
        for priority in [
            Priority::Standard,
            Priority::High,
            Priority::Low,
            Priority::High,
        ] {
            mailbox.push(message(priority));
        }
        let expected = MailboxCounters {
            delivered: 4,
            dropped: 2,
            waiting: 2,
        };
        assert_eq!(mailbox.counters(), expected);
        assert_eq!(mailbox.pop().map(|m| m.priority), Some(Priority::High));
        assert_eq!(mailbox.pop().map(|m| m.priority), Some(Priority::High));
    }

    #[test]
    fn a_closed_mailbox_can_be_read_to_its_end() {
        let mailbox = Mailbox::new(MailboxLimits::default());
        let mut cx = Context::from_waker(Waker::noop());
        assert!(mailbox.poll_pop(&mut cx).is_pending());
        mailbox.push(message(Priority::Standard));
        mailbox.close();
        assert!(matches!(mailbox.poll_pop(&mut cx), Poll::Ready(Some(_))));
        assert!(matches!(mailbox.poll_pop(&mut cx), Poll::Ready(None)));
    }
}
