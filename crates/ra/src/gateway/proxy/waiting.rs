//! JAUS clients that wait for reports of the RA component: for a missing state, or for the answer
//! to a relayed query.

use std::time::Instant;

use bytes::Bytes;

use super::Proxy;
use crate::gateway::counters::{Counter, Tally};
use crate::gateway::pairs;
use jaus::address::JausId;
use jaus::endpoint::Received;
use jaus::service::code_of;

/// A client message that waits for a report.
pub(super) struct Held {
    pub(super) message: Received,
    pub(super) report: u16,
    /// The rate of the required service connection, if any.
    pub(super) hz: Option<f64>,
    pub(super) until: Instant,
    pub(super) next: Instant,
}

/// A client that waits for the answer to a relayed query.
pub(super) struct Relayed {
    pub(super) client: JausId,
    pub(super) report: u16,
    pub(super) until: Instant,
}

impl Proxy {
    /// Relays a query and remembers its client.
    pub(super) fn relay(
        &mut self,
        now: Instant,
        client: JausId,
        report: u16,
        query: (u16, Bytes),
        tally: &mut Tally,
    ) {
        if self.relayed.len() >= Self::MOST_WAITING {
            return tally.refuse(now, Counter::TooManyWaiting, query.0, client);
        }
        tally.add(Counter::QueriesToRa);
        self.to_ra.push(query);
        self.expect(now, client, report);
    }

    /// Sends the next report of this code to the client.
    pub(super) fn expect(&mut self, now: Instant, client: JausId, report: u16) {
        if self.relayed.len() < Self::MOST_WAITING {
            self.relayed.push_back(Relayed {
                client,
                report,
                until: now + self.patience,
            });
        }
    }

    /// Holds a client's message until its report arrives.
    pub(super) fn hold(
        &mut self,
        now: Instant,
        message: &Received,
        report: u16,
        hz: Option<f64>,
        tally: &mut Tally,
    ) {
        let until = now + self.patience;
        let same = |it: &&mut Held| {
            it.message.source == message.source && it.message.payload == message.payload
        };
        if let Some(held) = self.held.iter_mut().find(same) {
            held.until = until;
            return tally.add(Counter::Repeated);
        }
        if self.held.len() >= Self::MOST_WAITING {
            let code = code_of(&message.payload).unwrap_or_default();
            return tally.refuse(now, Counter::TooManyWaiting, code, message.source);
        }
        let asked = self.held.iter().any(|it| it.report == report);
        if !asked {
            tally.add(Counter::QueriesToRa);
            self.ask(report);
        }
        self.held.push(Held {
            message: message.clone(),
            report,
            hz,
            until,
            next: now + Self::ASK_AGAIN,
        });
    }

    /// Queries the whole of a state.
    pub(super) fn ask(&mut self, report: u16) {
        if let Some(state) = pairs::state(report) {
            self.to_ra.push((state.query(), state.query_for_all()));
        }
    }

    /// Whether the last report is recent enough to be sent without a query.
    pub(super) fn is_fresh(&self, now: Instant, report: u16) -> bool {
        let limit = self.streams.freshness(report).unwrap_or_default();
        let age = self.mirror.age(now, report);
        age.is_some_and(|age| age <= limit.max(Self::FRESH))
    }

    /// Repeats pending queries, and drops expired ones.
    pub(super) fn ask_again(&mut self, now: Instant, tally: &mut Tally) {
        let mut reports = Vec::new();
        let mut need_connection = false;
        let ra = self.ra;
        self.held.retain_mut(|it| {
            if now >= it.until {
                tally.refuse(now, Counter::Unanswered, it.report, ra);
                return false;
            }
            if now >= it.next {
                it.next = now + Self::ASK_AGAIN;
                // Some components report by service connections only.
                need_connection |= it.hz.is_none();
                it.hz.get_or_insert(Self::CHANGES_HZ);
                if !reports.contains(&it.report) {
                    reports.push(it.report);
                }
            }
            true
        });
        if need_connection {
            self.review = Some(now);
        }
        for report in reports {
            self.ask(report);
        }
    }
}
