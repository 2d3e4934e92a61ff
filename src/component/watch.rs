//! What an application can listen to: changes of the directory, and messages that no service
//! handles.

use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;

use crate::endpoint::Received;
use crate::service::Change;

/// Changes of the directory, from when it was asked for.
#[derive(Debug)]
pub struct Watch(Listener<Change>);

/// Messages that no service of the component handles, from when it was asked for.
#[derive(Debug)]
pub struct Messages(Listener<Received>);

/// A receiver that counts what it was too slow for.
#[derive(Debug)]
pub(super) struct Listener<T> {
    receiver: Option<Receiver<T>>,
    missed: u64,
}

impl Watch {
    pub(super) const fn new(listener: Listener<Change>) -> Self {
        Self(listener)
    }

    /// Waits for the next change; `None` when the component has stopped.
    pub async fn next(&mut self) -> Option<Change> {
        self.0.next().await
    }

    /// How many changes were lost because this was not asked often enough. The directory itself
    /// is always right.
    #[must_use]
    pub const fn missed(&self) -> u64 {
        self.0.missed
    }
}

impl Messages {
    pub(super) const fn new(listener: Listener<Received>) -> Self {
        Self(listener)
    }

    /// Waits for the next message; `None` when the component has stopped.
    pub async fn next(&mut self) -> Option<Received> {
        self.0.next().await
    }

    /// How many messages were lost because this was not asked often enough.
    #[must_use]
    pub const fn missed(&self) -> u64 {
        self.0.missed
    }
}

impl<T: Clone> Listener<T> {
    /// A listener; to nothing if the sender is gone.
    pub(super) const fn new(receiver: Option<Receiver<T>>) -> Self {
        Self {
            receiver,
            missed: 0,
        }
    }

    async fn next(&mut self) -> Option<T> {
        let receiver = self.receiver.as_mut()?;
        loop {
            match receiver.recv().await {
                Ok(next) => return Some(next),
                Err(RecvError::Lagged(missed)) => self.missed += missed,
                Err(RecvError::Closed) => return None,
            }
        }
    }
}
