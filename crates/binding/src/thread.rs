//! The thread of a node: a tokio runtime, on which the node and its components run.

use std::io;
use std::mem::forget;
use std::sync::{Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

use tokio::runtime::{self, Handle};
use tokio::sync::oneshot;

use crate::lock::lock;

/// The thread of one node. Dropping it, or [`end`](Self::end), ends what still runs.
#[derive(Debug)]
pub struct NodeThread {
    handle: Handle,
    /// The process that has started it. A child after a fork has a copy of this, but no thread.
    process: u32,
    thread: Mutex<Option<(oneshot::Sender<()>, JoinHandle<()>)>>,
}

impl NodeThread {
    /// Starts a thread that waits for tasks.
    ///
    /// # Errors
    /// If the system has no room for a thread or a runtime.
    pub fn start() -> io::Result<Self> {
        // One thread, so that whatever holds it up holds up everything: nothing of a node looks alive that
        // is not.
        let runtime = runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime?;
        let handle = runtime.handle().clone();
        let (stop, stopped) = oneshot::channel::<()>();
        let thread = Builder::new().name("jaus".to_owned()).spawn(move || {
            // An error means that the handle is gone, which is the end, too.
            let _ = runtime.block_on(stopped);
        })?;
        Ok(Self {
            handle,
            process: std::process::id(),
            thread: Mutex::new(Some((stop, thread))),
        })
    }

    /// Gives access to the runtime.
    #[must_use]
    pub const fn handle(&self) -> &Handle {
        &self.handle
    }

    /// Whether this process is not the one that has started the thread, but a child of it after a fork.
    #[must_use]
    pub fn is_of_other_process(&self) -> bool {
        std::process::id() != self.process
    }

    /// Whether it was ended: tasks do not run any more.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        lock(&self.thread).is_none()
    }

    /// Drops what still runs, which stops what moves. The result waits for the end. In a child after a fork
    /// this has no effect.
    #[must_use = "join the thread, unless it could wait for this one"]
    pub fn end(&self) -> Option<JoinHandle<()>> {
        let (stop, thread) = lock(&self.thread).take()?;
        if self.is_of_other_process() {
            forget((stop, thread));
            return None;
        }
        drop(stop);
        Some(thread)
    }
}

impl Drop for NodeThread {
    fn drop(&mut self) {
        if self.is_of_other_process() {
            let thread = self
                .thread
                .get_mut()
                .unwrap_or_else(PoisonError::into_inner);
            forget(thread.take());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_the_thread_drops_what_runs_on_it() {
        let thread = NodeThread::start().unwrap();
        let (alive, mut ended) = oneshot::channel::<()>();
        thread.handle().spawn(async move {
            let _alive = alive;
            std::future::pending::<()>().await;
        });
        assert!(!thread.is_of_other_process() && !thread.has_ended());
        thread.end().unwrap().join().unwrap();
        assert!(
            ended
                .try_recv()
                .is_err_and(|it| it == oneshot::error::TryRecvError::Closed)
        );
        assert!(thread.has_ended() && thread.end().is_none(), "it ends once");
    }
}
