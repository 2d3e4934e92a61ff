//! The reports that a program has published, and the news of them for subscribers.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard};

use bytes::Bytes;
use jaus::component::Component;
use jaus::service::code_of;
use tokio::runtime::Handle;

use crate::lock::lock;

/// The published reports of a component.
#[derive(Debug, Default)]
pub struct Publications(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    /// By the code of the report.
    reports: BTreeMap<u16, Report>,
    /// Queries with a changed answer, of which the subscribers are not notified yet.
    changed: BTreeSet<u16>,
}

#[derive(Debug)]
struct Report {
    query: u16,
    latest: Option<Bytes>,
}

/// No service of the component publishes a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no service of the component publishes {report:04X}h")]
pub struct NotPublished {
    /// Its code.
    pub report: u16,
}

impl Publications {
    /// Makes room for the report with this code, which answers a query.
    pub fn admit(&self, query: u16, report: u16) {
        let latest = None;
        self.lock().reports.insert(report, Report { query, latest });
    }

    /// The report with this code that was published last.
    #[must_use]
    pub fn latest(&self, report: u16) -> Option<Bytes> {
        self.lock().reports.get(&report)?.latest.clone()
    }

    /// Replaces a report, which begins with its code; returns the code of the query that it answers.
    ///
    /// # Errors
    /// If no place was made for it.
    pub fn publish(&self, report: Bytes) -> Result<u16, NotPublished> {
        let code = code_of(&report).unwrap_or_default();
        let mut state = self.lock();
        let place = state.reports.get_mut(&code);
        let place = place.ok_or(NotPublished { report: code })?;
        place.latest = Some(report);
        Ok(place.query)
    }

    /// Tells subscribers of the query that its answer has changed. Does not wait; changes in quick
    /// succession are one.
    pub fn announce(self: &Arc<Self>, runtime: &Handle, component: Component, query: u16) {
        if !self.lock().changed.insert(query) {
            return;
        }
        let publications = self.clone();
        runtime.spawn(async move {
            publications.lock().changed.remove(&query);
            component.changed_undecoded(query).await;
        });
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.0)
    }
}
