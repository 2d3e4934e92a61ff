//! The watch over callbacks: if one hangs, the stop callbacks of the node are called beside it.
//!
//! A callback that hangs holds up the library's thread, so nothing of the node looks alive to its peers
//! any more. But what a driver has set in motion would go on, because the services that would stop it
//! are held up, too.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use jaus::node::now;

use jaus_binding::{HUNG, lock};

/// What stops something that moves while a callback hangs.
pub(crate) trait Stop: Send + Sync {
    /// Stops it, on the watchdog's thread.
    fn stop_beside_a_hung_callback(&self);
}

/// Watches the callbacks of one node.
#[derive(Default)]
pub(crate) struct Watchdog {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// Since when a callback has been running, until it is found to hang.
    since: Option<Instant>,
    stops: Vec<Weak<dyn Stop>>,
    has_ended: bool,
}

impl Watchdog {
    /// How often its thread looks.
    const INTERVAL: Duration = Duration::from_millis(50);

    /// Starts the thread that watches. It ends with [`end`](Self::end).
    pub(crate) fn start(self: &Arc<Self>) -> std::io::Result<JoinHandle<()>> {
        let watchdog = self.clone();
        let thread = std::thread::Builder::new().name("jaus-watchdog".to_owned());
        thread.spawn(move || watchdog.run())
    }

    pub(crate) fn end(&self) {
        self.lock().has_ended = true;
        self.changed.notify_all();
    }

    /// Adds a stop callback, for as long as it exists.
    pub(crate) fn add_stop(&self, stop: Weak<dyn Stop>) {
        let mut state = self.lock();
        state.stops.retain(|stop| stop.strong_count() > 0);
        state.stops.push(stop);
    }

    /// Watches a callback until the result is dropped.
    pub(crate) fn watch(&self) -> Watched<'_> {
        self.lock().since = Some(now());
        Watched(self)
    }

    fn run(&self) {
        while let Some(stops) = self.wait() {
            if !stops.is_empty() {
                tracing::error!("stopped: a callback of the program hangs");
            }
            for stop in stops.iter().filter_map(Weak::upgrade) {
                stop.stop_beside_a_hung_callback();
            }
        }
    }

    /// Waits until a callback hangs; `None` at the end.
    fn wait(&self) -> Option<Vec<Weak<dyn Stop>>> {
        let mut state = self.lock();
        loop {
            if state.has_ended {
                return None;
            }
            if state.since.is_some_and(|since| now() - since > HUNG) {
                state.since = None;
                return Some(state.stops.clone());
            }
            let waited = self.changed.wait_timeout(state, Self::INTERVAL);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}

/// A callback that is watched.
pub(crate) struct Watched<'a>(&'a Watchdog);

impl Drop for Watched<'_> {
    fn drop(&mut self) {
        self.0.lock().since = None;
    }
}
