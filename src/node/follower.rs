//! Follows changes of the host's interfaces: opens links on new ones, and closes the links of those
//! that are gone.
//!
//! Where possible the operating system reports changes; the follower also polls from time to time.
//! System calls run on a blocking thread and without the node's lock.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use tokio::task::spawn_blocking;

use super::core::Shared;
use super::links::Survey;
use crate::link::interface::Changes;
use crate::link::udp::UdpLink;
use crate::link::{Error, Interface};

/// Poll interval where the operating system does not report changes, or where an interface could
/// not be used yet.
const POLL: Duration = Duration::from_secs(2);
/// Poll interval otherwise, in case a report was lost. Longer than the tests wait for a report.
const FALLBACK: Duration = Duration::from_secs(120);
/// How long changes are collected before a poll: an interface that comes up causes several.
const SETTLE: Duration = Duration::from_millis(50);

/// Follows the interfaces until the node has stopped.
#[expect(
    clippy::disallowed_methods,
    reason = "it polls interfaces; the protocol does not depend on its clock"
)]
pub(super) async fn follow(shared: Arc<Shared>, mut changes: Changes) {
    // Addresses where a link could not be opened.
    let mut refused = BTreeSet::new();
    loop {
        let polls = !changes.are_announced() || !refused.is_empty();
        let longest = if polls { POLL } else { FALLBACK };
        tokio::select! {
            () = shared.stopped() => return,
            _ = tokio::time::timeout(longest, changes.next()) => {}
        }
        tokio::time::sleep(SETTLE).await;
        changes.forget();
        let node = shared.clone();
        let Ok(Some(failures)) = spawn_blocking(move || update(&node)).await else {
            continue;
        };
        let addresses = failures.iter().map(|(interface, _)| interface.at(0));
        let before = std::mem::replace(&mut refused, addresses.collect());
        for (interface, error) in failures {
            if !before.contains(&interface.at(0)) {
                tracing::warn!(%interface, %error, "cannot open a link on a new interface");
            }
        }
    }
}

/// Opens and closes links as the host's interfaces require. Returns the interfaces where that
/// failed; `None` if the host does not list its interfaces.
fn update(shared: &Shared) -> Option<Vec<(Interface, Error)>> {
    let survey = Survey::make(&shared.config)?;
    let (gone, came) = shared.lock().retire_links(&survey);
    let closed = gone.len();
    // The new links may need the same addresses.
    drop(gone);
    let settings = shared.config.udp();
    let (mut links, mut failures) = (Vec::new(), Vec::new());
    for interface in came {
        match UdpLink::open(&interface, &settings) {
            Ok(link) => links.push(link),
            Err(error) => failures.push((interface, error)),
        }
    }
    if closed + links.len() > 0 {
        shared.lock().adopt_links(links, survey);
    }
    Some(failures)
}
