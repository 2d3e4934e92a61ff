//! Caches the last reports of an RA component; the proxy's services answer from this cache.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::super::convert::Words;
use super::super::pairs;
use jaus::codec::{Message, ServiceId};
use jaus::endpoint::Received;
use jaus::messages::core::{
    QueryAuthority, QueryControl, QueryTimeout, ReportAuthority, ReportControl, ReportTimeout,
    report_timeout,
};

use jaus::service::{Context, Controller, Handled, Service, code_of};

/// Maximum age of a report.
const OLDEST: Duration = Duration::from_secs(10);

/// Cached state of one RA component. Clones share one cache.
#[derive(Debug, Clone, Default)]
pub(super) struct Mirror(Arc<Mutex<Known>>);

#[derive(Debug, Default)]
struct Known {
    /// States by report code; bounded by the number of such codes.
    reports: BTreeMap<u16, Kept>,
    controller: Option<Controller>,
}

#[derive(Debug)]
struct Kept {
    at: Instant,
    data: Bytes,
}

impl Mirror {
    /// Stores a report. Returns whether it differs from the one before.
    pub(super) fn keep(&self, now: Instant, report: u16, data: Bytes) -> bool {
        let kept = Kept { at: now, data };
        let mut known = self.lock();
        let before = known.reports.get(&report).map(|it| it.data.clone());
        let changed = before.as_ref() != Some(&kept.data);
        known.reports.insert(report, kept);
        changed
    }

    /// Invalidates a report.
    pub(super) fn outdate(&self, report: u16) {
        self.lock().reports.remove(&report);
    }

    /// Age of a report; `None` if there is none.
    pub(super) fn age(&self, now: Instant, report: u16) -> Option<Duration> {
        let known = self.lock();
        let kept = known.reports.get(&report)?;
        Some(now.saturating_duration_since(kept.at))
    }

    /// Stores the controller. Returns whether it was known already.
    pub(super) fn controller_is(&self, controller: Option<Controller>) -> bool {
        let before = std::mem::replace(&mut self.lock().controller, controller);
        before == controller
    }

    /// Answers a JAUS query from the cache.
    fn answer(&self, now: Instant, query: &Bytes, words: &Words) -> Option<Bytes> {
        let (code, body) = words.to_ra(query).ok()?;
        let state = pairs::state(pairs::report_of(code)?)?;
        let wanted = state.wanted(&body)?;
        let known = self.lock();
        let kept = known.reports.get(&state.report)?;
        if now.saturating_duration_since(kept.at) > OLDEST {
            return None;
        }
        let report = state.narrow(&kept.data, wanted);
        words.to_jaus(state.report, &report).ok()
    }

    fn controller(&self) -> Option<Controller> {
        self.lock().controller
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The services of a proxy.
#[derive(Debug)]
pub(super) struct Mirrored {
    pub(super) mirror: Mirror,
    pub(super) words: Words,
    pub(super) offers: Vec<ServiceId>,
    /// Timeout of control without a renewal; zero: until it is released or taken.
    pub(super) timeout: Duration,
}

impl Service for Mirrored {
    fn offers(&self) -> Vec<ServiceId> {
        self.offers.clone()
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        let controller = self.mirror.controller();
        match code_of(&message.payload) {
            Some(QueryControl::CODE) => {
                let report = controller.map_or_else(ReportControl::default, |it| ReportControl {
                    subsystem_id: it.id.subsystem(),
                    node_id: it.id.node(),
                    component_id: it.id.component(),
                    authority_code: it.authority,
                });
                context.reply(message, &report);
            }
            Some(QueryAuthority::CODE) => {
                let authority_code = controller.map_or(0, |it| it.authority);
                context.reply(message, &ReportAuthority { authority_code });
            }
            Some(QueryTimeout::CODE) => {
                let seconds = u8::try_from(self.timeout.as_secs()).unwrap_or(u8::MAX);
                let timeout = report_timeout::Timeout(seconds);
                context.reply(message, &ReportTimeout { timeout });
            }
            _ => match self.mirror.answer(now, &message.payload, &self.words) {
                Some(answer) => context.send_octets(message.source, answer),
                None => return Handled::No,
            },
        }
        Handled::Yes
    }
}
