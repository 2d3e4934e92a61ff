//! The querying side of discovery: which peer to query for what and when, and which to give up.

use std::time::{Duration, Instant};

use super::known::Known;
use super::questions::{Question, What};
use super::{Loss, Scope};
use crate::address::JausId;
use crate::messages::core::query_services::{ComponentRec, NodeRec, NodeSeq};
use crate::messages::core::{QueryConfiguration, QueryIdentification, QueryServices};
use crate::service::{Level, Outbox};

/// Limit of the delay of the first call. Spreads out a fleet that is switched on together.
const FIRST_CALL: Duration = Duration::from_millis(50);
/// Limit of components in one query for services to a component that answers for them.
const MOST_TOGETHER: usize = 128;
/// A listed component is lost after this many intervals in which it was not listed again.
const LISTED_IN_VAIN: u32 = 4;

impl Known {
    pub(super) fn handle_timeout(&mut self, now: Instant, out: &mut Outbox) {
        self.call(now, out);
        self.drop_the_silent(now, out);
        self.refresh(now);
        self.ask_due(now, out);
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let within = |budget: Option<Instant>, due: Instant| budget.map_or(due, |it| due.max(it));
        let (first, again) = (self.first.next(), self.again.next());
        let fresh = self.questions.fresh_since().map(|due| within(first, due));
        let asked = self.questions.first_due().map(|due| within(again, due));
        let looks = self.peers.first_look().map(|(due, _)| due);
        let refreshes = self.peers.first_refresh().map(|(due, _)| due);
        let all = [fresh, asked, looks, refreshes, self.next_call];
        all.into_iter().flatten().min()
    }

    /// Broadcasts a call if one is due.
    fn call(&mut self, now: Instant, out: &mut Outbox) {
        if self.scope == Scope::Nobody {
            return;
        }
        let Some(due) = self.next_call else {
            self.next_call = Some(now + self.jitter.up_to(FIRST_CALL));
            return;
        };
        if due > now {
            return;
        }
        match self.scope {
            Scope::Subsystem => out.broadcast_local(&identify(Level::Subsystem)),
            _ => out.broadcast(&identify(Level::Subsystem)),
        }
        self.calls = self.calls.saturating_add(1);
        let peers = self.peers.confirmed();
        let interval = match self.calls {
            1 => Duration::from_secs(1),
            2 => Duration::from_secs(2),
            _ => self.jitter.around(self.timing.call_interval(peers)),
        };
        self.next_call = Some(now + interval);
    }

    /// Probes peers that have been silent for too long, and drops those that do not answer. A peer
    /// that has never answered is dropped without probes. No silent peer stays only because too
    /// many others are being probed.
    fn drop_the_silent(&mut self, now: Instant, out: &mut Outbox) {
        let patience = self.timing.patience(self.peers.confirmed());
        while let Some((due, id)) = self.peers.first_look()
            && due <= now
            && let Some(peer) = self.peers.get(id)
        {
            let silence = now.saturating_duration_since(peer.heard);
            if silence < patience && peer.probes == 0 {
                self.peers.look_again(peer.heard + patience, id);
            } else if !peer.is_confirmed
                || peer.probes >= self.timing.probes
                || silence >= patience + self.timing.longest_search()
            {
                self.lose(now, id, Loss::Silent);
            } else if self.again.take(now) {
                self.peers.probe(now + self.timing.probe_interval, id);
                out.send(id, &identify(Level::Component));
            } else {
                self.peers.look_again(now + self.timing.probe_interval, id);
            }
        }
    }

    /// Repeats queries for facts that may have changed, and asks reporters whether they still list
    /// their components.
    fn refresh(&mut self, now: Instant) {
        let refresh = self.timing.refresh_interval(self.peers.confirmed());
        while let Some((due, id)) = self.peers.first_refresh()
            && due <= now
            && let Some(peer) = self.peers.get(id)
        {
            let (share, listed_by) = (peer.share, peer.listed_by);
            let silence = now.saturating_duration_since(peer.heard);
            let interval = listed_by.map_or(refresh, |_| self.timing.longest_silence);
            if listed_by.is_some() && silence > LISTED_IN_VAIN * interval {
                self.lose(now, id, Loss::Unlisted);
                continue;
            }
            let next = now + self.jitter.around(interval);
            self.peers.refresh_again(next, id);
            self.wonder(now, id, What::Services, share);
            match listed_by {
                Some(reporter) => self.wonder(now, reporter, What::Configuration, share),
                None => self.ask_who_it_is(now, id, share),
            }
            if self.reporters.get(&id.subsystem()) == Some(&id) {
                self.wonder(now, id, What::Configuration, share);
            }
            self.examine_server(now, id);
        }
    }

    /// Sends the queries that are due, as far as the budgets allow.
    fn ask_due(&mut self, now: Instant, out: &mut Outbox) {
        while let Some(question) = self.questions.next_fresh()
            && self.first.take(now)
        {
            self.ask(now, question, out);
        }
        while let Some(question) = self.questions.next_due(now)
            && self.again.take(now)
        {
            self.ask(now, question, out);
        }
    }

    fn ask(&mut self, now: Instant, question: Question, out: &mut Outbox) {
        let Question { about, what } = question;
        match what {
            What::Name(level) => out.send(about, &identify(level)),
            What::Configuration => {
                let query_type = 2.into();
                out.send(about, &QueryConfiguration { query_type });
            }
            What::Services => {
                let reporter = self.peers.get(about).and_then(|peer| peer.listed_by);
                let together = match reporter {
                    Some(reporter) => self.asked_together(now, question, reporter),
                    None => vec![about],
                };
                out.send(reporter.unwrap_or(about), &query_services(&together));
                for about in together {
                    self.asked(now, Question { about, what });
                }
                return;
            }
        }
        self.asked(now, question);
    }

    fn asked(&mut self, now: Instant, question: Question) {
        self.questions.ask(now, question, self.timing.refresh);
    }

    /// The components whose services the same reporter is to be queried for, with the same number
    /// of tries.
    fn asked_together(&self, now: Instant, first: Question, reporter: JausId) -> Vec<JausId> {
        let made = |about| {
            let what = What::Services;
            self.questions.made(now, Question { about, what })
        };
        let others = self.peers.listed_by(reporter);
        let others = others.filter(|&id| id != first.about && made(id) == made(first.about));
        let mut together: Vec<_> = others.take(MOST_TOGETHER - 1).collect();
        together.push(first.about);
        together.sort_unstable();
        together
    }
}

/// The query for the services of components, in the order of their ids.
fn query_services(about: &[JausId]) -> QueryServices {
    let nodes = about.chunk_by(|one, other| one.node() == other.node());
    let node_list = nodes.map(|components| NodeSeq {
        node_rec: NodeRec {
            node_id: components.first().map_or(0, |id| id.node()).into(),
        },
        component_list: components
            .iter()
            .map(|id| ComponentRec {
                component_id: id.component().into(),
            })
            .collect(),
    });
    QueryServices {
        node_list: node_list.collect(),
    }
}

fn identify(level: Level) -> QueryIdentification {
    let query_type = match level {
        Level::Subsystem => 2,
        Level::Node => 3,
        Level::Component => 4,
    };
    QueryIdentification {
        query_type: query_type.into(),
    }
}
