//! The directories that the components of a node share: one for each scope and timing.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use tokio::sync::watch;

use crate::node::Port;
use crate::service::{NodeDirectory, Scope, Timing};

/// The directories of one node, as long as they have members.
#[derive(Debug, Default)]
pub(super) struct Directories(Mutex<Vec<Weak<Shared>>>);

#[derive(Debug)]
struct Shared {
    scope: Scope,
    timing: Timing,
    known: Arc<NodeDirectory>,
    /// The number of changes so far; all members watch it.
    changes: watch::Sender<u64>,
}

/// A component's membership of a directory. It is dropped after the component's
/// [`Discovery`](crate::service::Discovery), and then notifies the other members that the component
/// is gone.
#[derive(Debug)]
pub(super) struct Membership {
    shared: Arc<Shared>,
    changes: watch::Receiver<u64>,
}

impl Directories {
    /// The directory for a component on this port. A component that searches for none, or is on the
    /// node of another process, has its own.
    pub(super) fn join(port: &Port, scope: Scope, timing: Timing, seed: u64) -> Membership {
        let directories: Arc<Self> = port.common();
        let mut all = directories.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|it| it.strong_count() > 0);
        let is_same = |it: &Arc<Shared>| scope != Scope::Nobody && it.is_for(scope, timing);
        let shared = all.iter().filter_map(Weak::upgrade).find(is_same);
        let shared = shared.unwrap_or_else(|| {
            let shared = Arc::new(Shared {
                scope,
                timing,
                known: Arc::new(NodeDirectory::new(scope, timing, seed)),
                changes: watch::Sender::new(0),
            });
            all.push(Arc::downgrade(&shared));
            shared
        });
        let changes = shared.changes.subscribe();
        Membership { shared, changes }
    }
}

impl Shared {
    fn is_for(&self, scope: Scope, timing: Timing) -> bool {
        (self.scope, self.timing) == (scope, timing)
    }
}

impl Membership {
    pub(super) fn directory(&self) -> Arc<NodeDirectory> {
        self.shared.known.clone()
    }

    /// Notifies the other members if there are changes.
    pub(super) fn publish(&self) {
        let now = self.shared.known.change_count();
        let changes = &self.shared.changes;
        changes.send_if_modified(|count| std::mem::replace(count, now) != now);
    }

    /// Waits until another member has changed the directory.
    pub(super) async fn changed(&mut self) {
        // This cannot fail: `shared` holds the sender.
        let _ = self.changes.changed().await;
    }
}

impl Drop for Membership {
    fn drop(&mut self) {
        self.publish();
    }
}
