//! Streams for the application: changes of the directory, and messages that no service handles.

use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::broadcast::error::RecvError;
use tokio::sync::broadcast::{Receiver, Sender};

use crate::endpoint::Received;
use crate::service::Change;

/// Changes of the directory since its creation.
///
/// ```no_run
/// # async fn example(operator: jaus::component::Component) {
/// let mut changes = operator.watch();
/// while let Some(change) = changes.next().await {
///     println!("{change:?}; {} changes missed", changes.missed());
/// }
/// # }
/// ```
#[derive(Debug)]
pub struct Watch(Listener<Change>);

/// Messages since its creation that no service of the component handles.
///
/// ```no_run
/// # use jaus::codec::Message;
/// # use jaus::messages::core::ReportStatus;
/// # async fn example(operator: jaus::component::Component) {
/// let mut messages = operator.messages();
/// while let Some(message) = messages.next().await {
///     if let Ok(status) = ReportStatus::decode(&message.payload) {
///         println!("{}: {status:?}", message.source);
///     }
/// }
/// # }
/// ```
#[derive(Debug)]
pub struct Messages(Listener<Received>);

/// The sender for any number of listeners. It allocates nothing while there is none, because most
/// of a node's components have no listener.
#[derive(Debug)]
pub(super) struct Outlet<T> {
    state: Mutex<State<T>>,
    capacity: usize,
}

#[derive(Debug)]
enum State<T> {
    Quiet,
    Heard(Sender<T>),
    Ended,
}

impl<T: Clone> Outlet<T> {
    /// An outlet that keeps up to `capacity` items for a slow listener.
    pub(super) const fn new(capacity: usize) -> Self {
        Self {
            state: Mutex::new(State::Quiet),
            capacity,
        }
    }

    pub(super) fn listen(&self) -> Listener<T> {
        let mut state = self.lock();
        if matches!(*state, State::Quiet) {
            *state = State::Heard(Sender::new(self.capacity));
        }
        let receiver = match &*state {
            State::Heard(sender) => Some(sender.subscribe()),
            State::Quiet | State::Ended => None,
        };
        Listener {
            receiver,
            missed: 0,
        }
    }

    pub(super) fn send(&self, news: T) {
        let mut state = self.lock();
        // An error means that the last listener is gone.
        if let State::Heard(sender) = &*state
            && sender.send(news).is_err()
        {
            *state = State::Quiet;
        }
    }

    /// Ends the streams: listeners get the queued items, and then the end.
    pub(super) fn end(&self) {
        *self.lock() = State::Ended;
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A receiver that counts the items it was too slow for.
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

    /// The number of changes lost because [`next`](Self::next) was not called often enough. The
    /// directory itself is always complete.
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

    /// The number of messages lost because [`next`](Self::next) was not called often enough.
    #[must_use]
    pub const fn missed(&self) -> u64 {
        self.0.missed
    }
}

impl<T: Clone> Listener<T> {
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
