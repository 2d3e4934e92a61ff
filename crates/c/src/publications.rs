//! The reports that a program has published, and the news of them for subscribers.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard};

use bytes::Bytes;
use jaus::component::Component;
use tokio::runtime::Handle;

use crate::lock::lock;
use crate::status::{Failure, JausStatus};

/// The published reports of a component.
#[derive(Default)]
pub(crate) struct Publications(Mutex<State>);

#[derive(Default)]
struct State {
    /// By the code of the report.
    reports: BTreeMap<u16, Report>,
    /// Queries whose subscribers are to be told that the answer has changed.
    changed: BTreeSet<u16>,
}

struct Report {
    query: u16,
    latest: Option<Bytes>,
}

impl Publications {
    /// Makes room for the report with this code, which answers a query.
    pub(crate) fn admit(&self, query: u16, report: u16) {
        let latest = None;
        self.lock().reports.insert(report, Report { query, latest });
    }

    pub(crate) fn latest(&self, report: u16) -> Option<Bytes> {
        self.lock().reports.get(&report)?.latest.clone()
    }

    /// Replaces a report; returns the code of the query that it answers.
    pub(crate) fn publish(&self, code: u16, report: Bytes) -> Result<u16, Failure> {
        let mut state = self.lock();
        let Some(place) = state.reports.get_mut(&code) else {
            let text = format!(
                "no service of the component publishes {code:04X}h: call jaus_service_publish with \
                 the code of its query"
            );
            return Err(Failure::new(JausStatus::NotFound, text));
        };
        place.latest = Some(report);
        Ok(place.query)
    }

    /// Tells subscribers of the query that its answer has changed. Does not wait; changes in quick
    /// succession are one.
    pub(crate) fn announce(self: &Arc<Self>, runtime: &Handle, component: Component, query: u16) {
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
