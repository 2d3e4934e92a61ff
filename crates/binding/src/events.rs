//! The queue in which messages and news wait for a program with its own loop.

use std::collections::VecDeque;
use std::fmt;
use std::io::{Read, Write};
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::node::now;
use jaus::service::StopCause;

use crate::lock::lock;

/// An event for a program.
pub trait Notice: Send + 'static {
    /// The news that the motion of a service was stopped. Without a cause, its command was not repeated in
    /// time.
    fn stopped(service: ServiceKey, component: JausId, cause: Option<&StopCause>) -> Self;

    /// What happens to it in a full queue.
    fn loss(&self) -> Loss;
}

/// What happens to an event in a full queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// It is dropped first, because a newer one replaces it: a report.
    First,
    /// It is dropped if there is nothing else to drop.
    Last,
    /// It is kept. The number of such events is bounded elsewhere.
    Never,
}

/// Names a service whose commands wait in a queue, within this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ServiceKey(u64);

impl ServiceKey {
    /// A key that differs from all others.
    #[must_use]
    pub fn new() -> Self {
        static LAST: AtomicU64 = AtomicU64::new(0);
        Self(LAST.fetch_add(1, Ordering::Relaxed) + 1)
    }

    /// Its number.
    #[must_use]
    pub const fn number(self) -> u64 {
        self.0
    }
}

impl Default for ServiceKey {
    fn default() -> Self {
        Self::new()
    }
}

/// The events that wait for a program. Its descriptor is readable while some wait.
pub struct EventQueue<E> {
    state: Mutex<State<E>>,
    added: Condvar,
    /// The end that the program waits for.
    readable: UnixStream,
}

struct State<E> {
    waiting: VecDeque<Waiting<E>>,
    dropped: u64,
    /// When the program last came for an event.
    fetched: Instant,
    /// How many threads wait for an event.
    fetching: usize,
    has_ended: bool,
    signal: UnixStream,
    is_signalled: bool,
}

struct Waiting<E> {
    queued: Instant,
    claim: Claim,
    event: E,
}

/// How soon the program must fetch an event.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Claim {
    AtLeisure,
    InTime,
    /// In time, and only while the command is in force.
    Command(ServiceKey),
}

/// Whether the program comes for its events.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Attention {
    /// When it last came; now, if it is waiting for an event.
    pub fetched: Instant,
    /// Since when a message for a service, or the news of a stop, has been waiting.
    pub due: Option<Instant>,
}

/// The queue has ended, and nothing waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the queue of events has ended")]
pub struct Ended;

impl<E: Notice> EventQueue<E> {
    /// Limit of events that wait, but for those that are never lost.
    pub const MOST: usize = 1024;

    /// An empty queue.
    ///
    /// # Errors
    /// If the process has no descriptors left.
    pub fn new() -> std::io::Result<Self> {
        let (readable, signal) = UnixStream::pair()?;
        readable.set_nonblocking(true)?;
        signal.set_nonblocking(true)?;
        Ok(Self {
            state: Mutex::new(State {
                waiting: VecDeque::new(),
                dropped: 0,
                fetched: now(),
                fetching: 0,
                has_ended: false,
                signal,
                is_signalled: false,
            }),
            added: Condvar::new(),
            readable,
        })
    }

    /// Readable while events wait, and after [`beat`](Self::beat). It belongs to the queue.
    #[must_use]
    pub fn descriptor(&self) -> RawFd {
        self.readable.as_raw_fd()
    }

    /// Queues an event that can wait.
    pub fn push(&self, event: E) {
        self.add(Claim::AtLeisure, event);
    }

    /// Queues an event that the program must fetch in time: a message for a service, the news of a stop.
    pub fn push_in_time(&self, event: E) {
        self.add(Claim::InTime, event);
    }

    /// Queues a command of a service, which the program must fetch in time, until it is
    /// [withdrawn](Self::withdraw_commands).
    pub fn push_command(&self, service: ServiceKey, event: E) {
        self.add(Claim::Command(service), event);
    }

    fn add(&self, claim: Claim, event: E) {
        let mut state = self.lock();
        if state.waiting.len() >= Self::MOST {
            state.drop_one();
        }
        let queued = now();
        state.waiting.push_back(Waiting {
            queued,
            claim,
            event,
        });
        state.signal();
        self.added.notify_one();
    }

    /// Drops the commands of a service that wait, because they are no longer in force: a program that
    /// fetches them late must not act on them.
    pub fn withdraw_commands(&self, service: ServiceKey) {
        let is_withdrawn = |it: &Waiting<E>| it.claim == Claim::Command(service);
        self.lock().waiting.retain(|it| !is_withdrawn(it));
    }

    /// Makes the descriptor readable, so that a program that waits for it comes and shows that it still
    /// can.
    pub fn beat(&self) {
        self.lock().signal();
    }

    /// Ends the queue: what waits can still be fetched.
    pub fn end(&self) {
        let mut state = self.lock();
        state.has_ended = true;
        state.signal();
        self.added.notify_all();
    }

    /// Whether the program comes for its events.
    #[must_use]
    pub fn attention(&self) -> Attention {
        let state = self.lock();
        let is_urgent = |it: &&Waiting<E>| it.claim != Claim::AtLeisure;
        Attention {
            fetched: match state.fetching {
                0 => state.fetched,
                _ => now(),
            },
            due: state.waiting.iter().find(is_urgent).map(|it| it.queued),
        }
    }

    /// How many events were dropped because the program was slow.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    /// The next event, for which it waits up to `limit`, or for ever.
    ///
    /// # Errors
    /// When the queue has ended and is empty.
    pub fn next(&self, limit: Option<Duration>) -> Result<Option<E>, Ended> {
        let mut state = self.lock();
        let start = now();
        state.fetching += 1;
        while state.waiting.is_empty() && !state.has_ended {
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
        state.fetching -= 1;
        state.fetched = now();
        let next = state.waiting.pop_front();
        if state.waiting.is_empty() && !state.has_ended {
            self.rest(&mut state);
        }
        match next {
            Some(next) => Ok(Some(next.event)),
            None if state.has_ended => Err(Ended),
            None => Ok(None),
        }
    }

    /// Makes the descriptor unreadable.
    fn rest(&self, state: &mut State<E>) {
        if state.is_signalled {
            // One octet at most is there.
            let _ = (&self.readable).read(&mut [0]);
            state.is_signalled = false;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State<E>> {
        lock(&self.state)
    }
}

impl<E: Notice> State<E> {
    fn drop_one(&mut self) {
        let first_of = |loss| self.waiting.iter().position(|it| it.event.loss() == loss);
        if let Some(place) = first_of(Loss::First).or_else(|| first_of(Loss::Last)) {
            self.waiting.remove(place);
            self.dropped += 1;
        }
    }

    fn signal(&mut self) {
        if !self.is_signalled {
            // An empty socket has room for an octet.
            let _ = self.signal.write(&[1]);
            self.is_signalled = true;
        }
    }
}

impl<E> fmt::Debug for EventQueue<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("EventQueue").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Eq)]
    enum Event {
        Message(u8),
        Report(u8),
        Answer,
        Stopped,
    }

    impl Notice for Event {
        fn stopped(_: ServiceKey, _: JausId, _: Option<&StopCause>) -> Self {
            Self::Stopped
        }

        fn loss(&self) -> Loss {
            match self {
                Self::Report(_) => Loss::First,
                Self::Answer => Loss::Never,
                Self::Message(_) | Self::Stopped => Loss::Last,
            }
        }
    }

    type Queue = EventQueue<Event>;

    fn next(queue: &Queue) -> Option<Event> {
        queue.next(Some(Duration::ZERO)).unwrap()
    }

    /// Whether the descriptor is readable. Reads what makes it so.
    fn was_readable(queue: &Queue) -> bool {
        (&queue.readable).read(&mut [0]).is_ok()
    }

    #[test]
    fn a_full_queue_drops_the_oldest_report_then_the_oldest_event_and_never_an_answer() {
        let queue = Queue::new().unwrap();
        queue.push(Event::Answer);
        queue.push_in_time(Event::Message(9));
        for number in 0..=1 {
            queue.push(Event::Report(number));
        }
        for _ in 0..Queue::MOST - 3 {
            queue.push(Event::Answer);
        }
        assert_eq!(queue.dropped(), 1);
        queue.push(Event::Answer);
        queue.push(Event::Answer);
        assert_eq!(queue.dropped(), 3, "the other report, and the message");
        queue.push(Event::Answer);
        assert_eq!(queue.dropped(), 3);
        for _ in 0..=Queue::MOST {
            assert_eq!(next(&queue), Some(Event::Answer));
        }
        assert_eq!(next(&queue), None);
    }

    #[test]
    fn the_descriptor_is_readable_while_events_wait() {
        let queue = Queue::new().unwrap();
        assert!(!was_readable(&queue));
        queue.push(Event::Report(1));
        queue.push(Event::Report(2));
        assert!(next(&queue).is_some() && queue.lock().is_signalled);
        assert!(next(&queue).is_some() && !queue.lock().is_signalled);
        assert!(!was_readable(&queue), "the octet was read");
        queue.beat();
        assert!(was_readable(&queue));
    }

    #[test]
    fn what_waits_is_fetched_before_the_end() {
        let queue = Queue::new().unwrap();
        queue.push(Event::Report(1));
        queue.end();
        assert!(next(&queue).is_some());
        assert_eq!(queue.next(None), Err(Ended));
    }

    #[test]
    fn a_program_that_waits_pays_attention() {
        let queue = Queue::new().unwrap();
        let before = queue.attention();
        queue.push(Event::Report(1));
        assert_eq!(queue.attention(), before, "a report is not urgent");
        queue.push_in_time(Event::Message(9));
        assert!(before.due.is_none() && queue.attention().due.is_some());
        assert!(next(&queue).is_some());
        assert!(queue.attention().fetched > before.fetched);
    }

    #[test]
    fn commands_that_are_no_longer_in_force_are_withdrawn_and_nothing_else() {
        let queue = Queue::new().unwrap();
        let (service, other) = (ServiceKey::new(), ServiceKey::new());
        queue.push_command(service, Event::Message(1));
        queue.push_in_time(Event::Message(2));
        queue.push_command(other, Event::Message(3));
        queue.push_command(service, Event::Message(4));
        queue.withdraw_commands(service);
        let left = [(); 3].map(|()| next(&queue));
        assert_eq!(
            left,
            [Some(Event::Message(2)), Some(Event::Message(3)), None]
        );
    }
}
