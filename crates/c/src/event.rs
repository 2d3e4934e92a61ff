//! Events, and the queue in which they wait for a program with its own loop.

use std::collections::VecDeque;
use std::ffi::CString;
use std::io::{Read, Write};
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::net::UnixStream;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::node::now;

use crate::lock::lock;
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
    /// Whether the program must fetch it in time.
    const fn is_urgent(&self) -> bool {
        matches!(self.kind, JausEventKind::Message | JausEventKind::Stop)
    }

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

/// The events that wait for the program. Its descriptor is readable while some wait.
pub(crate) struct EventQueue {
    state: Mutex<State>,
    added: Condvar,
    /// The end that the program waits for.
    readable: UnixStream,
}

struct State {
    /// With the time at which each was queued.
    events: VecDeque<(Instant, Event)>,
    dropped: u64,
    /// When the program last came for an event.
    fetched: Instant,
    /// How many threads wait for an event.
    waiting: usize,
    has_ended: bool,
    signal: UnixStream,
    is_signalled: bool,
    /// The event that the program looks at. The view points into the event.
    current: Option<Box<(JausEvent, Event)>>,
}

// SAFETY: the pointers in `current` lead to the heap memory of the event beside them, which nothing
// else changes.
unsafe impl Send for State {}

/// Whether the program comes for its events.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Attention {
    /// When it last came; now, if it is waiting for an event.
    pub(crate) fetched: Instant,
    /// Since when a message for a service, or the news of a stop, has been waiting.
    pub(crate) due: Option<Instant>,
}

impl EventQueue {
    /// Limit of events that wait.
    const MOST: usize = 1024;

    pub(crate) fn new() -> std::io::Result<Self> {
        let (readable, signal) = UnixStream::pair()?;
        readable.set_nonblocking(true)?;
        signal.set_nonblocking(true)?;
        Ok(Self {
            state: Mutex::new(State {
                events: VecDeque::new(),
                dropped: 0,
                fetched: now(),
                waiting: 0,
                has_ended: false,
                signal,
                is_signalled: false,
                current: None,
            }),
            added: Condvar::new(),
            readable,
        })
    }

    pub(crate) fn descriptor(&self) -> RawFd {
        self.readable.as_raw_fd()
    }

    /// Queues an event. In a full queue the oldest report is dropped, or else the oldest event.
    pub(crate) fn push(&self, event: Event) {
        let mut state = self.lock();
        if state.events.len() >= Self::MOST {
            let is_report = |(_, event): &(Instant, Event)| event.kind == JausEventKind::Report;
            let oldest = state.events.iter().position(is_report).unwrap_or_default();
            state.events.remove(oldest);
            state.dropped += 1;
        }
        state.events.push_back((now(), event));
        state.signal();
        self.added.notify_one();
    }

    /// Makes the descriptor readable, so that a program that waits for it comes and shows that it
    /// still can.
    pub(crate) fn beat(&self) {
        self.lock().signal();
    }

    /// Ends the queue: what waits can still be fetched.
    pub(crate) fn end(&self) {
        let mut state = self.lock();
        state.has_ended = true;
        state.signal();
        self.added.notify_all();
    }

    pub(crate) fn attention(&self) -> Attention {
        let state = self.lock();
        let mut urgent = state.events.iter().filter(|(_, event)| event.is_urgent());
        Attention {
            fetched: match state.waiting {
                0 => state.fetched,
                _ => now(),
            },
            due: urgent.next().map(|(queued, _)| *queued),
        }
    }

    /// How many events were dropped because the program was slow.
    pub(crate) fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    /// The next event, for which it waits up to `limit`, or for ever. The pointer is null without one,
    /// and valid until the next call. `Err` when the queue has ended and is empty.
    pub(crate) fn next(&self, limit: Option<Duration>) -> Result<*const JausEvent, Ended> {
        let mut state = self.lock();
        state.current = None;
        let start = now();
        state.waiting += 1;
        while state.events.is_empty() && !state.has_ended {
            let rest = limit.map(|limit| limit.saturating_sub(now() - start));
            if rest.is_some_and(|rest| rest.is_zero()) {
                break;
            }
            // Wakes now and then, so that a limit of "for ever" needs no other way.
            let waited = self
                .added
                .wait_timeout(state, rest.unwrap_or(Duration::from_secs(3600)));
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        state.waiting -= 1;
        state.fetched = now();
        let next = state.events.pop_front();
        if state.events.is_empty() && !state.has_ended {
            self.rest(&mut state);
        }
        match next {
            Some((_, event)) => Ok(state.show(event)),
            None if state.has_ended => Err(Ended),
            None => Ok(std::ptr::null()),
        }
    }

    /// Makes the descriptor unreadable.
    fn rest(&self, state: &mut State) {
        if state.is_signalled {
            // One octet at most is there.
            let _ = (&self.readable).read(&mut [0]);
            state.is_signalled = false;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}

/// The queue has ended.
#[derive(Debug)]
pub(crate) struct Ended;

impl State {
    fn signal(&mut self) {
        if !self.is_signalled {
            // An empty socket has room for an octet.
            let _ = self.signal.write(&[1]);
            self.is_signalled = true;
        }
    }

    fn show(&mut self, event: Event) -> *const JausEvent {
        // The octets of message and text are on the heap, so they stay where they are.
        let current = self.current.insert(Box::new((event.view(), event)));
        &raw const current.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(number: u8) -> Event {
        let message = Bytes::copy_from_slice(&[number, 0x44]);
        Event {
            kind: JausEventKind::Report,
            message,
            ..Event::new(JausEventKind::Report, JausId::new(101, 1, 33))
        }
    }

    fn next(queue: &EventQueue) -> Option<(JausEventKind, u8)> {
        let event = queue.next(Some(Duration::ZERO)).unwrap();
        // SAFETY: the event is valid until the next call.
        let event = unsafe { event.as_ref() }?;
        // SAFETY: it has a message of two octets.
        Some((event.kind, unsafe { *event.data }))
    }

    /// Whether the descriptor is readable. Reads what makes it so.
    fn was_readable(queue: &EventQueue) -> bool {
        (&queue.readable).read(&mut [0]).is_ok()
    }

    #[test]
    fn events_come_in_order_and_a_full_queue_drops_the_oldest_report() {
        let queue = EventQueue::new().unwrap();
        queue.push(Event::message(
            JausId::new(1, 1, 1),
            Bytes::from_static(&[9, 9]),
        ));
        for number in 0..EventQueue::MOST {
            queue.push(report(number as u8));
        }
        assert_eq!(queue.dropped(), 1);
        assert_eq!(next(&queue), Some((JausEventKind::Message, 9)));
        assert_eq!(next(&queue), Some((JausEventKind::Report, 1)));
    }

    #[test]
    fn the_descriptor_is_readable_while_events_wait() {
        let queue = EventQueue::new().unwrap();
        assert!(!was_readable(&queue));
        queue.push(report(1));
        queue.push(report(2));
        assert!(next(&queue).is_some() && queue.lock().is_signalled);
        assert!(next(&queue).is_some() && !queue.lock().is_signalled);
        assert!(!was_readable(&queue), "the octet was read");
        queue.beat();
        assert!(was_readable(&queue));
    }

    #[test]
    fn what_waits_is_fetched_before_the_end() {
        let queue = EventQueue::new().unwrap();
        queue.push(report(1));
        queue.end();
        assert!(next(&queue).is_some());
        assert!(queue.next(None).is_err());
    }

    #[test]
    fn a_program_that_waits_pays_attention() {
        let queue = EventQueue::new().unwrap();
        let before = queue.attention();
        queue.push(report(1));
        assert_eq!(queue.attention(), before, "a report is not urgent");
        queue.push(Event::message(
            JausId::new(1, 1, 1),
            Bytes::from_static(&[9, 9]),
        ));
        assert!(before.due.is_none() && queue.attention().due.is_some());
        assert!(next(&queue).is_some());
        assert!(queue.attention().fetched > before.fetched);
    }
}
