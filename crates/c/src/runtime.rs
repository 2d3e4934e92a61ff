//! The library's thread: a tokio runtime, on which a node, its components and all callbacks run.

use std::future::Future;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use jaus_binding::{NodeThread, lock};
use tokio::runtime::Handle;

use crate::status::{Failure, JausStatus, check_may_wait, is_in_callback};
use crate::watchdog::Watchdog;

/// The thread of one node, and the thread of its watchdog.
pub(crate) struct Runtime {
    node: NodeThread,
    watchdog: Arc<Watchdog>,
    watching: Mutex<Option<JoinHandle<()>>>,
}

impl Runtime {
    pub(crate) fn start() -> Result<Self, Failure> {
        let failed = |error: std::io::Error| Failure::of(JausStatus::NotStarted, &error);
        let node = NodeThread::start().map_err(failed)?;
        let watchdog = Arc::new(Watchdog::default());
        let watching = watchdog.start().map_err(failed)?;
        Ok(Self {
            node,
            watchdog,
            watching: Mutex::new(Some(watching)),
        })
    }

    pub(crate) fn watchdog(&self) -> Arc<Watchdog> {
        self.watchdog.clone()
    }

    pub(crate) const fn handle(&self) -> &Handle {
        self.node.handle()
    }

    /// Waits for the result of a future, on a thread of the program.
    pub(crate) fn wait<T>(&self, future: impl Future<Output = T>) -> Result<T, Failure> {
        check_may_wait()?;
        Ok(self.handle().block_on(future))
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
        let thread = self.node.end();
        self.watchdog.end();
        if is_in_callback() {
            return;
        }
        let watching = lock(&self.watching).take();
        for thread in thread.into_iter().chain(watching) {
            // An error means that it has panicked, which is its end, too.
            let _ = thread.join();
        }
    }
}
