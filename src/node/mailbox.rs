//! The mailbox of a component or tap: a bounded queue of unread messages, most urgent first.
//!
//! A component that does not read must not block the node, so a full mailbox drops messages. **It
//! drops the oldest unacknowledged message of the lowest priority present**. If all of these are more
//! urgent than the new one, it drops the new one. Every drop is counted. An acknowledged message stays
//! until it is read: it is refused before it is acknowledged if there is no room.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::Instant;

use tokio::sync::Notify;

#[cfg(feature = "serde")]
use super::config::units;
use super::progress::Progress;
use crate::address::JausId;
use crate::endpoint::Received;
use crate::link::backlog::{Backlog, Bounds};
use crate::wire::Priority;

/// Progress of the reader is signalled when the number of waiting messages is a multiple of this.
const SIGNAL_READ: usize = 128;

/// The limits of the mailbox of each component.
///
/// ```
/// use jaus::node::{Config, MailboxLimits};
///
/// let mut config = Config::new(101, 1);
/// config.mailbox = MailboxLimits { messages: 256, octets: 1 << 20 };
/// assert_eq!(config.validate(), Ok(()));
/// ```
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
    /// Messages received, including those dropped.
    pub delivered: u64,
    /// Messages dropped because the component did not read in time.
    pub dropped: u64,
    /// Messages waiting now.
    pub waiting: usize,
}

/// A queue with one writer (the node) and one reader (the component's port, or a tap).
#[derive(Debug)]
pub(super) struct Mailbox<T = Received> {
    inner: Mutex<Inner<T>>,
    /// Signals progress of the reader.
    pub(super) read: Notify,
}

#[derive(Debug)]
struct Inner<T> {
    messages: Backlog<T>,
    delivered: u64,
    dropped: u64,
    closed: bool,
    reader: Option<Waker>,
    progress: Progress,
}

impl Mailbox {
    /// Queues a message. One that was acknowledged stays until it is read.
    pub(super) fn deliver(&self, message: Received) {
        let push = match message.acknowledged {
            true => Backlog::push_firm,
            false => Backlog::push,
        };
        self.push_by(push, message.priority, message.payload.len(), message);
    }

    /// Notes that a part of an unfinished message has arrived from a peer.
    pub(super) fn note_progress(&self, now: Instant, source: JausId) {
        let mut inner = self.lock();
        if inner.progress.note(now, source) {
            inner.wake();
        }
    }

    /// When a part of a large message last arrived from a peer.
    pub(super) fn last_fragment(&self, source: JausId) -> Option<Instant> {
        self.lock().progress.latest(source)
    }

    /// Passes on the peers from which parts have arrived, for the component's process.
    pub(super) fn drain_progress(&self, each: impl FnMut(JausId)) {
        self.lock().progress.take_news().for_each(each);
    }

    /// Whether `messages` more fit, or the mailbox is empty.
    pub(super) fn has_room(&self, messages: usize) -> bool {
        let inner = self.lock();
        inner.messages.is_empty() || inner.messages.has_room(messages)
    }

    /// Whether there is room for one more message that is acknowledged: the other half of the room is
    /// for messages that cannot be refused.
    pub(super) fn has_reserve(&self, priority: Priority) -> bool {
        self.lock().messages.has_reserve(priority)
    }

    pub(super) fn counters(&self) -> MailboxCounters {
        let inner = self.lock();
        MailboxCounters {
            delivered: inner.delivered,
            dropped: inner.dropped,
            waiting: inner.messages.len(),
        }
    }
}

impl<T> Mailbox<T> {
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
                progress: Progress::default(),
            }),
            read: Notify::new(),
        }
    }

    pub(super) fn push(&self, priority: Priority, octets: usize, message: T) {
        self.push_by(Backlog::push, priority, octets, message);
    }

    fn push_by(
        &self,
        push: fn(&mut Backlog<T>, Priority, usize, T) -> u64,
        priority: Priority,
        octets: usize,
        message: T,
    ) {
        let mut inner = self.lock();
        inner.delivered += 1;
        inner.dropped += push(&mut inner.messages, priority, octets, message);
        inner.wake();
    }

    /// The oldest message of the highest priority; `None` when the mailbox is closed and empty.
    pub(super) fn poll_pop(&self, cx: &Context<'_>) -> Poll<Option<T>> {
        let mut inner = self.lock();
        if let Some(message) = self.take(&mut inner) {
            return Poll::Ready(Some(message));
        }
        inner.poll_closed(cx).map(|()| None)
    }

    pub(super) fn pop(&self) -> Option<T> {
        self.take(&mut self.lock())
    }

    fn take(&self, inner: &mut Inner<T>) -> Option<T> {
        let message = inner.messages.pop()?;
        if inner.messages.len().is_multiple_of(SIGNAL_READ) {
            self.read.notify_waiters();
        }
        Some(message)
    }

    /// Passes messages to `each` while it returns `true`, in the order of [`poll_pop`]. Ready when
    /// the mailbox is closed and empty.
    ///
    /// [`poll_pop`]: Self::poll_pop
    pub(super) fn poll_drain(&self, cx: &Context<'_>, mut each: impl FnMut(T) -> bool) -> Poll<()> {
        let mut inner = self.lock();
        while let Some(message) = self.take(&mut inner) {
            if !each(message) {
                return Poll::Pending;
            }
        }
        inner.poll_closed(cx)
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

    fn lock(&self) -> MutexGuard<'_, Inner<T>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> Inner<T> {
    /// Ready when the mailbox is closed; otherwise its reader is woken by the next message.
    fn poll_closed(&mut self, cx: &Context<'_>) -> Poll<()> {
        if self.closed {
            return Poll::Ready(());
        }
        self.reader = Some(cx.waker().clone());
        Poll::Pending
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
    use crate::wire::Broadcast;

    fn message(priority: Priority) -> Received {
        Received {
            source: JausId::new(1, 1, 1),
            destination: JausId::new(2, 1, 1),
            to: JausId::new(2, 1, 1),
            priority,
            broadcast: Broadcast::None,
            payload: Bytes::from_static(b"12345678"),
            sequence: None,
            path: None,
            acknowledged: false,
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
            mailbox.deliver(Received {
                acknowledged: true,
                ..message(Priority::Standard)
            });
            acknowledged += 1;
        }
        (0..4).for_each(|_| mailbox.deliver(message(Priority::Standard)));
        assert_eq!((acknowledged, mailbox.counters().dropped), (4, 0));
        assert!(
            mailbox.has_reserve(Priority::SafetyCritical),
            "a stop gets in"
        );
        let other = Received {
            payload: Bytes::from_static(b"other"),
            ..message(Priority::Standard)
        };
        (0..1000).for_each(|_| mailbox.deliver(other.clone()));
        let read: Vec<_> = std::iter::from_fn(|| mailbox.pop()).collect();
        let is_kept = |it: &&Received| it.payload == message(Priority::Standard).payload;
        assert_eq!(read.iter().filter(is_kept).count(), acknowledged);
        assert_eq!(read.len(), 8);
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
            mailbox.deliver(message(priority));
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
        let cx = Context::from_waker(Waker::noop());
        assert!(mailbox.poll_pop(&cx).is_pending());
        mailbox.deliver(message(Priority::Standard));
        mailbox.close();
        assert!(matches!(mailbox.poll_pop(&cx), Poll::Ready(Some(_))));
        assert!(matches!(mailbox.poll_pop(&cx), Poll::Ready(None)));
    }
}
