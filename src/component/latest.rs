//! Sends a component's messages, and cancels the setpoints that they supersede.

use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

use crate::address::JausId;
use crate::endpoint::{MessageHandle, Outgoing};
use crate::node::{self, SendError, Undelivered};
use crate::service::{is_stop, series_of};

/// Of the setpoints that one component sends to one peer with acknowledgement, only the newest of
/// each series is retransmitted: a newer one cancels it, and so does a stop. A retransmission would
/// otherwise arrive after what was sent since, and the receiver could take it for the newest.
#[derive(Debug, Clone)]
pub(super) struct LatestSender {
    sender: node::Sender,
    setpoints: Arc<Mutex<Vec<Unacknowledged>>>,
}

/// A setpoint that waits for its acknowledgement.
#[derive(Debug)]
struct Unacknowledged {
    peer: JausId,
    series: (u16, u8),
    /// Dropping it cancels the setpoint. Closed once the setpoint no longer waits.
    waits: oneshot::Sender<Infallible>,
}

impl LatestSender {
    pub(super) fn new(sender: node::Sender) -> Self {
        Self {
            sender,
            setpoints: Arc::default(),
        }
    }

    pub(super) const fn id(&self) -> JausId {
        self.sender.id()
    }

    /// Sends a message without acknowledgement.
    pub(super) fn send(&self, message: Outgoing) -> Result<MessageHandle, SendError> {
        self.supersede(&message);
        self.sender.send(message)
    }

    /// Passes the messages sent so far to the operating system.
    pub(super) fn flush(&self) {
        self.sender.flush();
    }

    /// Sends a message, and waits until it is acknowledged or superseded.
    pub(super) async fn deliver(&self, message: Outgoing) -> Result<(), Undelivered> {
        self.supersede(&message);
        let Some(series) = series_of(&message.payload) else {
            return self.sender.deliver(message).await;
        };
        let (waits, superseded) = oneshot::channel();
        self.lock().push(Unacknowledged {
            peer: message.destination,
            series,
            waits,
        });
        tokio::select! {
            biased;
            _ = superseded => Err(Undelivered::Superseded),
            outcome = self.sender.deliver(message) => outcome,
        }
    }

    /// Cancels the setpoints that a message supersedes.
    pub(super) fn supersede(&self, message: &Outgoing) {
        let (series, stops) = (series_of(&message.payload), is_stop(&message.payload));
        if series.is_none() && !stops {
            return;
        }
        self.lock().retain(|it| {
            let is_superseded = stops || series == Some(it.series);
            let is_of_peer = message.destination.matches(it.peer);
            !(it.waits.is_closed() || is_superseded && is_of_peer)
        });
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Unacknowledged>> {
        self.setpoints
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
