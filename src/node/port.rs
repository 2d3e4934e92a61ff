//! A component's port to the node: it sends here and reads its mailbox. The node is in the same
//! process, or in another one of the same host.

use std::any::Any;
use std::sync::Arc;
use std::task::{Context, Poll};

use tokio::sync::oneshot;

use super::attendance::Departure;
use super::awaiting::Waiter;
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
/// Sending never waits. What arrives waits in a bounded mailbox, the urgent first; what a full
/// one drops is said at [`MailboxLimits`](super::MailboxLimits).
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
        let (id, mailbox) = (client.id(), client.mailbox().clone());
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

    /// A way to send that can be given to other tasks.
    #[must_use]
    pub fn sender(&self) -> Sender {
        self.sender.clone()
    }

    /// Waits for the next message; `None` when the node has stopped. A component that is attached
    /// to the node of its host waits for that to come back instead.
    ///
    /// Nothing is lost if the returned future is dropped.
    pub async fn recv(&mut self) -> Option<Received> {
        std::future::poll_fn(|cx| self.poll_recv(cx)).await
    }

    /// The next message, if one waits.
    pub fn try_recv(&mut self) -> Option<Received> {
        self.mailbox.pop()
    }

    /// The same as [`recv`](Self::recv) for who writes futures by hand.
    pub fn poll_recv(&mut self, cx: &mut Context<'_>) -> Poll<Option<Received>> {
        self.mailbox.poll_pop(cx)
    }

    /// Makes a stopping node of the same process wait for a moment, so that the component can
    /// release what it holds.
    #[must_use]
    pub fn reside(&self) -> Resident {
        match &self.sender.way {
            Attachment::Here(shared) => Resident::of(&shared.residents),
            Attachment::Host(_) => Resident::elsewhere(),
        }
    }

    /// What the components of this process have in common on this node: one of each type. On the node
    /// of another process they have nothing in common.
    pub(crate) fn common<T: Any + Send + Sync + Default>(&self) -> Arc<T> {
        match &self.sender.way {
            Attachment::Here(shared) => shared.common(),
            Attachment::Host(_) => Arc::default(),
        }
    }

    /// What has become of the messages for this component.
    #[must_use]
    pub fn counters(&self) -> MailboxCounters {
        self.mailbox.counters()
    }

    /// Whether the node is there; see [`Sender::is_connected`].
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.sender.is_connected()
    }

    /// News from now on about the connection to the host's node; none for a node in the same process.
    #[must_use]
    pub fn host_events(&self) -> HostEvents {
        match &self.sender.way {
            Attachment::Here(_) => EventSender::new().subscribe(),
            Attachment::Host(client) => client.events(),
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

/// Sends for a component. Does not keep the node running, nor the component attached.
#[derive(Clone, Debug)]
pub struct Sender {
    id: JausId,
    way: Attachment,
}

/// Where the node is.
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

    /// Sends a message: when this returns, the datagram is with the operating system, or a local
    /// receiver has it in its mailbox. Of a burst that holds for the first message; the others leave
    /// together, as soon as the sender lets the node's task have a turn; those above standard
    /// priority never wait. To the node of another process, the message is on its way when this
    /// returns; what that node finds wrong with it comes as
    /// [`HostEvent::Rejected`](super::HostEvent::Rejected).
    ///
    /// # Errors
    /// What the endpoint says is wrong with the message; also when its source is not this
    /// component, or the node has stopped. [`SendError::NotConnected`] while the host's node is
    /// gone: nothing is kept for later, because commands that come late do harm.
    pub fn send(&self, message: Outgoing) -> Result<MessageHandle, SendError> {
        self.check_source(&message)?;
        match &self.way {
            Attachment::Here(shared) => shared.lock().send(message, None),
            Attachment::Host(client) => client.send(message, None),
        }
    }

    /// Sends a message that wants an acknowledgement, and waits for that. Dropping the future
    /// forgets the message, which may still arrive.
    ///
    /// # Errors
    /// [`Undelivered`] says what was not acknowledged, and why.
    pub async fn deliver(&self, mut message: Outgoing) -> Result<(), Undelivered> {
        self.check_source(&message)?;
        message.acknowledge = true;
        let (tell, told) = oneshot::channel();
        match &self.way {
            Attachment::Here(shared) => shared.lock().send(message, Some(Waiter::Here(tell))),
            Attachment::Host(client) => client.send(message, Some(tell)),
        }?;
        told.await.unwrap_or(Err(Undelivered::Lost))
    }

    /// Waits until the host's node has taken all that was sent. A node of the same process takes
    /// everything at once.
    pub async fn flushed(&self) {
        if let Attachment::Host(client) = &self.way {
            client.flushed().await;
        }
    }

    /// Whether the host's node is there. One of the same process always is, until it is stopped.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        match &self.way {
            Attachment::Here(shared) => !*shared.stopped.borrow(),
            Attachment::Host(client) => client.is_connected(),
        }
    }

    /// Waits until there is no connection to the node: it has stopped or is lost, or the component
    /// is detached and its last words to the host's node are written.
    pub async fn disconnected(&self) {
        match &self.way {
            Attachment::Here(shared) => {
                let mut stopped = shared.stopped.subscribe();
                // An error cannot be: the sender is in what we hold.
                let _ = stopped.wait_for(|stopped| *stopped).await;
            }
            Attachment::Host(client) => client.disconnected().await,
        }
    }

    fn check_source(&self, message: &Outgoing) -> Result<(), SendError> {
        if message.source == self.id {
            return Ok(());
        }
        Err(endpoint::SendError::UnknownSource(message.source).into())
    }
}
