//! The thread that calls the stop functions of drivers, also while the program's event loop hangs.
#![expect(
    clippy::disallowed_methods,
    reason = "waiting for a function has a limit"
)]

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use jaus_binding::{END, lock};
use pyo3::prelude::*;
use tokio::sync::Notify;

/// The stop functions of a node's components.
#[derive(Default)]
pub(crate) struct Stopper {
    state: Mutex<State>,
    changed: Condvar,
    /// Notified when a function has returned.
    called: Notify,
}

#[derive(Default)]
struct State {
    functions: BTreeMap<u64, Function>,
    has_ended: bool,
}

struct Function {
    /// It does not raise.
    function: Arc<Py<PyAny>>,
    is_due: bool,
    is_running: bool,
}

impl Stopper {
    /// Starts the thread. It ends after [`end`](Self::end), or with the interpreter.
    pub(crate) fn start(self: &Arc<Self>) -> std::io::Result<()> {
        let stopper = self.clone();
        let thread = std::thread::Builder::new().name("jaus-stop".to_owned());
        thread.spawn(move || stopper.run()).map(drop)
    }

    /// Adds the function that stops a component.
    pub(crate) fn add(&self, component: u64, function: Py<PyAny>) {
        let function = Function {
            function: Arc::new(function),
            is_due: false,
            is_running: false,
        };
        self.lock().functions.insert(component, function);
    }

    /// Calls the function of a component soon. Does not wait.
    pub(crate) fn stop(&self, component: u64) {
        if let Some(function) = self.lock().functions.get_mut(&component) {
            function.is_due = true;
            self.changed.notify_all();
        }
    }

    /// Waits until a component is stopped, if that is due, but not longer than a component may take to end. Then
    /// its function is removed.
    pub(crate) async fn settle(&self, component: u64) {
        let settled = async {
            loop {
                let called = self.called.notified();
                let is_busy = |it: &Function| it.is_due || it.is_running;
                if !self.lock().functions.get(&component).is_some_and(is_busy) {
                    return;
                }
                called.await;
            }
        };
        // If it takes too long, the function runs on.
        let _ = tokio::time::timeout(END, settled).await;
        self.lock().functions.remove(&component);
    }

    /// Waits until a component is stopped, if that is due, but only for a moment: stop functions are quick.
    /// Whether that was enough.
    pub(crate) fn settle_quickly(&self, component: u64) -> bool {
        /// Less than a fifth of the time after which an event loop hangs.
        const MOMENT: Duration = Duration::from_millis(100);
        let is_busy = |state: &mut State| {
            let function = state.functions.get(&component);
            function.is_some_and(|it| it.is_due || it.is_running)
        };
        let waited = self
            .changed
            .wait_timeout_while(self.lock(), MOMENT, is_busy);
        let (state, waited) = waited.unwrap_or_else(PoisonError::into_inner);
        drop(state);
        !waited.timed_out()
    }

    /// Ends the thread when nothing is due.
    pub(crate) fn end(&self) {
        self.lock().has_ended = true;
        self.changed.notify_all();
    }

    fn run(&self) {
        while let Some((component, function)) = self.next() {
            let called = Python::try_attach(|py| {
                if let Err(error) = function.call0(py) {
                    error.write_unraisable(py, None);
                }
                drop(function);
            });
            if let Some(function) = self.lock().functions.get_mut(&component) {
                function.is_running = false;
            }
            self.called.notify_waiters();
            self.changed.notify_all();
            if called.is_none() {
                // The interpreter ends.
                return;
            }
        }
    }

    /// Waits for a function that is due; `None` at the end.
    fn next(&self) -> Option<(u64, Arc<Py<PyAny>>)> {
        let mut state = self.lock();
        loop {
            let due = state.functions.iter_mut().find(|(_, it)| it.is_due);
            if let Some((&component, function)) = due {
                function.is_due = false;
                function.is_running = true;
                return Some((component, function.function.clone()));
            }
            if state.has_ended {
                return None;
            }
            let waited = self.changed.wait(state);
            state = waited.unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}
