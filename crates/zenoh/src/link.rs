//! The [`Exchange`] as a link of a node, shared with the thread of the zenoh session.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use jaus::counters::Count;
use jaus::endpoint::Transmit;
use jaus::link::custom::{Arrival, CustomLink};
use jaus::node::Recorder;
use jaus::rights::Acceptance;
use zenoh::query::Query;

use crate::exchange::Exchange;
use crate::key::BridgeId;

/// The name of the link in logs and reports.
pub(crate) const NAME: &str = "zenoh";

/// The link of a node to the zenoh network. Without a running [`Bridge`](crate::Bridge) it carries
/// nothing.
#[derive(Debug)]
pub struct ZenohLink {
    shared: Arc<Shared>,
}

/// What the node's task, the bridge's task and the thread of the zenoh session share.
#[derive(Debug)]
pub(crate) struct Shared {
    state: Mutex<State>,
    /// Wakes the thread of the session.
    work: Condvar,
}

#[derive(Debug)]
pub(crate) struct State {
    pub(crate) exchange: Exchange,
    /// Takes the decisions of the exchange.
    recorder: Option<Recorder<BridgeId>>,
    /// The answers that wait for the session's thread. As many as there are requests, at most.
    pub(crate) answers: Vec<Answer>,
    /// Wakes the node's task.
    waker: Option<Waker>,
    /// Whether the session is to close.
    pub(crate) is_closing: bool,
}

/// The answer to a request for a view.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) query: Query,
    /// JSON, or why there is none.
    pub(crate) result: Result<String, String>,
}

impl State {
    /// Changes the exchange, and records what it decides.
    fn change<T>(&mut self, change: impl FnOnce(&mut Exchange) -> T) -> T {
        if let Some(recorder) = &self.recorder {
            self.exchange.refuse_commands(recorder.refuses_commands());
        }
        let result = change(&mut self.exchange);
        let decisions = std::iter::from_fn(|| self.exchange.poll_decision());
        match &mut self.recorder {
            Some(recorder) => recorder.record_all(decisions),
            None => decisions.for_each(drop),
        }
        result
    }
}

impl Shared {
    pub(crate) fn new(exchange: Exchange, recorder: Option<Recorder<BridgeId>>) -> Self {
        Self {
            state: Mutex::new(State {
                exchange,
                recorder,
                answers: Vec::new(),
                waker: None,
                is_closing: false,
            }),
            work: Condvar::new(),
        }
    }

    /// The state. A panic elsewhere leaves it usable: every change is complete or counted.
    pub(crate) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the exchange, and wakes the tasks that act on it.
    pub(crate) fn with<T>(&self, change: impl FnOnce(&mut Exchange) -> T) -> T {
        let mut state = self.lock();
        let result = state.change(change);
        let waker = state.waker.take();
        drop(state);
        self.work.notify_one();
        if let Some(waker) = waker {
            waker.wake();
        }
        result
    }

    /// Hands an answer to the session's thread.
    pub(crate) fn answer(&self, answer: Answer) {
        self.lock().answers.push(answer);
        self.work.notify_one();
    }

    /// Ends the session.
    pub(crate) fn close(&self) {
        self.lock().is_closing = true;
        self.work.notify_one();
    }

    /// Waits until the session's thread may have something to do, at most this long.
    pub(crate) fn wait<'a>(
        &self,
        state: MutexGuard<'a, State>,
        limit: Duration,
    ) -> MutexGuard<'a, State> {
        let waited = self.work.wait_timeout(state, limit);
        waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

impl ZenohLink {
    pub(crate) const fn new(shared: Arc<Shared>) -> Self {
        Self { shared }
    }
}

impl CustomLink for ZenohLink {
    fn name(&self) -> &str {
        NAME
    }

    fn counters(&self) -> Vec<Count> {
        self.shared.lock().exchange.counters().counts().collect()
    }

    fn bridged(&self) -> Option<Acceptance> {
        Some(self.shared.lock().exchange.accept().clone())
    }

    fn transmit(&mut self, transmit: &Transmit) {
        let now = jaus::node::now();
        let mut state = self.shared.lock();
        state.change(|exchange| exchange.transmit(now, transmit));
    }

    fn poll_flush(&mut self, _: &mut Context<'_>, now: Instant) -> Poll<()> {
        let mut state = self.shared.lock();
        state.exchange.handle_timeout(now);
        let has_work = !state.exchange.is_idle();
        drop(state);
        if has_work {
            self.shared.work.notify_one();
        }
        Poll::Ready(())
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<Arrival> {
        let mut state = self.shared.lock();
        state.exchange.handle_timeout(now);
        match state.exchange.poll_arrival() {
            Some(arrival) => Poll::Ready(arrival),
            None => {
                state.waker = Some(cx.waker().clone());
                Poll::Pending
            }
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.shared.lock().exchange.poll_timeout()
    }

    fn hang_up(&mut self) -> Poll<()> {
        let mut state = self.shared.lock();
        state.exchange.close();
        // Without the session's thread nothing is sent any more.
        let is_over = state.exchange.is_idle() || state.is_closing;
        drop(state);
        self.shared.work.notify_one();
        match is_over {
            true => Poll::Ready(()),
            false => Poll::Pending,
        }
    }
}
