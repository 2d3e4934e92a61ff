//! A component's port to the node: it sends messages through it and reads its mailbox. The node is
//! in the same process, or in another process of the same host.

use std::any::Any;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Instant;

use tokio::sync::oneshot;

use super::awaiting::Waiter;
use super::components::Departure;
use super::core::Shared;
use super::events::EventSender;
use super::host::{Client, HostEvents};
use super::mailbox::{Mailbox, MailboxCounters};
use super::resident::Resident;
use super::{Guard, SendError, Undelivered};
use crate::address::JausId;
use crate::endpoint::{self, MessageHandle, Outgoing, Received};

/// An attached component, until it is dropped.
///
/// Sending never waits. Received messages wait in a bounded mailbox, most urgent first; a full
/// mailbox drops messages, see [`MailboxLimits`](super::MailboxLimits).
///
/// ```no_run
/// # use jaus::endpoint::Outgoing;
/// # use jaus::node::{Port, SendError};
/// # async fn example(mut port: Port) -> Result<(), SendError> {
/// while let Some(message) = port.recv().await {
///     println!("{} octets from {}", message.payload.len(), message.source);
///     port.send(Outgoing::new(port.id(), message.source, message.payload))?;
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Port {
    sender: Sender,
    mailbox: Arc<Mailbox>,
    /// Keeps a node of the same process running.
    _guard: Option<Arc<Guard>>,
}

impl Port {
    pub(super) fn new(id: JausId, mailbox: Arc<Mailbox>, guard: Arc<Guard>) -> Self {
        let way = Attachment::Here(guard.0.clone());
        Self {
            sender: Sender { id, way },
            mailbox,
            _guard: Some(guard),
        }
    }

    pub(super) fn to_host(client: Arc<Client>) -> Self {
        let (id, mailbox) = (client.id, client.mailbox.clone());
        let way = Attachment::Host(client);
        Self {
            sender: Sender { id, way },
            mailbox,
            _guard: None,
        }
    }

    /// The component's id.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.sender.id
    }

    /// Sends a message; see [`Sender::send`].
    ///
    /// # Errors
    /// Those of [`Sender::send`].
    pub fn send(&self, message: Outgoing) -> Result<MessageHandle, SendError> {
        self.sender.send(message)
    }

    /// Sends a message and waits for its acknowledgement; see [`Sender::deliver`].
    ///
    /// # Errors
    /// Those of [`Sender::deliver`].
    pub async fn deliver(&self, message: Outgoing) -> Result<(), Undelivered> {
        self.sender.deliver(message).await
    }

    /// A sender that can be moved to other tasks.
    #[must_use]
    pub fn sender(&self) -> Sender {
        self.sender.clone()
    }

    /// Waits for the next message; `None` when the node has stopped. A component on the node of its
    /// host waits for the node to come back instead.
    ///
    /// Cancel safe: dropping the returned future loses nothing.
    pub async fn recv(&mut self) -> Option<Received> {
        std::future::poll_fn(|cx| self.poll_recv(cx)).await
    }

    /// The next message, if one waits.
    pub fn try_recv(&mut self) -> Option<Received> {
        self.mailbox.pop()
    }

    /// Like [`recv`](Self::recv), for hand-written futures.
    pub fn poll_recv(&mut self, cx: &mut Context<'_>) -> Poll<Option<Received>> {
        self.mailbox.poll_pop(cx)
    }

    /// Makes a stopping node of the same process wait a moment, so that the component can release
    /// what it holds.
    #[must_use]
    pub fn reside(&self) -> Resident {
        match &self.sender.way {
            Attachment::Here(shared) => shared.residents.admit(),
            Attachment::Host(_) => Resident(None),
        }
    }

    /// Data that the components of this process share on this node: one value of each type. On the
    /// node of another process they share nothing.
    pub(crate) fn common<T: Any + Send + Sync + Default>(&self) -> Arc<T> {
        match &self.sender.way {
            Attachment::Here(shared) => shared.common(),
            Attachment::Host(_) => Arc::default(),
        }
    }

    /// When a part of a large message last arrived from this peer for the component. A component on
    /// the node of another process learns of it at most 50 ms later.
    pub(crate) fn last_fragment(&self, peer: JausId) -> Option<Instant> {
        self.mailbox.last_fragment(peer)
    }

    /// Counts of the messages for this component.
    #[must_use]
    pub fn counters(&self) -> MailboxCounters {
        self.mailbox.counters()
    }

    /// Whether the node is reachable; see [`Sender::is_connected`].
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.sender.is_connected()
    }

    /// Events from now on of the connection to the host's node; none for a node in the same
    /// process.
    #[must_use]
    pub fn host_events(&self) -> HostEvents {
        match &self.sender.way {
            Attachment::Here(_) => EventSender::default().subscribe(),
            Attachment::Host(client) => client.events.subscribe(),
        }
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        match &self.sender.way {
            Attachment::Here(shared) => {
                let mut core = shared.lock();
                core.detach(self.sender.id, &self.mailbox, Departure::Left);
            }
            Attachment::Host(client) => client.leave(),
        }
    }
}

/// Sends for a component. Keeps neither the node running nor the component attached.
///
/// ```no_run
/// # use jaus::address::JausId;
/// # use jaus::endpoint::Outgoing;
/// # use jaus::node::{Port, Undelivered};
/// # async fn example(port: &Port, peer: JausId) -> Result<(), Undelivered> {
/// let sender = port.sender();
/// let resume = Outgoing::new(sender.id(), peer, vec![0x04, 0x00].into());
/// sender.deliver(resume).await?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Sender {
    id: JausId,
    way: Attachment,
}

/// The location of the node.
#[derive(Clone, Debug)]
enum Attachment {
    Here(Arc<Shared>),
    Host(Arc<Client>),
}

impl Sender {
    /// The component's id.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.id
    }

    /// Sends a message. When this returns, the operating system has the datagram, or a local
    /// receiver has it in its mailbox. In a burst this holds for the first message; the others
    /// leave together, as soon as the sender yields to the node's task. Messages above standard
    /// priority never wait. For the node of another process, the message is in transit when this
    /// returns; an error of that node arrives as
    /// [`HostEvent::Rejected`](super::HostEvent::Rejected).
    ///
    /// # Errors
    /// The endpoint's error for this message; also if its source is not this component, or the node
    /// has stopped. [`SendError::NotConnected`] while the host's node is gone: nothing is queued,
    /// because late commands do harm.
    pub fn send(&self, message: Outgoing) -> Result<MessageHandle, SendError> {
        self.transmit(message, None)
    }

    /// Sends a message with acknowledgement, and waits for it. Dropping the future cancels the
    /// message: it is not sent any more, neither for the first time nor again, and so reaches no
    /// component that attaches under the destination's id later. Copies that are already on the
    /// way may still arrive.
    ///
    /// # Errors
    /// [`Undelivered`] tells what was not acknowledged, and why.
    pub async fn deliver(&self, mut message: Outgoing) -> Result<(), Undelivered> {
        message.acknowledge = true;
        let destination = message.destination;
        let (waiter, outcome) = oneshot::channel();
        let message = self.transmit(message, Some(Waiter::Here(waiter)))?;
        let mut delivery = Delivery {
            sender: self,
            destination,
            message: Some(message),
        };
        let outcome = outcome.await;
        delivery.message = None;
        outcome.unwrap_or(Err(Undelivered::Lost))
    }

    /// Passes the messages of a burst to the operating system without waiting for the node's task. Without
    /// effect for the node of another process.
    pub(crate) fn flush(&self) {
        if let Attachment::Here(shared) = &self.way {
            shared.lock().send_gathered();
        }
    }

    /// Waits until all messages sent so far are written to the connection to the host's node, or it
    /// is lost. For a node of the same process, returns at once.
    pub async fn flushed(&self) {
        if let Attachment::Host(client) = &self.way {
            client.flushed().await;
        }
    }

    /// Whether the host's node is reachable. A node of the same process always is, until it is
    /// stopped.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        match &self.way {
            Attachment::Here(shared) => !*shared.stopped.borrow(),
            Attachment::Host(client) => client.is_connected(),
        }
    }

    /// Waits until there is no connection to the node: the node has stopped or is lost, or the
    /// component is detached and its last records to the host's node are written.
    pub async fn disconnected(&self) {
        match &self.way {
            Attachment::Here(shared) => shared.stopped().await,
            Attachment::Host(client) => client.disconnected().await,
        }
    }

    fn transmit(
        &self,
        message: Outgoing,
        waiter: Option<Waiter>,
    ) -> Result<MessageHandle, SendError> {
        if message.source != self.id {
            return Err(endpoint::SendError::UnknownSource(message.source).into());
        }
        match &self.way {
            Attachment::Here(shared) => shared.lock().send(message, waiter),
            Attachment::Host(client) => client.send(message, waiter),
        }
    }
}

/// A message whose outcome is awaited. Dropped before the outcome, it is cancelled.
struct Delivery<'a> {
    sender: &'a Sender,
    destination: JausId,
    /// `None` once the outcome is known.
    message: Option<MessageHandle>,
}

impl Drop for Delivery<'_> {
    fn drop(&mut self) {
        let Some(message) = self.message else {
            return;
        };
        match &self.sender.way {
            Attachment::Here(shared) => shared.lock().cancel(self.destination, message),
            Attachment::Host(client) => client.cancel(message),
        }
    }
}
