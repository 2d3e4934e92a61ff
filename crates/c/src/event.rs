//! Events, as they wait for a program with its own loop and as the program sees them.

use std::ffi::CString;
use std::sync::Mutex;
use std::time::Instant;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::node::now;
use jaus::service::StopCause;
use jaus_binding::{EventQueue, Loss, Notice, ServiceKey, lock};

use crate::types::{JausEvent, JausEventKind};

/// An event, as the library keeps it.
#[derive(Debug, Clone)]
pub(crate) struct Event {
    pub(crate) kind: JausEventKind,
    pub(crate) source: JausId,
    pub(crate) subject: u64,
    pub(crate) value: u8,
    pub(crate) message: Bytes,
    pub(crate) text: CString,
    pub(crate) arrived: Option<Instant>,
    pub(crate) rate: f64,
    pub(crate) lost: u64,
}

impl Event {
    pub(crate) fn new(kind: JausEventKind, source: JausId) -> Self {
        Self {
            kind,
            source,
            subject: 0,
            value: 0,
            message: Bytes::new(),
            text: CString::default(),
            arrived: None,
            rate: 0.0,
            lost: 0,
        }
    }

    pub(crate) fn message(source: JausId, message: Bytes) -> Self {
        Self {
            message,
            ..Self::new(JausEventKind::Message, source)
        }
    }

    /// With a reason. It contains no 0, or none is given.
    pub(crate) fn because(self, reason: &dyn std::fmt::Display) -> Self {
        Self {
            text: CString::new(reason.to_string()).unwrap_or_default(),
            ..self
        }
    }

    /// The event as the program sees it, which is valid as long as this one.
    pub(crate) fn view(&self) -> JausEvent {
        JausEvent {
            kind: self.kind,
            value: self.value,
            source: self.source.into(),
            subject: self.subject,
            data: match self.message.is_empty() {
                true => std::ptr::null(),
                false => self.message.as_ptr(),
            },
            length: self.message.len(),
            text: self.text.as_ptr(),
            age: self
                .arrived
                .map_or(0.0, |arrived| (now() - arrived).as_secs_f64()),
            rate: self.rate,
            lost: self.lost,
        }
    }
}

/// The events of a component that wait for the program.
pub(crate) type Events = EventQueue<Event>;

impl Notice for Event {
    fn stopped(_: ServiceKey, component: JausId, cause: Option<&StopCause>) -> Self {
        let event = Self::new(JausEventKind::Stop, component);
        match cause {
            Some(cause) => event.because(cause),
            None => event,
        }
    }

    fn loss(&self) -> Loss {
        match self.kind {
            JausEventKind::Report => Loss::First,
            _ => Loss::Last,
        }
    }
}

/// The event that the program looks at.
#[derive(Default)]
pub(crate) struct Shown(Mutex<Option<Current>>);

/// An event with its view, which points into it.
struct Current(Box<(JausEvent, Event)>);

// SAFETY: the pointers of the view lead to the heap memory of the event beside it, which nothing else
// changes.
unsafe impl Send for Current {}

impl Shown {
    /// Ends the view of the last event.
    pub(crate) fn clear(&self) {
        *lock(&self.0) = None;
    }

    /// Shows an event until the next one is shown, or none. The pointer is null without one.
    pub(crate) fn show(&self, event: Option<Event>) -> *const JausEvent {
        let mut shown = lock(&self.0);
        // The octets of message and text are on the heap, so they stay where they are.
        *shown = event.map(|event| Current(Box::new((event.view(), event))));
        shown
            .as_ref()
            .map_or(std::ptr::null(), |current| &raw const current.0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_shown_until_the_next_one() {
        let shown = Shown::default();
        let event = Event::message(JausId::new(1, 1, 1), Bytes::from_static(&[9, 8]));
        let view = shown.show(Some(event));
        // SAFETY: the event is shown.
        let view = unsafe { view.as_ref() }.unwrap();
        assert_eq!((view.kind, view.length), (JausEventKind::Message, 2));
        // SAFETY: its message has two octets.
        assert_eq!(unsafe { *view.data }, 9);
        assert!(shown.show(None).is_null());
    }
}
