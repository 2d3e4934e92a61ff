//! Where events go: to a callback, or into the queue of the component.

use std::ffi::c_void;
use std::sync::Arc;

use crate::callback::{Callback, EventFunction};
use crate::event::{Event, EventQueue};
use crate::types::JausEventCallback;
use crate::watchdog::Watchdog;

/// The receiver of events of one kind.
#[derive(Clone)]
pub(crate) enum Sink {
    Callback(Arc<Callback<EventFunction>>),
    Queue(Arc<EventQueue>),
}

impl Sink {
    /// The callback, or the queue if there is none.
    ///
    /// # Safety
    /// As for [`Callback::new`].
    pub(crate) unsafe fn new(
        callback: JausEventCallback,
        user: *mut c_void,
        queue: &Arc<EventQueue>,
        watchdog: Arc<Watchdog>,
    ) -> Self {
        match callback {
            Some(function) => {
                // SAFETY: as the caller guarantees.
                let callback = unsafe { Callback::new(function, user, watchdog) };
                Self::Callback(Arc::new(callback))
            }
            None => Self::Queue(queue.clone()),
        }
    }

    pub(crate) fn tell(&self, event: Event) {
        match self {
            Self::Callback(callback) => callback.tell(&event),
            Self::Queue(queue) => queue.push(event),
        }
    }

    pub(crate) fn close(&self) {
        if let Self::Callback(callback) = self {
            callback.close();
        }
    }
}
