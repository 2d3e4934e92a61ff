//! The connection of a component to its host's node: what senders share with the task that reads and
//! writes, and reaches the node again when it is lost.

use std::collections::HashMap;
use std::convert::Infallible;
use std::future::poll_fn;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::sync::{Notify, oneshot, watch};
use tokio::time::{sleep, timeout};

use super::super::events::EventSender;
use super::super::mailbox::Mailbox;
use super::super::{HostError, SendError, Undelivered};
use super::{Attached, Host, HostEvent, HostEvents};
use crate::address::JausId;
use crate::endpoint::{self, MessageHandle, Outgoing, Received};
use crate::link::local::record::{Head, Outcome, Record, RecordError};
use crate::link::local::{Error, Reader, Writer};
use crate::wire::{Acknowledgement, Flags};

/// Octets that may wait for the node. A single larger message is accepted when nothing else waits.
const MAX_WAITING: usize = 4 << 20;
/// Messages that may wait for an acknowledgement.
const MAX_AWAITED: usize = 4096;
/// Messages that one read may bring at most, nearly: before it, so many must fit.
const ROOM: usize = 1024;
/// How long a component that reads nothing holds up what comes behind, such as the outcomes of the
/// messages that it has sent.
const PATIENCE: Duration = Duration::from_millis(100);
/// How long a node may take to read that a component leaves.
const LEAVE: Duration = Duration::from_secs(1);
/// The pauses between two attempts to reach the node again, the first and the longest.
const PAUSES: (Duration, Duration) = (Duration::from_millis(10), Duration::from_secs(1));

/// The component's connection.
#[derive(Debug)]
pub(in super::super) struct Client {
    id: JausId,
    inner: Mutex<Inner>,
    mailbox: Arc<Mailbox>,
    events: EventSender<HostEvent>,
    status: watch::Sender<Status>,
    /// Signalled when nothing waits any more: all is written, or there is no connection.
    emptied: Notify,
}

#[derive(Debug)]
struct Inner {
    writer: Writer,
    max_message: usize,
    sent: u64,
    awaited: HashMap<u64, oneshot::Sender<Result<(), Undelivered>>>,
}

/// Whether component and node are there. It changes under the lock of [`Inner`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Status {
    Connected,
    /// There is no node.
    Lost,
    /// The component has been dropped; the node is to be told.
    Leaving,
    /// The component is gone.
    Left,
}

impl Client {
    pub(super) fn start(host: Host, attached: Attached) -> Arc<Self> {
        let client = Arc::new(Self {
            id: attached.id,
            inner: Mutex::new(Inner {
                writer: attached.writer,
                max_message: attached.max_message,
                sent: 0,
                awaited: HashMap::new(),
            }),
            mailbox: Arc::new(Mailbox::new(host.limits)),
            events: EventSender::new(),
            status: watch::Sender::new(Status::Connected),
            emptied: Notify::new(),
        });
        tokio::spawn(client.clone().run(host, attached.reader));
        client
    }

    pub(in super::super) const fn id(&self) -> JausId {
        self.id
    }

    pub(in super::super) const fn mailbox(&self) -> &Arc<Mailbox> {
        &self.mailbox
    }

    pub(in super::super) fn is_connected(&self) -> bool {
        self.status.borrow().is_connected()
    }

    pub(in super::super) fn events(&self) -> HostEvents {
        self.events.subscribe()
    }

    /// Sends a message: it is on its way to the node. `waiter` gets the outcome, if the message
    /// wants an acknowledgement.
    pub(in super::super) fn send(
        &self,
        message: Outgoing,
        waiter: Option<oneshot::Sender<Result<(), Undelivered>>>,
    ) -> Result<MessageHandle, SendError> {
        let mut inner = self.lock();
        self.check(&inner, &message)?;
        inner.sent += 1;
        let handle = inner.sent;
        if let Some(waiter) = waiter {
            inner.await_outcome(handle, waiter)?;
        }
        let acknowledgement = if message.acknowledge {
            Acknowledgement::Request
        } else {
            Acknowledgement::None
        };
        let flags = Flags::new(message.priority).with_broadcast(message.broadcast);
        let head = Head::Send {
            flags: flags.with_acknowledgement(acknowledgement),
            handle,
            destination: message.destination,
        };
        let payload = message.payload;
        inner.writer.send_now(&Record { head, payload });
        if inner.writer.is_empty() {
            self.emptied.notify_waiters();
        }
        Ok(MessageHandle(handle))
    }

    /// Finds what is wrong with a message without asking the node.
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

    /// Ready when the node has taken all that was sent, or is lost.
    pub(in super::super) async fn flushed(&self) {
        // Created before the look, so that nothing is missed; once nothing waits, what was sent
        // before is written, whatever others have added since.
        let emptied = self.emptied.notified();
        let waits = !self.lock().writer.is_empty();
        if waits {
            emptied.await;
        }
    }

    /// Ready when there is no connection, or none any more.
    pub(in super::super) async fn disconnected(&self) {
        self.reached(|status| !status.is_connected()).await;
    }

    /// The component leaves.
    pub(in super::super) fn leave(&self) {
        let mut inner = self.lock();
        inner.awaited.clear();
        inner.writer.send(&Head::Leave.into());
        self.status.send_modify(|status| *status = Status::Leaving);
        drop(inner);
        self.mailbox.close();
    }

    async fn reached(&self, wanted: impl Fn(Status) -> bool) {
        let mut status = self.status.subscribe();
        // An error cannot be: the sender is here.
        let _ = status.wait_for(|status| wanted(*status)).await;
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads and writes until the component has left.
    async fn run(self: Arc<Self>, host: Host, mut reader: Reader) {
        let leaving = || self.reached(|status| status == Status::Leaving);
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
            tracing::warn!(id = %self.id, %error, "the node of this host is lost");
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

    /// There is no connection any more. What was not written is lost, and no outcome will come of
    /// what was.
    fn handle_lost(&self, status: Status) {
        let mut inner = self.lock();
        inner.writer.close();
        inner.awaited.clear();
        self.emptied.notify_waiters();
        self.status.send_if_modified(|now| {
            let stays = (*now, status) == (Status::Leaving, Status::Lost);
            if !stays {
                *now = status;
            }
            !stays
        });
    }

    /// Tries until the node, or its successor, has the component again.
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
                    tracing::warn!(id = %self.id, why, "not attached again");
                    refused = Some(why.clone());
                    self.events.send(HostEvent::Refused { why });
                }
                Err(error) => tracing::debug!(%error, "no node yet"),
            }
        }
    }

    /// Writes what senders leave. Ready when the component has left and all is written.
    fn poll_write(&self, cx: &mut Context<'_>) -> Poll<Result<(), Error>> {
        let mut inner = self.lock();
        ready!(inner.writer.poll_flush(cx))?;
        self.emptied.notify_waiters();
        match *self.status.borrow() {
            Status::Leaving => Poll::Ready(Ok(())),
            _ => Poll::Pending,
        }
    }

    /// Reads what the node writes, until it is gone.
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

    /// Lets a component that reads, if slowly, catch up before more is read for it. One that reads
    /// nothing is not waited for a second time: the result says how much it had read then.
    async fn catch_up(&self, stalled_at: Option<u64>) -> Option<u64> {
        let room = || poll_fn(|cx| self.mailbox.poll_room(cx, ROOM));
        let mut taken = stalled_at;
        while !self.mailbox.has_room(ROOM) {
            let now = Some(self.mailbox.taken());
            if taken == now {
                return now;
            }
            taken = now;
            // Whether there is room then is seen above.
            let _ = timeout(PATIENCE, room()).await;
        }
        None
    }

    fn handle_record(&self, record: Record) -> Result<(), RecordError> {
        match record.head {
            Head::Deliver {
                flags,
                source,
                destination,
                path,
            } => {
                self.mailbox.push(Received {
                    source,
                    destination,
                    priority: flags.priority(),
                    broadcast: flags.broadcast().unwrap_or_default(),
                    payload: record.payload,
                    path,
                    to: self.id,
                });
                Ok(())
            }
            Head::Outcome { handle, outcome } => {
                self.handle_outcome(handle, outcome, &record);
                Ok(())
            }
            _ => Err(RecordError::Unexpected),
        }
    }

    fn handle_outcome(&self, handle: u64, outcome: Outcome, record: &Record) {
        let outcome = match outcome {
            Outcome::Acknowledged => Ok(()),
            Outcome::NotAcknowledged {
                reason,
                destination,
                acknowledged,
                length,
            } => Err(Undelivered::NotAcknowledged {
                destination,
                reason,
                acknowledged: acknowledged as usize,
                length: length as usize,
            }),
            Outcome::Rejected => Err(Undelivered::Rejected(record.text())),
        };
        let waiter = self.lock().awaited.remove(&handle);
        if let Some(waiter) = waiter {
            // An error means that the sender waits no more.
            let _ = waiter.send(outcome);
        } else if let Err(Undelivered::Rejected(why)) = outcome {
            tracing::debug!(id = %self.id, why, "message not sent");
            let message = MessageHandle(handle);
            self.events.send(HostEvent::Rejected { message, why });
        }
    }
}

impl Inner {
    fn await_outcome(
        &mut self,
        handle: u64,
        waiter: oneshot::Sender<Result<(), Undelivered>>,
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
}

impl Status {
    const fn is_connected(self) -> bool {
        matches!(self, Self::Connected | Self::Leaving)
    }
}
