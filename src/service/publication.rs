//! Published reports: the latest value of each, encoded once for every query that requests the same
//! fields of it.

use std::any::Any;
use std::collections::VecDeque;
use std::fmt;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use bytes::Bytes;

use super::Context;
use crate::codec::{DecodeError, Message, Query, Report};
use crate::endpoint::Received;

/// A report on its way to the service that answers queries with it.
#[derive(Clone)]
pub struct Publication {
    report: Arc<dyn Any + Send + Sync>,
    name: &'static str,
}

impl Publication {
    /// A report with the time of its sample, which is set in the report's time fields unless they
    /// are set already.
    #[must_use]
    pub fn new<R: Report>(mut report: R, sampled_at: SystemTime) -> Self {
        // Clocks before 1970 are not set.
        let since_1970 = sampled_at.duration_since(UNIX_EPOCH).unwrap_or_default();
        report.stamp(since_1970);
        Self {
            report: Arc::new(report),
            name: R::NAME,
        }
    }

    /// The report, if it is of this type.
    #[must_use]
    pub fn report<R: Report>(&self) -> Option<Arc<R>> {
        self.report.clone().downcast().ok()
    }

    /// The error when no service publishes it.
    pub(super) const fn refused(&self) -> NotPublished {
        NotPublished { report: self.name }
    }
}

impl fmt::Debug for Publication {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Publication").field(&self.name).finish()
    }
}

/// No service of the component publishes the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "no service of this component publishes {report}: offer one with `Handlers::publishes` of its \
     query"
)]
pub struct NotPublished {
    /// The name of the report.
    pub report: &'static str,
}

/// The latest published report that answers the query `Q`.
pub(super) struct Latest<Q: Query> {
    report: Option<Arc<Q::Report>>,
    /// Queries with the encoded reports that answer them, the oldest first.
    encoded: VecDeque<(Bytes, Bytes)>,
}

impl<Q: Query> Latest<Q> {
    /// Limit of encodings that are kept: the queries with different presence vectors.
    const MOST: usize = 8;

    pub(super) const fn new() -> Self {
        Self {
            report: None,
            encoded: VecDeque::new(),
        }
    }

    /// Replaces the report; returns whether the publication is one for this query.
    pub(super) fn publish(&mut self, publication: &Publication) -> bool {
        let Some(report) = publication.report() else {
            return false;
        };
        self.report = Some(report);
        self.encoded.clear();
        true
    }

    /// Answers a query. Before the first publication it has no answer, unless the report needs no
    /// value.
    pub(super) fn answer(
        &mut self,
        received: &Received,
        context: &mut Context<'_>,
    ) -> Result<(), DecodeError> {
        let known = self.encoded.iter();
        let known = known.filter(|(query, _)| *query == received.payload);
        if let Some((_, report)) = known.last() {
            context.reply_octets(received, report.clone());
            return Ok(());
        }
        let query = Q::decode(&received.payload)?;
        let Some(mut report) = self.current() else {
            tracing::debug!(source = %received.source, query = Q::NAME, "no report published yet");
            return Ok(());
        };
        query.drop_unrequested(&mut report);
        match report.encode() {
            Ok(octets) => {
                self.keep(&received.payload, &octets);
                context.reply_octets(received, octets);
            }
            // The application published more elements than a count field can hold.
            Err(error) => tracing::error!(%error, "cannot send the report"),
        }
        Ok(())
    }

    fn current(&self) -> Option<Q::Report> {
        let published = self.report.as_deref().cloned();
        published.or_else(Q::Report::without_values)
    }

    fn keep(&mut self, query: &Bytes, report: &Bytes) {
        if self.encoded.len() >= Self::MOST {
            self.encoded.pop_front();
        }
        // A copy of the query frees the datagram that contains it.
        let query = Bytes::copy_from_slice(query);
        self.encoded.push_back((query, report.clone()));
    }
}
