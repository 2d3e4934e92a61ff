//! The one task of a node: it waits for datagrams, timers and the end, and gives the core its
//! turns.

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
        // Due already: another turn, but not before the other tasks had theirs.
        cx.waker().wake_by_ref();
        Poll::Pending
    }
}

impl Drop for Driver {
    /// Also when the runtime is shut down under the node: nobody may wait for it in vain.
    fn drop(&mut self) {
        self.shared.lock().finish();
        self.shared.stopped.send_replace(true);
    }
}
