//! Subscriptions of JAUS clients to states of the RA component.

use std::collections::BTreeMap;
use std::time::Instant;

use bytes::Bytes;

use super::Proxy;
use super::codes::crosses;
use crate::connection::Connections;
use crate::gateway::convert::Words;
use crate::gateway::counters::Tally;
use crate::gateway::pairs;
use jaus::endpoint::Received;
use jaus::messages::core::CreateEvent;
use jaus::service::code_of;

impl Proxy {
    /// Handles a subscription; it needs a report that can be sent at once.
    pub(super) fn subscribe(
        &mut self,
        now: Instant,
        message: &Received,
        wanted: Option<(f64, Bytes)>,
        tally: &mut Tally,
    ) {
        let state = wanted.and_then(|(hz, query)| Some((hz, state_of(&self.words, &query)?)));
        self.review = Some(now);
        match state {
            Some((hz, report)) if !self.is_fresh(now, report) => {
                self.hold(now, message, report, Some(hz), tally);
            }
            _ => self.stack.handle_message(now, message),
        }
    }

    /// The rates of all subscriptions, by RA report code.
    pub(super) fn wanted(&self) -> BTreeMap<u16, f64> {
        let mut wanted = BTreeMap::new();
        let subscribed = self.stack.subscribed();
        let subscribed = subscribed.filter_map(|(query, hz)| {
            let hz = hz.unwrap_or(Self::CHANGES_HZ);
            Some((state_of(&self.words, query)?, hz))
        });
        let held = self.held.iter().filter_map(|it| Some((it.report, it.hz?)));
        for (report, hz) in subscribed.chain(held) {
            let most = wanted.entry(report).or_insert(hz);
            *most = hz.max(*most).min(Connections::MAX_RATE);
        }
        wanted
    }
}

pub(super) fn hz_of(create: &CreateEvent) -> f64 {
    match create.event_type.0 {
        0 => create.requested_periodic_rate_hz(),
        _ => Proxy::CHANGES_HZ,
    }
}

/// The RA report that answers a JAUS query, if it is a state.
fn state_of(words: &Words, query: &Bytes) -> Option<u16> {
    let code = code_of(query)?;
    let (code, _) = crosses(code).then(|| words.to_ra(query).ok())??;
    let report = pairs::report_of(code)?;
    pairs::state(report).map(|_| report)
}
