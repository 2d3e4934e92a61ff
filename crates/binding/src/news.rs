//! What a component tells its program by itself: its standing, the components that it finds, the reports that it
//! subscribes to.

use bytes::Bytes;
use jaus::address::JausId;
use jaus::component::{Change, Component, Standing, Subscription, Undecoded, Update};
use tokio::task::AbortHandle;

/// The address of no component.
pub const NOBODY: JausId = JausId::new(0, 0, 0);

/// Calls `tell` after each change of the component's standing. On a runtime.
pub fn follow_standing(
    component: &Component,
    tell: impl Fn(&Standing) + Send + 'static,
) -> AbortHandle {
    let mut standings = component.watch_standing();
    let task = async move {
        while standings.changed().await.is_ok() {
            let standing = *standings.borrow_and_update();
            tell(&standing);
        }
    };
    tokio::runtime::Handle::current().spawn(task).abort_handle()
}

/// Calls `tell` when a component is found (`true`) or lost. On a runtime.
pub fn follow_discovery(
    component: &Component,
    tell: impl Fn(JausId, bool) + Send + 'static,
) -> AbortHandle {
    let mut changes = component.watch();
    let task = async move {
        while let Some(change) = changes.next().await {
            match change {
                Change::Services(id) => tell(id, true),
                Change::Lost(id, _) => tell(id, false),
                _ => {}
            }
        }
    };
    tokio::runtime::Handle::current().spawn(task).abort_handle()
}

/// A step in the life of a subscription.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// A report, from its message code.
    Report(Bytes),
    /// Reports arrive from now on.
    Up,
    /// No reports arrive at present, for this reason. The subscription goes on and tries to get them again.
    Down(String),
    /// The peer has ended it for this reason.
    Ended(String),
    /// The component has stopped.
    Stopped,
}

/// Calls `tell` with each step of a subscription, until it ends.
pub async fn follow_reports(
    mut reports: Subscription<Undecoded>,
    tell: impl Fn(&Subscription<Undecoded>, Step) + Send,
) {
    while let Some(update) = reports.next().await {
        let step = match update {
            Update::Report(Undecoded(message)) => Step::Report(message),
            Update::Up => Step::Up,
            Update::Down { why, .. } => Step::Down(why.to_string()),
        };
        tell(&reports, step);
    }
    let end = reports.end().map(|end| Step::Ended(end.to_string()));
    tell(&reports, end.unwrap_or(Step::Stopped));
}
