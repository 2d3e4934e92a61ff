//! Event streams of a node, its components and connections: any number of listeners, none of which
//! can block the sender.

use std::fmt;

use tokio::sync::broadcast;
use tokio::sync::broadcast::error::RecvError;

use crate::endpoint::Remote;
use crate::rights::Decided;

/// Events kept for a slow listener.
const KEPT: usize = 256;

/// A stream of the events since it was opened. A listener that lags by more than 256 events misses
/// the oldest.
#[derive(Debug)]
pub struct EventStream<T> {
    receiver: broadcast::Receiver<T>,
    missed: u64,
}

impl<T: Clone> EventStream<T> {
    /// Waits for the next event; `None` at the end of the stream.
    pub async fn recv(&mut self) -> Option<T> {
        loop {
            match self.receiver.recv().await {
                Ok(event) => return Some(event),
                Err(RecvError::Lagged(missed)) => self.missed += missed,
                Err(RecvError::Closed) => return None,
            }
        }
    }

    /// The number of missed events.
    #[must_use]
    pub const fn missed(&self) -> u64 {
        self.missed
    }
}

/// The sender of events, until it is [ended](Self::end) or dropped.
#[derive(Debug)]
pub(super) struct EventSender<T>(Option<broadcast::Sender<T>>);

impl<T: Clone> Default for EventSender<T> {
    fn default() -> Self {
        Self(Some(broadcast::Sender::new(KEPT)))
    }
}

impl<T: Clone> EventSender<T> {
    pub(super) fn send(&self, event: T) {
        if let Some(sender) = &self.0 {
            // It is no error to have no listeners.
            let _ = sender.send(event);
        }
    }

    pub(super) fn subscribe(&self) -> EventStream<T> {
        let ended = || broadcast::channel(1).1;
        let subscribe = broadcast::Sender::subscribe;
        EventStream {
            receiver: self.0.as_ref().map_or_else(ended, subscribe),
            missed: 0,
        }
    }

    /// Ends the listeners' streams.
    pub(super) fn end(&mut self) {
        self.0 = None;
    }
}

/// Takes the decisions on messages of clients, such as those of plain links.
pub trait DecisionRecorder<C = Remote>: Send {
    /// Records a decision. It must not block.
    fn record(&mut self, decided: Decided<C>);

    /// Whether what changes something is to be refused now, because it could not be recorded.
    fn refuses_commands(&self) -> bool;
}

/// The recorder of a node, or of a program that decides itself what its clients may do.
pub struct Recorder<C = Remote>(Box<dyn DecisionRecorder<C>>);

impl<C> Recorder<C> {
    /// Wraps a recorder.
    pub fn new(recorder: impl DecisionRecorder<C> + 'static) -> Self {
        Self(Box::new(recorder))
    }

    /// Records decisions.
    pub fn record_all(&mut self, decisions: impl IntoIterator<Item = Decided<C>>) {
        decisions.into_iter().for_each(|it| self.0.record(it));
    }

    /// Whether what changes something is to be refused now, because it could not be recorded.
    #[must_use]
    pub fn refuses_commands(&self) -> bool {
        self.0.refuses_commands()
    }
}

impl<C> fmt::Debug for Recorder<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Recorder")
    }
}
