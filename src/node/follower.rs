//! Follows changes of the host's interfaces: opens links on new ones, and closes the links of those
//! that are gone.
//!
//! Where possible the operating system reports changes; the follower also polls from time to time.
//! System calls run on a blocking thread and without the node's lock.

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use super::Config;
use super::core::Shared;
use super::links::Survey;
use crate::link::interface::Changes;
use crate::link::udp::UdpLink;
use crate::link::{Interface, udp};

/// Poll interval where the operating system does not report changes, or where an interface could
/// not be used yet.
const POLL: Duration = Duration::from_secs(2);
/// Poll interval otherwise, in case a report was lost.
const FALLBACK: Duration = Duration::from_secs(60);
/// How long changes are collected before a poll: an interface that comes up causes several.
const SETTLE: Duration = Duration::from_millis(50);

/// The task that follows the interfaces.
#[derive(Debug)]
pub(super) struct Follower {
    shared: Arc<Shared>,
    config: Arc<Config>,
    changes: Changes,
    /// Addresses where a link could not be opened. The warning is logged once.
    refused: BTreeSet<SocketAddr>,
}

impl Follower {
    pub(super) fn new(shared: Arc<Shared>, config: &Config) -> Self {
        Self {
            shared,
            config: Arc::new(config.clone()),
            changes: Changes::open(),
            refused: BTreeSet::new(),
        }
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "it polls interfaces; the protocol does not depend on its clock"
    )]
    pub(super) async fn run(mut self) {
        let mut stopped = self.shared.stopped.subscribe();
        loop {
            let polls = !self.changes.are_announced() || !self.refused.is_empty();
            let longest = if polls { POLL } else { FALLBACK };
            tokio::select! {
                _ = stopped.wait_for(|stopped| *stopped) => return,
                _ = tokio::time::timeout(longest, self.changes.next()) => {}
            }
            tokio::time::sleep(SETTLE).await;
            self.changes.forget();
            self.look().await;
        }
    }

    async fn look(&mut self) {
        let config = self.config.clone();
        let Some(survey) = blocking(move || Survey::make(&config)).await.flatten() else {
            return;
        };
        let (gone, came) = self.shared.lock().retire_links(&survey);
        if gone.is_empty() && came.is_empty() {
            self.refused.clear();
            return;
        }
        let settings = self.config.udp();
        let is_change = !gone.is_empty();
        let Some(opened) = blocking(move || open(gone, came, &settings)).await else {
            return;
        };
        let links = self.sort_out(opened);
        if is_change || !links.is_empty() {
            self.shared.lock().adopt_links(links, survey);
        }
    }

    /// The links that could be opened. Warns about the others.
    fn sort_out(&mut self, opened: Vec<Opened>) -> Vec<UdpLink> {
        let mut links = Vec::new();
        let before = std::mem::take(&mut self.refused);
        for (interface, result) in opened {
            match result {
                Ok(link) => links.push(link),
                Err(error) => {
                    if !before.contains(&interface.at(0)) {
                        tracing::warn!(%interface, %error, "cannot open a link on a new interface");
                    }
                    self.refused.insert(interface.at(0));
                }
            }
        }
        links
    }
}

type Opened = (Interface, Result<UdpLink, crate::link::Error>);

/// Closes links and opens others, which may need the same addresses.
fn open(gone: Vec<UdpLink>, came: Vec<Interface>, settings: &udp::Settings) -> Vec<Opened> {
    drop(gone);
    let open = |interface: Interface| {
        let link = UdpLink::open(&interface, settings);
        (interface, link)
    };
    came.into_iter().map(open).collect()
}

/// The result of blocking work; `None` if the runtime is shutting down.
async fn blocking<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
    tokio::task::spawn_blocking(work).await.ok()
}
