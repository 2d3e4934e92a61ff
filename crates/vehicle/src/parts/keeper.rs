//! Persistent values written in the background, so that the disk never delays the control loop.

use std::fmt::Display;
use std::future::Future;
use std::time::Duration;

use tokio::sync::watch;
use tokio::time::sleep;

/// The sending end. Only the latest value waits, and sending never blocks.
#[derive(Debug)]
pub(super) struct Keeper<T>(watch::Sender<Option<T>>);

/// The receiving end of a [`Keeper`].
pub(super) struct Kept<T>(watch::Receiver<Option<T>>);

/// Creates both ends.
pub(super) fn keeper<T>() -> (Keeper<T>, Kept<T>) {
    let (sender, receiver) = watch::channel(None);
    (Keeper(sender), Kept(receiver))
}

impl<T> Keeper<T> {
    /// Queues a value for writing, in place of any waiting one.
    pub(super) fn keep(&self, value: T) {
        self.0.send_replace(Some(value));
    }
}

impl<T: Clone> Kept<T> {
    /// Writes the queued values with a pause after each write, until the keeper is dropped. After
    /// an error, which is logged, the latest value is retried: a full disk must not stop the
    /// vehicle.
    #[expect(
        clippy::disallowed_methods,
        reason = "the pause spares the disk and delays nothing else"
    )]
    pub(super) async fn write<E: Display, F: Future<Output = Result<(), E>>>(
        mut self,
        pause: Duration,
        mut write: impl FnMut(T) -> F,
    ) {
        while self.0.changed().await.is_ok() {
            let value = self.0.borrow_and_update().clone();
            if let Some(value) = value
                && let Err(error) = write(value).await
            {
                tracing::warn!("{error}");
                self.0.mark_changed();
            }
            sleep(pause).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;
    use std::sync::{Arc, Mutex};

    use super::*;

    const PAUSE: Duration = Duration::from_millis(500);

    #[tokio::test(start_paused = true)]
    #[expect(clippy::disallowed_methods, reason = "in virtual time")]
    async fn what_could_not_be_written_is_tried_again() {
        let (keeper, kept) = keeper();
        keeper.keep(7);
        let mut attempts = 0;
        let (done, is_done) = tokio::sync::oneshot::channel();
        let mut done = Some(done);
        let writer = kept.write(PAUSE, |value: u32| {
            attempts += 1;
            let written = if attempts < 3 {
                Err("disk full")
            } else {
                Ok(())
            };
            if written.is_ok() {
                let _ = done.take().map(|done| done.send(value));
            }
            std::future::ready(written)
        });
        tokio::select! {
            () = writer => panic!("the keeper lives"),
            value = tokio::time::timeout(10 * PAUSE, is_done) => assert_eq!(value, Ok(Ok(7))),
        }
        assert_eq!(attempts, 3);
    }

    #[tokio::test(start_paused = true)]
    #[expect(clippy::disallowed_methods, reason = "in virtual time")]
    async fn a_disk_that_stalls_delays_nobody_and_gets_the_latest() {
        let (keeper, kept) = keeper();
        let written = Arc::new(Mutex::new(Vec::new()));
        let writer = kept.write(PAUSE, |value: u32| {
            let written = written.clone();
            async move {
                sleep(Duration::from_secs(5)).await;
                written.lock().unwrap().push(value);
                Ok::<(), Infallible>(())
            }
        });
        let start = tokio::time::Instant::now();
        let reckoning = async {
            for value in 0..200 {
                keeper.keep(value);
                sleep(Duration::from_millis(40)).await;
            }
            assert_eq!(start.elapsed(), Duration::from_secs(8), "no value waited");
            drop(keeper);
        };
        tokio::join!(writer, reckoning);
        let written = written.lock().unwrap();
        assert_eq!(written.first(), Some(&0));
        assert!(
            written.len() <= 3 && written.last() >= Some(&130),
            "{written:?}"
        );
    }
}
