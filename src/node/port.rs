//! A component's door to the node: it sends here and reads its mailbox.

use std::sync::Arc;
use std::task::{Context, Poll};

use super::core::Shared;
use super::mailbox::{Mailbox, MailboxCounters};
use super::{Guard, SendError};
use crate::address::JausId;
use crate::endpoint::{MessageHandle, Outgoing, Received};

/// An attached component, until it is dropped.
///
/// Sending never waits. What arrives waits in a bounded mailbox, the urgent first; what a full
/// one drops is said at [`MailboxLimits`](super::MailboxLimits).
#[derive(Debug)]
pub struct Port {
    sender: Sender,
    mailbox: Arc<Mailbox>,
    /// Keeps the node running.
    _guard: Arc<Guard>,
}

impl Port {
    pub(super) fn new(id: JausId, mailbox: Arc<Mailbox>, guard: Arc<Guard>) -> Self {
        let sender = Sender {
            id,
            shared: guard.0.clone(),
        };
        Self {
            sender,
            mailbox,
            _guard: guard,
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

    /// A way to send that can be given to other tasks.
    #[must_use]
    pub fn sender(&self) -> Sender {
        self.sender.clone()
    }

    /// Waits for the next message; `None` when the node has stopped.
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

    /// What has become of the messages for this component.
    #[must_use]
    pub fn counters(&self) -> MailboxCounters {
        self.mailbox.counters()
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        self.sender.shared.lock().detach(self.sender.id);
    }
}

/// Sends for a component. Does not keep the node running, nor the component attached.
#[derive(Clone, Debug)]
pub struct Sender {
    id: JausId,
    shared: Arc<Shared>,
}

impl Sender {
    /// The component's id.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.id
    }

    /// Sends a message, up to the network's door: when this returns, the datagram is with the
    /// operating system, or a local receiver has it in its mailbox.
    ///
    /// # Errors
    /// What the endpoint says is wrong with the message; [`SendError::UnknownSource`] also when
    /// its source is not this component, or the node has stopped.
    pub fn send(&self, message: Outgoing) -> Result<MessageHandle, SendError> {
        if message.source != self.id {
            return Err(SendError::UnknownSource(message.source));
        }
        self.shared.lock().send(message)
    }
}
