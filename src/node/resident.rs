//! The orderly shutdown of a node: components of its own process stop and release what they hold
//! before it closes its links.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;

/// How long a stopping node waits for its residents.
pub(super) const LIMIT: Duration = Duration::from_secs(1);

/// The number of residents of a node, and whether it is about to stop.
#[derive(Debug)]
pub(super) struct Residents {
    closing: watch::Sender<bool>,
    count: watch::Sender<usize>,
}

impl Default for Residents {
    fn default() -> Self {
        Self {
            closing: watch::Sender::new(false),
            count: watch::Sender::new(0),
        }
    }
}

impl Residents {
    /// Asks the residents to leave, and waits until all have, or for [`LIMIT`].
    #[expect(clippy::disallowed_methods, reason = "shutdown waits in real time")]
    pub(super) async fn close(&self) {
        self.closing.send_replace(true);
        let mut count = self.count.subscribe();
        // On timeout the peers' own timeouts release what the residents held.
        let _ = tokio::time::timeout(LIMIT, count.wait_for(|count| *count == 0)).await;
    }
}

/// Keeps a stopping node running for a moment, until this is dropped.
#[derive(Debug)]
pub struct Resident(Option<Arc<Residents>>);

impl Resident {
    pub(super) fn of(residents: &Arc<Residents>) -> Self {
        residents.count.send_modify(|count| *count += 1);
        Self(Some(Arc::clone(residents)))
    }

    /// For the node of another process, which does not wait.
    pub(super) const fn elsewhere() -> Self {
        Self(None)
    }

    /// Waits until the node is stopping.
    pub async fn closing(&self) {
        match &self.0 {
            Some(residents) => {
                let mut closing = residents.closing.subscribe();
                // This cannot fail: `residents` holds the sender.
                let _ = closing.wait_for(|closing| *closing).await;
            }
            None => std::future::pending().await,
        }
    }
}

impl Drop for Resident {
    fn drop(&mut self) {
        if let Some(residents) = &self.0 {
            residents.count.send_modify(|count| *count -= 1);
        }
    }
}
