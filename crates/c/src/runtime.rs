//! The library's thread: a tokio runtime, on which a node, its components and all callbacks run.

use std::future::Future;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use tokio::runtime::{Builder, Handle};
use tokio::sync::oneshot;

use crate::status::{Failure, JausStatus, check_may_wait, is_in_callback};
use crate::watchdog::Watchdog;

/// The thread of one node, and the thread of its watchdog.
pub(crate) struct Runtime {
    handle: Handle,
    watchdog: Arc<Watchdog>,
    stop: Mutex<Option<oneshot::Sender<()>>>,
    threads: Mutex<Vec<JoinHandle<()>>>,
}

impl Runtime {
    pub(crate) fn start() -> Result<Self, Failure> {
        let failed = |error: std::io::Error| Failure::of(JausStatus::NotStarted, &error);
        // One thread, so that a callback that hangs holds up everything: nothing of a node looks
        // alive that is not.
        let runtime = Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(failed)?;
        let handle = runtime.handle().clone();
        let (stop, stopped) = oneshot::channel::<()>();
        let thread = std::thread::Builder::new().name("jaus".to_owned());
        let thread = thread.spawn(move || {
            // An error means that the handle is gone, which is the end, too.
            let _ = runtime.block_on(stopped);
        });
        let thread = thread.map_err(failed)?;
        let watchdog = Arc::new(Watchdog::default());
        let watching = watchdog.start().map_err(failed)?;
        Ok(Self {
            handle,
            watchdog,
            stop: Mutex::new(Some(stop)),
            threads: Mutex::new(vec![thread, watching]),
        })
    }

    pub(crate) fn watchdog(&self) -> Arc<Watchdog> {
        self.watchdog.clone()
    }

    pub(crate) fn handle(&self) -> &Handle {
        &self.handle
    }

    /// Waits for the result of a future, on a thread of the program.
    pub(crate) fn wait<T>(&self, future: impl Future<Output = T>) -> Result<T, Failure> {
        check_may_wait()?;
        Ok(self.handle.block_on(future))
    }

    /// Ends a task. Waits until it runs no more, but not in a callback.
    pub(crate) fn end(&self, task: tokio::task::JoinHandle<()>) {
        task.abort();
        // Its end by the abort is what is waited for.
        let _ = self.wait(task);
    }
}

impl Drop for Runtime {
    /// Drops what still runs, which stops what moves, and waits for the end.
    fn drop(&mut self) {
        let stop = self.stop.get_mut().unwrap_or_else(PoisonError::into_inner);
        drop(stop.take());
        self.watchdog.end();
        if is_in_callback() {
            return;
        }
        let threads = self
            .threads
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner);
        for thread in threads.drain(..) {
            // An error means that it has panicked, which is its end, too.
            let _ = thread.join();
        }
    }
}
