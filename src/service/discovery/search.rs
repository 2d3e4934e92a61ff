//! The asking side: whom to ask what, when, how often, and whom to give up.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::pace::{Budget, Jitter};
use super::{Discovery, Loss, Scope, Timing};
use crate::address::JausId;
use crate::messages::core::query_services::{ComponentRec, NodeRec, NodeSeq};
use crate::messages::core::{QueryConfiguration, QueryIdentification, QueryServices};
use crate::service::{Level, Outbox};

/// Something to be found out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Question {
    /// Kind and name, asked of the component itself.
    Identify(JausId, Level),
    /// The services of a component, asked of itself or of the one that listed it.
    Services(JausId),
    /// The components of a subsystem, asked of one of them.
    Configuration(JausId),
}

/// A component of which we know.
#[derive(Debug)]
pub(super) struct Peer {
    /// When it, or the one that listed it, was heard.
    pub(super) heard: Instant,
    /// Who listed it; `None` if it speaks for itself.
    pub(super) listed_by: Option<JausId>,
    /// How often it has been asked since it was heard.
    probes: u32,
    next_probe: Instant,
    next_refresh: Instant,
}

/// How often a question has been asked, and when it is due again.
#[derive(Debug)]
struct Attempts {
    made: u32,
    next: Instant,
}

/// Who is known and what is still to be asked.
#[derive(Debug)]
pub(super) struct Search {
    scope: Scope,
    timing: Timing,
    jitter: Jitter,
    budget: Budget,
    pub(super) peers: BTreeMap<JausId, Peer>,
    /// For each subsystem, the component that is asked for its configuration.
    pub(super) reporters: BTreeMap<u16, JausId>,
    questions: BTreeMap<Question, Attempts>,
    calls: u32,
    next_call: Option<Instant>,
    ignored: u64,
}

impl Search {
    /// A question is asked at most so often before the next refresh …
    const TRIES: u32 = 3;
    /// … again after this time, then after twice as long, and so on.
    const RETRY: Duration = Duration::from_secs(1);
    /// All questions together: a burst of this many, for a network that is found at once …
    const BURST: u32 = 96;
    /// … and then one in this time.
    const REFILL: Duration = Duration::from_secs(1);
    /// So many of the burst are kept for questions that were never asked: those about newcomers,
    /// who are not to wait because many others have fallen silent and are asked in vain.
    const FOR_NEWCOMERS: u32 = 32;
    /// The first call comes within this time, so that a fleet switched on together spreads out.
    const FIRST_CALL: Duration = Duration::from_millis(50);

    pub(super) fn new(scope: Scope, timing: Timing, seed: u64) -> Self {
        Self {
            scope,
            timing,
            jitter: Jitter::new(seed),
            budget: Budget::new(Self::BURST, Self::REFILL),
            peers: BTreeMap::new(),
            reporters: BTreeMap::new(),
            questions: BTreeMap::new(),
            calls: 0,
            next_call: None,
            ignored: 0,
        }
    }

    /// Whether `id`, as seen from `own`, is somebody to know.
    pub(super) fn covers(&self, own: JausId, id: JausId) -> bool {
        let in_scope = match self.scope {
            Scope::System => true,
            Scope::Subsystem => own.subsystem() == id.subsystem(),
            Scope::Nobody => false,
        };
        in_scope && id.is_unicast() && id != own
    }

    /// Takes a component in. `None` if there is no room, else whether it is new.
    pub(super) fn admit(
        &mut self,
        now: Instant,
        id: JausId,
        listed_by: Option<JausId>,
    ) -> Option<bool> {
        let patience = self.timing.patience(self.direct());
        if let Some(peer) = self.peers.get_mut(&id) {
            if listed_by.is_none() {
                peer.listed_by = None;
            }
            if listed_by.is_none() || peer.listed_by == listed_by {
                peer.hear(now, patience);
            }
            return Some(false);
        }
        if self.peers.len() >= self.timing.max_components {
            self.ignored += 1;
            tracing::debug!(%id, ignored = self.ignored, "no room for another component");
            return None;
        }
        let refresh = self
            .jitter
            .around(self.timing.refresh_interval(self.direct() + 1));
        let peer = Peer {
            heard: now,
            listed_by,
            probes: 0,
            next_probe: now + patience,
            next_refresh: now + refresh,
        };
        self.peers.insert(id, peer);
        Some(true)
    }

    /// Something came from a component; says whether it is known.
    pub(super) fn hear(&mut self, now: Instant, id: JausId) -> bool {
        let patience = self.timing.patience(self.direct());
        let Some(peer) = self.peers.get_mut(&id) else {
            return false;
        };
        peer.hear(now, patience);
        true
    }

    /// Whether a component is known from another one's list alone.
    pub(super) fn is_listed(&self, id: JausId) -> bool {
        let peer = self.peers.get(&id);
        peer.is_some_and(|peer| peer.listed_by.is_some())
    }

    /// Forgets a component and what was to be asked about it.
    pub(super) fn forget(&mut self, id: JausId) {
        self.peers.remove(&id);
        self.questions.retain(|question, _| question.about() != id);
        if self.reporters.get(&id.subsystem()) == Some(&id) {
            self.reporters.remove(&id.subsystem());
        }
    }

    /// Puts a question on the list, unless it is there: also one that was asked in vain stays for
    /// a while, so that a component without Discovery is not asked for ever.
    pub(super) fn wonder(&mut self, now: Instant, question: Question) {
        let room = self.questions.len() < self.timing.max_components.saturating_mul(4);
        if self.scope != Scope::Nobody && room {
            self.questions
                .entry(question)
                .or_insert(Attempts { made: 0, next: now });
        }
    }

    /// Takes a question off the list; says whether it was on it.
    pub(super) fn settle(&mut self, question: Question) -> bool {
        self.questions.remove(&question).is_some()
    }

    /// Asks what is due, as far as the budget goes: first what was never asked.
    pub(super) fn ask_due(&mut self, now: Instant, out: &mut Outbox) {
        self.questions
            .retain(|_, attempts| attempts.next > now || attempts.made < Self::TRIES);
        for asked_before in [false, true] {
            for (question, attempts) in &mut self.questions {
                if attempts.next > now || (attempts.made > 0) != asked_before {
                    continue;
                }
                if !self.budget.take_above(attempts.reserve(), now) {
                    break;
                }
                attempts.made += 1;
                let pause = if attempts.made < Self::TRIES {
                    Self::RETRY * attempts.made
                } else {
                    self.timing.refresh
                };
                attempts.next = now + pause;
                let listed_by = self
                    .peers
                    .get(&question.about())
                    .and_then(|peer| peer.listed_by);
                question.ask(listed_by, out);
            }
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let within_budget = |due: Instant, reserve| match self.budget.next_above(reserve) {
            Some(refilled) => due.max(refilled),
            None => due,
        };
        let questions = self.questions.values();
        let questions = questions.map(|it| within_budget(it.next, it.reserve()));
        let probes = self.speakers();
        let probes = probes.map(|(_, peer)| within_budget(peer.next_probe, Self::FOR_NEWCOMERS));
        let refreshes = self.peers.values().map(|peer| peer.next_refresh);
        let all = questions.chain(probes).chain(refreshes);
        all.chain(self.next_call).min()
    }

    /// The peers that speak for themselves.
    pub(super) fn speakers(&self) -> impl Iterator<Item = (JausId, &Peer)> {
        self.peers
            .iter()
            .filter(|(_, peer)| peer.listed_by.is_none())
            .map(|(&id, peer)| (id, peer))
    }

    fn direct(&self) -> usize {
        self.speakers().count()
    }
}

impl Attempts {
    /// What the question leaves of the budget.
    const fn reserve(&self) -> u32 {
        if self.made == 0 {
            0
        } else {
            Search::FOR_NEWCOMERS
        }
    }
}

impl Peer {
    fn hear(&mut self, now: Instant, patience: Duration) {
        self.heard = now;
        self.probes = 0;
        self.next_probe = now + patience;
    }
}

impl Question {
    /// The component in question.
    const fn about(self) -> JausId {
        match self {
            Self::Identify(id, _) | Self::Services(id) | Self::Configuration(id) => id,
        }
    }

    fn ask(self, listed_by: Option<JausId>, out: &mut Outbox) {
        match self {
            Self::Identify(id, level) => out.send(id, &identify(level)),
            Self::Configuration(id) => out.send(
                id,
                &QueryConfiguration {
                    query_type: 2.into(),
                },
            ),
            Self::Services(id) => {
                let component = ComponentRec {
                    component_id: id.component().into(),
                };
                let node = NodeSeq {
                    node_rec: NodeRec {
                        node_id: id.node().into(),
                    },
                    component_list: vec![component],
                };
                let query = QueryServices {
                    node_list: vec![node],
                };
                out.send(listed_by.unwrap_or(id), &query);
            }
        }
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

impl Discovery {
    /// Calls everybody if it is time to.
    pub(super) fn call(&mut self, now: Instant, out: &mut Outbox) {
        let search = &mut self.search;
        if search.scope == Scope::Nobody {
            return;
        }
        let Some(due) = search.next_call else {
            search.next_call = Some(now + search.jitter.up_to(Search::FIRST_CALL));
            return;
        };
        if due > now {
            return;
        }
        match search.scope {
            Scope::Subsystem => out.broadcast_local(&identify(Level::Subsystem)),
            _ => out.broadcast(&identify(Level::Subsystem)),
        }
        search.calls = search.calls.saturating_add(1);
        let interval = match search.calls {
            1 => Duration::from_secs(1),
            2 => Duration::from_secs(2),
            _ => search
                .jitter
                .around(search.timing.call_interval(search.direct())),
        };
        search.next_call = Some(now + interval);
    }

    /// Asks those from whom nothing has come for too long, and drops those that do not answer.
    pub(super) fn drop_the_silent(&mut self, now: Instant, out: &mut Outbox) {
        let search = &mut self.search;
        let mut gone = Vec::new();
        for (&id, peer) in &mut search.peers {
            if peer.listed_by.is_some() || peer.next_probe > now {
                continue;
            }
            if peer.probes == search.timing.probes {
                gone.push(id);
            } else if search.budget.take_above(Search::FOR_NEWCOMERS, now) {
                peer.probes += 1;
                peer.next_probe = now + search.timing.probe_interval;
                out.send(id, &identify(Level::Component));
            }
        }
        for id in gone {
            self.lose(now, id, Loss::Silent);
        }
    }

    /// Asks again what may have changed.
    pub(super) fn refresh(&mut self, now: Instant) {
        let search = &mut self.search;
        let interval = search.timing.refresh_interval(search.direct());
        let mut due = Vec::new();
        for (&id, peer) in &mut search.peers {
            if peer.next_refresh <= now {
                peer.next_refresh = now + search.jitter.around(interval);
                due.push(id);
            }
        }
        for id in due {
            search.wonder(now, Question::Services(id));
            if search.reporters.get(&id.subsystem()) == Some(&id) {
                search.wonder(now, Question::Configuration(id));
            }
        }
    }
}
