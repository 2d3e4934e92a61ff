//! The line from a component to its host's node, as senders see it.
//!
//! Who sends writes to the socket himself if nothing waits there: that is the shortest way. The
//! next messages are collected until the line's [task](super::task) has its turn or enough have
//! come together, so that a burst costs a few writes and not one for each message.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Waker;

use tokio::sync::{Notify, broadcast, oneshot, watch};

use super::super::mailbox::{Mailbox, MailboxLimits};
use super::super::{SendError, Undelivered};
use crate::address::JausId;
use crate::endpoint::{self, MessageHandle, Outgoing};
use crate::link::local::record::{self, Reply, Request};
use crate::link::local::{Outbox, WriteHalf};

/// Octets collected before a sender writes them himself.
const COLLECTED: usize = 16 << 10;
/// Octets that may wait for the node. A single larger message is accepted when nothing else waits.
const MAX_WAITING: usize = 4 << 20;
/// Messages that may wait for an acknowledgement.
const MAX_AWAITED: usize = 4096;
/// Events kept for a slow listener.
const EVENTS: usize = 256;

/// News about a component's line to its host's node.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HostEvent {
    /// The node is gone. The line tries to reach it again, or its successor.
    Lost {
        /// As far as is known.
        why: String,
    },
    /// A node is there and does not want the component, for instance because somebody else has
    /// taken its id. The line goes on asking.
    Refused {
        /// In the node's words.
        why: String,
    },
    /// The component is attached again.
    Back,
    /// The node would not send a message that the component had sent without waiting for
    /// delivery.
    Rejected {
        /// The message.
        message: MessageHandle,
        /// In the node's words.
        why: String,
    },
}

/// A listener to [`HostEvent`]s. One that falls behind by more than 256 misses the oldest.
#[derive(Debug)]
pub struct HostEvents(pub(super) broadcast::Receiver<HostEvent>);

impl HostEvents {
    /// Of a component that has no line.
    pub(in super::super) fn none() -> Self {
        Self(broadcast::channel(1).1)
    }

    /// Waits for the next event; `None` when the component is detached, and for a component of a
    /// node of its own.
    pub async fn recv(&mut self) -> Option<HostEvent> {
        loop {
            match self.0.recv().await {
                Ok(event) => return Some(event),
                Err(broadcast::error::RecvError::Lagged(_)) => {}
                Err(broadcast::error::RecvError::Closed) => return None,
            }
        }
    }
}

type Outcome = Result<(), Undelivered>;

/// What senders and the line's task have in common.
#[derive(Debug)]
pub(in super::super) struct Line {
    id: JausId,
    inner: Mutex<Inner>,
    pub(super) mailbox: Arc<Mailbox>,
    events: broadcast::Sender<HostEvent>,
    pub(super) connected: watch::Sender<bool>,
    /// Signalled when the component goes.
    leaving: Notify,
    /// Signalled when nothing waits any more: all is written, or there is no connection.
    pub(super) emptied: Notify,
}

#[derive(Debug)]
pub(super) struct Inner {
    /// None while there is no connection.
    pub(super) write: Option<WriteHalf>,
    pub(super) outbox: Outbox,
    /// Whether the next sender may write himself.
    pub(super) direct: bool,
    /// Whether the socket has taken less than there was.
    pub(super) full: bool,
    /// The component is detached, and what waits is its last words.
    pub(super) left: bool,
    max_message: usize,
    sent: u64,
    awaited: HashMap<u64, oneshot::Sender<Outcome>>,
    pub(super) task: Option<Waker>,
}

impl Line {
    pub(super) fn new(id: JausId, limits: MailboxLimits) -> Self {
        Self {
            id,
            inner: Mutex::new(Inner {
                write: None,
                outbox: Outbox::default(),
                direct: true,
                full: false,
                left: false,
                max_message: 0,
                sent: 0,
                awaited: HashMap::new(),
                task: None,
            }),
            mailbox: Arc::new(Mailbox::new(limits)),
            events: broadcast::Sender::new(EVENTS),
            connected: watch::Sender::new(false),
            leaving: Notify::new(),
            emptied: Notify::new(),
        }
    }

    pub(in super::super) const fn id(&self) -> JausId {
        self.id
    }

    pub(in super::super) const fn mailbox(&self) -> &Arc<Mailbox> {
        &self.mailbox
    }

    pub(in super::super) fn is_connected(&self) -> bool {
        *self.connected.borrow()
    }

    pub(in super::super) fn events(&self) -> HostEvents {
        HostEvents(self.events.subscribe())
    }

    pub(super) fn announce(&self, event: HostEvent) {
        // Nobody listening is no error.
        let _ = self.events.send(event);
    }

    /// Sends a message, up to the node's door. `waiter` is told what becomes of it, if it wants
    /// an acknowledgement.
    pub(in super::super) fn send(
        &self,
        message: Outgoing,
        waiter: Option<oneshot::Sender<Outcome>>,
    ) -> Result<MessageHandle, SendError> {
        let mut inner = self.lock();
        inner.check(self.id, &message)?;
        inner.sent += 1;
        let handle = inner.sent;
        if let Some(waiter) = waiter {
            inner.await_outcome(handle, waiter)?;
        }
        inner.outbox.request(&Request::Send(record::Send {
            handle,
            destination: message.destination,
            priority: message.priority,
            broadcast: message.broadcast,
            acknowledge: message.acknowledge,
            payload: message.payload,
        }));
        inner.flush_perhaps();
        if inner.outbox.is_empty() {
            self.emptied.notify_waiters();
        }
        inner.wake_task();
        Ok(MessageHandle(handle))
    }

    /// Ready when the node has taken all that was sent, or is lost.
    pub(in super::super) async fn flushed(&self) {
        // Created before the look, so that nothing is missed; once nothing waits, what was sent
        // before is written, whatever others have added since.
        let emptied = self.emptied.notified();
        let waits = {
            let inner = self.lock();
            inner.write.is_some() && !inner.outbox.is_empty()
        };
        if waits {
            emptied.await;
        }
    }

    /// Ready when there is no connection, or none any more.
    pub(in super::super) async fn disconnected(&self) {
        let mut connected = self.connected.subscribe();
        // An error cannot be: the sender is here.
        let _ = connected.wait_for(|connected| !*connected).await;
    }

    /// The component goes.
    pub(in super::super) fn leave(&self) {
        {
            let mut inner = self.lock();
            inner.left = true;
            inner.outbox.request(&Request::Leave);
            inner.awaited.clear();
            inner.wake_task();
        }
        self.mailbox.close();
        self.leaving.notify_one();
    }

    /// There is a connection.
    pub(super) fn handle_connected(&self, write: WriteHalf, max_message: usize) {
        {
            let mut inner = self.lock();
            inner.write = Some(write);
            inner.direct = true;
            inner.full = false;
            inner.max_message = max_message;
        }
        self.connected.send_replace(true);
    }

    /// Ready when the component has gone. For the line's task alone.
    pub(super) async fn left(&self) {
        while !self.lock().left {
            self.leaving.notified().await;
        }
    }

    /// The component has gone, and the node knows it, if it listens.
    pub(super) fn handle_left(&self) {
        self.lock().write = None;
        self.emptied.notify_waiters();
        self.connected.send_replace(false);
    }

    /// There is none any more. What was not written is lost, and nothing will be heard of what was.
    pub(super) fn handle_lost(&self, why: String) {
        {
            let mut inner = self.lock();
            inner.write = None;
            inner.outbox = Outbox::default();
            inner.awaited.clear();
        }
        self.emptied.notify_waiters();
        self.connected.send_replace(false);
        self.announce(HostEvent::Lost { why });
    }

    /// What the node says about a message.
    pub(super) fn handle_outcome(&self, reply: Reply) {
        let (handle, outcome) = match reply {
            Reply::Acknowledged { handle, .. } => (handle, Ok(())),
            Reply::NotAcknowledged {
                handle,
                destination,
                reason,
                acknowledged,
                length,
            } => {
                let undelivered = Undelivered::NotAcknowledged {
                    destination,
                    reason,
                    acknowledged: acknowledged as usize,
                    length: length as usize,
                };
                (handle, Err(undelivered))
            }
            Reply::Rejected { handle, words } => (handle, Err(Undelivered::Rejected(words))),
            _ => return,
        };
        let waiter = self.lock().awaited.remove(&handle);
        match (waiter, outcome) {
            (Some(waiter), outcome) => {
                // An error means that nobody waits any more.
                let _ = waiter.send(outcome);
            }
            (None, Err(Undelivered::Rejected(why))) => {
                let message = MessageHandle(handle);
                tracing::debug!(id = %self.id, why, "message not sent");
                self.announce(HostEvent::Rejected { message, why });
            }
            (None, _) => {}
        }
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    /// What can be told without the node.
    fn check(&self, id: JausId, message: &Outgoing) -> Result<(), SendError> {
        let (length, limit) = (message.payload.len(), self.max_message);
        if message.source != id || self.left {
            return Err(endpoint::SendError::UnknownSource(message.source).into());
        }
        if self.write.is_none() {
            return Err(SendError::NotConnected(id));
        }
        if length < 2 {
            return Err(endpoint::SendError::NoMessageCode { length }.into());
        }
        if length > limit {
            return Err(endpoint::SendError::TooLong { length, limit }.into());
        }
        let octets = self.outbox.len();
        if octets > 0 && octets + length > MAX_WAITING {
            return Err(SendError::Busy { octets });
        }
        Ok(())
    }

    fn await_outcome(
        &mut self,
        handle: u64,
        waiter: oneshot::Sender<Outcome>,
    ) -> Result<(), SendError> {
        if self.awaited.len() >= MAX_AWAITED {
            self.awaited.retain(|_, waiter| !waiter.is_closed());
        }
        if self.awaited.len() >= MAX_AWAITED {
            let limit = MAX_AWAITED;
            return Err(endpoint::SendError::TooManyUnacknowledged { limit }.into());
        }
        self.awaited.insert(handle, waiter);
        Ok(())
    }

    /// Writes what waits, if it is a sender's turn to do so.
    fn flush_perhaps(&mut self) {
        if self.full || !self.direct && self.outbox.len() < COLLECTED {
            return;
        }
        self.direct = false;
        if let Some(write) = &self.write {
            // An error is noticed by the task too, which knows what to do.
            let _ = self.outbox.try_flush(write);
        }
        // Then the task waits for room.
        self.full = !self.outbox.is_empty();
    }

    fn wake_task(&mut self) {
        if let Some(task) = self.task.take() {
            task.wake();
        }
    }
}
