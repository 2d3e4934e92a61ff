//! Control of a peer by a program that may hang.
#![expect(
    clippy::disallowed_methods,
    reason = "a reference to control has a time limit"
)]

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use jaus::component::{Control, ControlError};
use jaus::node::{now, sleep_until};

use crate::lock::lock;

/// Control that is held until it is given up, or until the program does not show that it runs.
#[derive(Debug)]
pub struct HeldControl {
    control: Mutex<Option<Arc<Control>>>,
    not_used: Mutex<Option<NotUsed>>,
}

/// Control was released, because the program did not show that it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("control was released: the program did not show for {:.1} s that it runs", limit.as_secs_f64())]
pub struct NotUsed {
    /// The time limit.
    pub limit: Duration,
}

impl HeldControl {
    /// Control that was granted.
    #[must_use]
    pub fn new(control: Control) -> Self {
        Self {
            control: Mutex::new(Some(Arc::new(control))),
            not_used: Mutex::new(None),
        }
    }

    /// The control, for a moment: it is released with the last reference. `None` after its end.
    #[must_use]
    pub fn get(&self) -> Option<Arc<Control>> {
        lock(&self.control).clone()
    }

    /// Takes the control to release it.
    #[must_use]
    pub fn take(&self) -> Option<Arc<Control>> {
        lock(&self.control).take()
    }

    /// Whether it was released because the program did not show that it runs.
    #[must_use]
    pub fn not_used(&self) -> Option<NotUsed> {
        *lock(&self.not_used)
    }

    /// Releases control when the program has not shown for this time that it runs. `shown` is when it last
    /// did. It is called more often than the limit, and may ask the program for a sign.
    ///
    /// Returns the reason, if control was not given up before.
    pub async fn watch(
        &self,
        limit: Duration,
        shown: impl Fn() -> Instant + Send,
    ) -> Option<NotUsed> {
        /// How many times it looks within the limit.
        const LOOKS: u32 = 4;
        loop {
            let end = shown() + limit;
            if now() >= end {
                break;
            }
            sleep_until(Some(end.min(now() + limit / LOOKS))).await;
        }
        // The reason comes first, for a call that finds the control gone.
        let reason = NotUsed { limit };
        let mut control = lock(&self.control);
        control.as_ref()?;
        *lock(&self.not_used) = Some(reason);
        drop(control.take());
        Some(reason)
    }

    /// Calls `tell` with each state that the peer reports. Returns why control was lost; `None` when it was
    /// given up.
    pub async fn follow(&self, tell: impl Fn(Option<u8>) + Send) -> Option<ControlError> {
        /// How long it keeps a reference. Control is released with the last one.
        const MOMENT: Duration = Duration::from_millis(100);
        let mut known = None;
        while let Some(control) = self.get() {
            let status = tokio::time::timeout(MOMENT, control.status_after(known)).await;
            drop(control);
            match status {
                Err(_) => {}
                Ok(Ok(status)) => {
                    known = status;
                    tell(status);
                }
                Ok(Err(error)) => return Some(error),
            }
        }
        None
    }
}
