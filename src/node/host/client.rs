//! A component's connection to its host's node: the state that senders share with the task that
//! reads and writes, and the reconnection after a loss.

use std::convert::Infallible;
use std::future::poll_fn;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::sync::{Notify, watch};
use tokio::time::{sleep, timeout};

use super::super::awaiting::{Awaiting, MAX_AWAITED, Waiter};
use super::super::events::EventSender;
use super::super::mailbox::Mailbox;
use super::super::now;
use super::super::{HostError, SendError, Undelivered};
use super::{Attached, Host, HostEvent};
use crate::address::JausId;
use crate::endpoint::{self, MessageHandle, Outgoing, Received};
use crate::link::local::record::{Head, Outcome, Record, RecordError};
use crate::link::local::{Error, Reader, Writer};
use crate::wire::{Acknowledgement, Flags};

/// Limit of octets that wait for the node. A single larger message is accepted if nothing else
/// waits.
const MAX_WAITING: usize = 4 << 20;
/// Required room in the mailbox before a read: about the largest number of messages in one read.
const ROOM: usize = 1024;
/// How long a component that does not read delays what follows, such as the outcomes of its own
/// messages.
const PATIENCE: Duration = Duration::from_millis(100);
/// How long a node may take to read that a component leaves.
const LEAVE: Duration = Duration::from_secs(1);
/// The first and the longest pause between attempts to reconnect to the node.
const PAUSES: (Duration, Duration) = (Duration::from_millis(10), Duration::from_secs(1));

/// A component's connection to its host's node.
#[derive(Debug)]
pub(in super::super) struct Client {
    pub(in super::super) id: JausId,
    inner: Mutex<Inner>,
    pub(in super::super) mailbox: Arc<Mailbox>,
    pub(in super::super) events: EventSender<HostEvent>,
    status: watch::Sender<Status>,
    /// Signalled when the queue is empty: all is written, or there is no connection.
    emptied: Notify,
}

#[derive(Debug)]
struct Inner {
    writer: Writer,
    max_message: usize,
    sent: u64,
    awaited: Awaiting,
}

/// The state of the connection. It changes under the lock of [`Inner`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Status {
    Connected,
    /// There is no node.
    Lost,
    /// The component was dropped; the node must be notified.
    Leaving,
    /// The component is gone.
    Left,
}

impl Status {
    const DISCONNECTED: [Self; 2] = [Self::Lost, Self::Left];
}

impl Client {
    pub(super) fn start(host: Host, attached: Attached) -> Arc<Self> {
        let client = Arc::new(Self {
            id: attached.id,
            inner: Mutex::new(Inner {
                writer: attached.writer,
                max_message: attached.max_message,
                sent: 0,
                awaited: Awaiting::default(),
            }),
            mailbox: Arc::new(Mailbox::new(host.limits)),
            events: EventSender::default(),
            status: watch::Sender::new(Status::Connected),
            emptied: Notify::new(),
        });
        tokio::spawn(client.clone().run(host, attached.reader));
        client
    }

    pub(in super::super) fn is_connected(&self) -> bool {
        !Status::DISCONNECTED.contains(&self.status.borrow())
    }

    /// Sends a message to the node. If the message requests an acknowledgement, `waiter` gets the
    /// outcome.
    pub(in super::super) fn send(
        &self,
        message: Outgoing,
        waiter: Option<Waiter>,
    ) -> Result<MessageHandle, SendError> {
        let mut inner = self.lock();
        self.check(&inner, &message)?;
        inner.sent += 1;
        let handle = inner.sent;
        let ends = (self.id, message.destination);
        if let Some(waiter) = waiter
            && !inner.awaited.insert(MessageHandle(handle), ends, waiter)
        {
            let limit = MAX_AWAITED;
            return Err(endpoint::SendError::TooManyUnacknowledged { limit }.into());
        }
        let mut flags = Flags::new(message.priority).with_broadcast(message.broadcast);
        if message.acknowledge {
            flags = flags.with_acknowledgement(Acknowledgement::Request);
        }
        let (destination, payload) = (message.destination, message.payload);
        let head = Head::Send {
            flags,
            handle,
            destination,
        };
        inner.writer.send_now(&Record { head, payload });
        if inner.writer.is_empty() {
            self.emptied.notify_waiters();
        }
        Ok(MessageHandle(handle))
    }

    /// Cancels a message whose sender no longer waits for its outcome.
    pub(in super::super) fn cancel(&self, message: MessageHandle) {
        let mut inner = self.lock();
        // Without an entry the outcome is known, or the node that had the message is lost.
        if inner.awaited.remove(message).is_some() {
            let handle = message.0;
            inner.writer.send_now(&Head::Cancel { handle }.into());
        }
    }

    /// Checks a message without asking the node.
    fn check(&self, inner: &Inner, message: &Outgoing) -> Result<(), SendError> {
        let (length, limit) = (message.payload.len(), inner.max_message);
        if matches!(*self.status.borrow(), Status::Leaving | Status::Left) {
            return Err(endpoint::SendError::UnknownSource(message.source).into());
        }
        if !inner.writer.is_open() {
            return Err(SendError::NotConnected(self.id));
        }
        if length < 2 {
            return Err(endpoint::SendError::NoMessageCode { length }.into());
        }
        if length > limit {
            return Err(endpoint::SendError::TooLong { length, limit }.into());
        }
        let octets = inner.writer.len();
        if octets > 0 && octets + length > MAX_WAITING {
            return Err(SendError::Busy { octets });
        }
        Ok(())
    }

    /// Ready when all messages sent so far are written to the connection, or it is lost.
    pub(in super::super) async fn flushed(&self) {
        // Created before the check, so that no signal is missed. An empty queue means that
        // everything sent before is written, even if others have added more since.
        let emptied = self.emptied.notified();
        let waits = !self.lock().writer.is_empty();
        if waits {
            emptied.await;
        }
    }

    /// Ready when there is no connection.
    pub(in super::super) async fn disconnected(&self) {
        self.reached(&Status::DISCONNECTED).await;
    }

    /// Detaches the component.
    pub(in super::super) fn leave(&self) {
        let mut inner = self.lock();
        inner.awaited.clear();
        inner.writer.send(&Head::Leave.into());
        self.status.send_replace(Status::Leaving);
        drop(inner);
        self.mailbox.close();
    }

    async fn reached(&self, wanted: &[Status]) {
        let mut status = self.status.subscribe();
        // This cannot fail: `self` holds the sender.
        let _ = status.wait_for(|status| wanted.contains(status)).await;
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads and writes until the component has left.
    async fn run(self: Arc<Self>, host: Host, mut reader: Reader) {
        let leaving = || self.reached(&[Status::Leaving]);
        loop {
            let late = async {
                leaving().await;
                sleep(LEAVE).await;
            };
            let end = tokio::select! {
                biased;
                end = poll_fn(|cx| self.poll_write(cx)) => end.err(),
                end = self.read(&mut reader) => end.err(),
                () = late => None,
            };
            let Some(error) = end else { break };
            tracing::warn!(id = %self.id, %error, "lost the node of this host");
            self.handle_lost(Status::Lost);
            self.events.send(HostEvent::Lost {
                why: error.to_string(),
            });
            tokio::select! {
                biased;
                () = leaving() => break,
                attached = self.reach(&host) => reader = attached,
            }
        }
        self.handle_lost(Status::Left);
    }

    /// Handles the loss of the connection. Queued messages are lost, and sent ones get no outcome.
    fn handle_lost(&self, status: Status) {
        let mut inner = self.lock();
        inner.writer.close();
        inner.awaited.clear();
        self.emptied.notify_waiters();
        let is_leaving = *self.status.borrow() == Status::Leaving;
        if !is_leaving || status == Status::Left {
            self.status.send_replace(status);
        }
    }

    /// Retries until the node, or its successor, has attached the component again.
    async fn reach(&self, host: &Host) -> Reader {
        let mut pause = PAUSES.0;
        let mut refused = None;
        loop {
            sleep(pause).await;
            pause = (2 * pause).min(PAUSES.1);
            match host.shake_hands(self.id).await {
                Ok(attached) => {
                    let mut inner = self.lock();
                    if !matches!(*self.status.borrow(), Status::Leaving) {
                        inner.writer = attached.writer;
                        inner.max_message = attached.max_message;
                        self.status.send_replace(Status::Connected);
                    }
                    drop(inner);
                    tracing::info!(id = %self.id, "the node of this host is back");
                    self.events.send(HostEvent::Back);
                    return attached.reader;
                }
                Err(HostError::Refused { words: why, .. }) if refused.as_ref() != Some(&why) => {
                    tracing::warn!(id = %self.id, why, "cannot reattach");
                    refused = Some(why.clone());
                    self.events.send(HostEvent::Refused { why });
                }
                Err(error) => tracing::debug!(%error, "the node is still unavailable"),
            }
        }
    }

    /// Writes queued records. Ready when the component has left and all is written.
    fn poll_write(&self, cx: &mut Context<'_>) -> Poll<Result<(), Error>> {
        let mut inner = self.lock();
        ready!(inner.writer.poll_flush(cx))?;
        self.emptied.notify_waiters();
        match *self.status.borrow() {
            Status::Leaving => Poll::Ready(Ok(())),
            _ => Poll::Pending,
        }
    }

    /// Reads the node's records until the connection is lost.
    async fn read(&self, reader: &mut Reader) -> Result<Infallible, Error> {
        let mut stalled_at = None;
        loop {
            while let Some(record) = reader.next_record()? {
                self.handle_record(record)?;
            }
            stalled_at = self.catch_up(stalled_at).await;
            reader.fill(|| true).await?;
        }
    }

    /// Delays the next read for a component that reads slowly. If the component does not read at
    /// all, returns the number of messages that it has read, for the next call, which then does not
    /// wait again.
    async fn catch_up(&self, stalled_at: Option<u64>) -> Option<u64> {
        let mut before = stalled_at;
        loop {
            let taken = Some(self.mailbox.taken());
            // Created before the check, so that no signal is missed.
            let read = self.mailbox.read.notified();
            if self.mailbox.has_room(ROOM) {
                return None;
            }
            if taken == before {
                return before;
            }
            before = taken;
            // On timeout the next turn sees whether anything was read.
            let _ = timeout(PATIENCE, read).await;
        }
    }

    fn handle_record(&self, record: Record) -> Result<(), RecordError> {
        match record.head {
            Head::Deliver {
                flags,
                source,
                destination,
                sequence,
                path,
            } => {
                // A component that never reads has no more than its share of messages that stay.
                let stays = flags.acknowledgement() == Acknowledgement::Request
                    && self.mailbox.has_reserve(flags.priority());
                self.mailbox.deliver(Received {
                    source,
                    destination,
                    priority: flags.priority(),
                    broadcast: flags.broadcast().unwrap_or_default(),
                    // Components of one node have no numbers, and no path either.
                    sequence: path.map(|_| sequence),
                    payload: record.payload,
                    path,
                    to: self.id,
                    acknowledged: stays,
                });
            }
            Head::Progress { source } => self.mailbox.note_progress(now(), source),
            Head::Outcome { handle, outcome } => self.handle_outcome(handle, outcome, &record),
            _ => return Err(RecordError::Unexpected),
        }
        Ok(())
    }

    fn handle_outcome(&self, handle: u64, outcome: Outcome, record: &Record) {
        let outcome = match outcome {
            Outcome::Acknowledged => Ok(()),
            Outcome::NotAcknowledged(shortfall) => Err(shortfall.into()),
            Outcome::Rejected => Err(Undelivered::Rejected(record.text())),
        };
        let message = MessageHandle(handle);
        let waiter = self.lock().awaited.remove(message);
        if let Some(waiter) = waiter {
            waiter.notify(outcome);
        } else if let Err(Undelivered::Rejected(why)) = outcome {
            tracing::debug!(id = %self.id, why, "message not sent");
            self.events.send(HostEvent::Rejected { message, why });
        }
    }
}
