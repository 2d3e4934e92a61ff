//! Where events go: to a callback, or into the queue of the component.

use std::ffi::c_void;
use std::sync::Arc;

use crate::callback::{Callback, EventFunction};
use jaus_binding::ServiceKey;

use crate::event::{Event, Events};
use crate::types::JausEventCallback;
use crate::watchdog::Watchdog;

/// The receiver of events of one kind.
#[derive(Clone)]
pub(crate) enum Sink {
    Callback(Arc<Callback<EventFunction>>),
    Queue(Arc<Events>),
}

impl Sink {
    /// The callback, or the queue if there is none.
    ///
    /// # Safety
    /// As for [`Callback::new`].
    pub(crate) unsafe fn new(
        callback: JausEventCallback,
        user: *mut c_void,
        queue: &Arc<Events>,
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

    /// Passes on a message for a service.
    pub(crate) fn tell_message(&self, event: Event) {
        match self {
            Self::Callback(callback) => callback.tell(&event),
            Self::Queue(queue) => queue.push_in_time(event),
        }
    }

    /// Passes on a command for a service.
    pub(crate) fn tell_command(&self, service: ServiceKey, event: Event) {
        match self {
            Self::Callback(callback) => callback.tell(&event),
            Self::Queue(queue) => queue.push_command(service, event),
        }
    }

    pub(crate) fn close(&self) {
        if let Self::Callback(callback) = self {
            callback.close();
        }
    }
}
