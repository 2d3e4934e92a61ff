//! The main task of a node: waits for datagrams, timers and shutdown, and gives the core its turns.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use tokio::time::{Instant, Sleep};

use super::core::{Shared, now};

#[derive(Debug)]
pub(super) struct Driver {
    shared: Arc<Shared>,
    timer: Pin<Box<Sleep>>,
}

impl Driver {
    pub(super) fn new(shared: Arc<Shared>) -> Self {
        Self {
            shared,
            timer: Box::pin(tokio::time::sleep_until(now().into())),
        }
    }
}

impl Future for Driver {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<()> {
        let deadline = {
            let mut core = self.shared.lock();
            if core.turn(cx).is_ready() {
                return Poll::Ready(());
            }
            core.deadline()
        };
        let Some(deadline) = deadline.map(Instant::from_std) else {
            return Poll::Pending;
        };
        if self.timer.deadline() != deadline {
            self.timer.as_mut().reset(deadline);
        }
        ready!(self.timer.as_mut().poll(cx));
        // Already due: take another turn, but let other tasks run first.
        cx.waker().wake_by_ref();
        Poll::Pending
    }
}

impl Drop for Driver {
    /// Also runs when the runtime is shut down under the node, so that no task waits for ever.
    fn drop(&mut self) {
        self.shared.lock().finish();
        self.shared.stopped.send_replace(true);
    }
}
