//! The orderly shutdown of a node: components of its own process stop and release what they hold
//! before it closes its links.

use std::time::Duration;

use tokio::sync::watch;

/// How long a stopping node waits for its residents.
const LIMIT: Duration = Duration::from_secs(1);

/// Tells the residents of a node whether it is about to stop. Each has a receiver.
#[derive(Debug, Default)]
pub(super) struct Residents(watch::Sender<bool>);

impl Residents {
    pub(super) fn admit(&self) -> Resident {
        Resident(Some(self.0.subscribe()))
    }

    /// Asks the residents to leave, and waits until all have, or for [`LIMIT`].
    #[expect(clippy::disallowed_methods, reason = "shutdown waits in real time")]
    pub(super) async fn close(&self) {
        self.0.send_replace(true);
        // On timeout the peers' own timeouts release what the residents held.
        let _ = tokio::time::timeout(LIMIT, self.0.closed()).await;
    }
}

/// Keeps a stopping node running for a moment, until this is dropped.
#[derive(Debug)]
pub struct Resident(
    /// `None` for the node of another process, which does not wait.
    pub(super) Option<watch::Receiver<bool>>,
);

impl Resident {
    /// Waits until the node is stopping.
    pub async fn closing(&self) {
        let Some(mut closing) = self.0.clone() else {
            return std::future::pending().await;
        };
        // An error means that the node is gone.
        let _ = closing.wait_for(|closing| *closing).await;
    }
}
