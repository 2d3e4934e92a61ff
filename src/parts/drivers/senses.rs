//! Reports of whoever offers a service in the own subsystem: found, followed, and found again.

use crate::address::JausId;
use crate::codec::Message;
use crate::component::{Audience, Component, GroupSubscription, GroupUpdate, When};
use crate::parts::PartError;

/// The reports of one sensor of the own subsystem, whichever that is at the time.
///
/// If there are several, the first that reports is listened to until it is silent.
pub(in crate::parts) struct Sense<R> {
    reports: GroupSubscription<R>,
    source: Option<JausId>,
    what: &'static str,
}

impl<R: Message> Sense<R> {
    /// Begins to look for providers of a service, and to listen to one; people know it as `what`.
    pub(in crate::parts) fn of<Q: Message>(
        component: &Component,
        urn: &'static str,
        query: &Q,
        hz: f64,
        what: &'static str,
    ) -> Result<Self, PartError> {
        let providers = Audience::providers(urn).in_subsystem(component.id().subsystem());
        let reports = component.subscribe_all(providers, query, When::hz(hz));
        Ok(Self {
            reports: reports.map_err(|error| PartError::Broken(error.to_string()))?,
            source: None,
            what,
        })
    }

    /// Waits for the next report. Nothing is lost if the returned future is dropped.
    pub(in crate::parts) async fn next(&mut self) -> Result<R, PartError> {
        loop {
            let next = self.reports.next().await;
            let (source, update) = next.ok_or(PartError::NodeStopped)?;
            match update {
                GroupUpdate::Report(report) => {
                    if self.source.is_none() {
                        tracing::info!("{} from {source}", self.what);
                        self.source = Some(source);
                    }
                    if self.source == Some(source) {
                        return Ok(report);
                    }
                }
                GroupUpdate::Down { why, .. } if self.source == Some(source) => {
                    tracing::info!("no {} from {source}: {why}", self.what);
                    self.source = None;
                }
                GroupUpdate::Gone if self.source == Some(source) => {
                    tracing::info!("no {} from {source}: it is gone", self.what);
                    self.source = None;
                }
                _ => {}
            }
        }
    }
}
