//! The main task of a node: waits for datagrams, timers and shutdown, and gives the core its turns.

use std::future::poll_fn;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Poll, ready};

use tokio::time::{Instant, sleep_until};

use super::clock::now;
use super::core::Shared;

#[derive(Debug)]
pub(super) struct Driver(pub(super) Arc<Shared>);

impl Driver {
    /// Runs the node until it has stopped.
    pub(super) async fn run(self) {
        let mut timer = pin!(sleep_until(now().into()));
        poll_fn(|cx| {
            let deadline = {
                let mut core = self.0.lock();
                if core.turn(cx).is_ready() {
                    return Poll::Ready(());
                }
                core.deadline()
            };
            let Some(deadline) = deadline.map(Instant::from_std) else {
                return Poll::Pending;
            };
            if timer.deadline() != deadline {
                timer.as_mut().reset(deadline);
            }
            ready!(timer.as_mut().poll(cx));
            // Already due: take another turn, but let other tasks run first.
            cx.waker().wake_by_ref();
            Poll::Pending
        })
        .await;
    }
}

impl Drop for Driver {
    /// Also runs when the runtime is shut down under the node, so that no task waits for ever.
    fn drop(&mut self) {
        self.0.lock().finish();
        self.0.stopped.send_replace(true);
    }
}
