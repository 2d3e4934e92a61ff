//! What has arrived for one component and was not read yet: bounded, the urgent first.
//!
//! A component that does not read must not stop the node, so a full mailbox drops. **What goes is
//! the oldest message of the least urgent priority present**, and if all that wait are more
//! urgent than the new message, the new one. Every drop is counted.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use crate::endpoint::Received;
use crate::wire::Priority;

/// How much a mailbox holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct MailboxLimits {
    /// Messages that may wait, at least 1.
    pub messages: usize,
    /// Octets of payload that may wait. A single larger message is accepted when nothing else
    /// waits.
    pub octets: usize,
}

impl Default for MailboxLimits {
    fn default() -> Self {
        Self {
            messages: 1024,
            octets: 8 << 20,
        }
    }
}

/// What has become of a component's messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct MailboxCounters {
    /// Messages put in.
    pub delivered: u64,
    /// Messages dropped because the component did not read in time.
    pub dropped: u64,
    /// Messages that wait now.
    pub waiting: usize,
}

/// One writer (the node), one reader (the component's port).
#[derive(Debug)]
pub(super) struct Mailbox {
    limits: MailboxLimits,
    inner: Mutex<Inner>,
}

#[derive(Debug, Default)]
struct Inner {
    /// By priority, low first.
    queues: [VecDeque<Received>; Priority::ALL.len()],
    waiting: usize,
    octets: usize,
    delivered: u64,
    dropped: u64,
    closed: bool,
    reader: Option<Waker>,
}

impl Mailbox {
    pub(super) fn new(limits: MailboxLimits) -> Self {
        Self {
            limits,
            inner: Mutex::default(),
        }
    }

    pub(super) fn push(&self, message: Received) {
        let mut inner = self.lock();
        inner.delivered += 1;
        inner.put(message);
        while inner.waiting > self.limits.messages.max(1)
            || (inner.octets > self.limits.octets && inner.waiting > 1)
        {
            inner.drop_least();
        }
        inner.wake();
    }

    /// The most urgent message, the oldest of these; `None` when the mailbox is closed and empty.
    pub(super) fn poll_pop(&self, cx: &mut Context<'_>) -> Poll<Option<Received>> {
        let mut inner = self.lock();
        if let Some(message) = inner.pop() {
            return Poll::Ready(Some(message));
        }
        if inner.closed {
            return Poll::Ready(None);
        }
        inner.reader = Some(cx.waker().clone());
        Poll::Pending
    }

    pub(super) fn pop(&self) -> Option<Received> {
        self.lock().pop()
    }

    /// Nothing more will come; what waits can still be read.
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
            waiting: inner.waiting,
        }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    fn put(&mut self, message: Received) {
        self.waiting += 1;
        self.octets += message.payload.len();
        self.queues[usize::from(message.priority.bits())].push_back(message);
    }

    fn pop(&mut self) -> Option<Received> {
        let message = self.queues.iter_mut().rev().find_map(VecDeque::pop_front);
        self.taken(message)
    }

    fn drop_least(&mut self) {
        let message = self.queues.iter_mut().find_map(VecDeque::pop_front);
        if self.taken(message).is_some() {
            self.dropped += 1;
        }
    }

    fn taken(&mut self, message: Option<Received>) -> Option<Received> {
        let message = message?;
        self.waiting -= 1;
        self.octets -= message.payload.len();
        Some(message)
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

    fn message(priority: Priority, payload: &'static str) -> Received {
        Received {
            source: JausId::new(1, 1, 1),
            destination: JausId::new(2, 1, 1),
            to: JausId::new(2, 1, 1),
            priority,
            broadcast: Broadcast::None,
            payload: Bytes::from_static(payload.as_bytes()),
            path: None,
        }
    }

    fn read(mailbox: &Mailbox) -> Vec<String> {
        std::iter::from_fn(|| mailbox.pop())
            .map(|m| String::from_utf8(m.payload.to_vec()).unwrap())
            .collect()
    }

    fn mailbox(messages: usize, octets: usize) -> Mailbox {
        Mailbox::new(MailboxLimits { messages, octets })
    }

    #[test]
    fn urgent_messages_are_read_first_and_equals_in_order() {
        let mailbox = mailbox(10, 1000);
        mailbox.push(message(Priority::Standard, "one"));
        mailbox.push(message(Priority::Low, "later"));
        mailbox.push(message(Priority::SafetyCritical, "stop"));
        mailbox.push(message(Priority::Standard, "two"));
        assert_eq!(read(&mailbox), ["stop", "one", "two", "later"]);
    }

    #[test]
    fn a_full_mailbox_drops_the_oldest_of_the_least_urgent() {
        let mailbox = mailbox(2, 1000);
        mailbox.push(message(Priority::Standard, "one"));
        mailbox.push(message(Priority::Standard, "two"));
        mailbox.push(message(Priority::Standard, "three"));
        mailbox.push(message(Priority::High, "four"));
        mailbox.push(message(Priority::Low, "five"));
        assert_eq!(
            mailbox.counters(),
            MailboxCounters {
                delivered: 5,
                dropped: 3,
                waiting: 2
            }
        );
        assert_eq!(read(&mailbox), ["four", "three"]);
    }

    #[test]
    fn payloads_are_bounded_too_but_a_single_large_message_passes() {
        let mailbox = mailbox(10, 8);
        mailbox.push(message(Priority::Standard, "1234"));
        mailbox.push(message(Priority::Standard, "5678"));
        mailbox.push(message(Priority::Standard, "9"));
        assert_eq!(read(&mailbox), ["5678", "9"]);
        mailbox.push(message(Priority::Standard, "longer than eight"));
        assert_eq!(read(&mailbox), ["longer than eight"]);
    }

    #[test]
    fn a_closed_mailbox_can_be_read_to_its_end() {
        let mailbox = mailbox(10, 1000);
        let mut cx = Context::from_waker(Waker::noop());
        assert!(mailbox.poll_pop(&mut cx).is_pending());
        mailbox.push(message(Priority::Standard, "last"));
        mailbox.close();
        assert!(matches!(mailbox.poll_pop(&mut cx), Poll::Ready(Some(_))));
        assert!(matches!(mailbox.poll_pop(&mut cx), Poll::Ready(None)));
    }
}
