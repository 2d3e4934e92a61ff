//! The shared discovery state of the components of one node: one directory, and one search that
//! maintains it.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::pace::{Budget, Jitter};
use super::peers::Peers;
use super::questions::{Question, Questions, What};
use super::register::Registrations;
use super::{Change, Discovery, Loss, Profile, Scope, Timing};
use crate::address::JausId;
use crate::service::share::Share;
use crate::service::{Directory, Level};

/// The directory that the components of one node share, and the search behind it.
///
/// Each component [joins](Discovery::join) it. The one with the lowest id sends calls and queries
/// for all. All share what any of them receives.
#[derive(Debug)]
pub struct NodeDirectory(Mutex<Known>);

/// Counts of what discovery has refused because of its limits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Refused {
    /// Components, and queries about components, beyond the share of their network address.
    pub no_room: u64,
    /// Messages longer than any valid one of their kind.
    pub too_long: u64,
    /// Lists of services that were truncated or dropped because they were too long.
    pub cut: u64,
    /// Names and lists of services that changed too often.
    pub too_often: u64,
}

#[derive(Debug)]
pub(super) struct Known {
    pub(super) scope: Scope,
    pub(super) timing: Timing,
    pub(super) jitter: Jitter,
    pub(super) directory: Arc<Directory>,
    pub(super) peers: Peers,
    pub(super) questions: Questions,
    /// For each subsystem, the component that is queried for its configuration.
    pub(super) reporters: BTreeMap<u16, JausId>,
    /// Budgets for first queries, and for repeated queries and probes.
    pub(super) first: Budget,
    pub(super) again: Budget,
    pub(super) calls: u32,
    pub(super) next_call: Option<Instant>,
    /// Registrations with servers that do not list a component of this node.
    pub(super) registrations: Registrations,
    /// The components of this node, with the number of the next change for each to read.
    members: BTreeMap<JausId, u64>,
    log: VecDeque<Change>,
    /// The number of the first change in the log.
    log_start: u64,
    /// The log length at which changes that every member has read are removed.
    log_limit: usize,
    refused: Refused,
    next_warning: Option<Instant>,
}

impl NodeDirectory {
    /// An empty directory for the components of one node. `seed` is for the jitter.
    #[must_use]
    pub fn new(scope: Scope, timing: Timing, seed: u64) -> Self {
        Self(Mutex::new(Known::new(scope, timing, seed)))
    }

    /// All known components, including those of the node.
    #[must_use]
    pub fn directory(&self) -> Arc<Directory> {
        self.lock().directory.clone()
    }

    /// The number of changes and of registrations so far. While it stays the same, members have
    /// nothing new to read or to do.
    #[must_use]
    pub fn change_count(&self) -> u64 {
        let known = self.lock();
        known.log_start + known.log.len() as u64 + known.registrations.count()
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Known> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Known {
    /// Budget of first queries: a burst, to find a whole network at once, then one per interval.
    /// JAUS++ handles some 900 messages per second.
    const FIRST_BURST: u32 = 96;
    const FIRST_REFILL: Duration = Duration::from_millis(5);
    /// Budget of repeated queries and probes.
    const AGAIN_BURST: u32 = 64;
    const AGAIN_REFILL: Duration = Duration::from_millis(31);
    /// Limits of changes that are kept for components that have not read them.
    const LONGEST_LOG: usize = 8192;
    const SHORTEST_LOG: usize = 64;
    /// The shortest interval between warnings about refused entries.
    const WARNING_INTERVAL: Duration = Duration::from_secs(30);

    fn new(scope: Scope, timing: Timing, seed: u64) -> Self {
        Self {
            scope,
            timing,
            jitter: Jitter::new(seed),
            directory: Arc::default(),
            peers: Peers::new(timing.max_components),
            questions: Questions::new(timing.max_components.saturating_mul(2)),
            reporters: BTreeMap::new(),
            first: Budget::new(Self::FIRST_BURST, Self::FIRST_REFILL),
            again: Budget::new(Self::AGAIN_BURST, Self::AGAIN_REFILL),
            calls: 0,
            next_call: None,
            registrations: Registrations::default(),
            members: BTreeMap::new(),
            log: VecDeque::new(),
            log_start: 0,
            log_limit: Self::SHORTEST_LOG,
            refused: Refused::default(),
            next_warning: None,
        }
    }

    pub(super) fn refused(&self) -> Refused {
        self.refused
    }

    /// The tree, for changes. It is copied first if an application holds it.
    pub(super) fn tree(&mut self) -> &mut Directory {
        Arc::make_mut(&mut self.directory)
    }

    /// Adds a component of this node. Its subsystem and node keep the names that they have.
    pub(super) fn join(&mut self, own: JausId, profile: &Profile) {
        self.questions.forget(own);
        self.peers.remove(own);
        let is_first = self.directory.subsystem(own.subsystem()).is_none();
        let tree = self.tree();
        tree.remove(own);
        tree.insert(own);
        for level in [Level::Subsystem, Level::Node, Level::Component] {
            let known = tree.identification(level, own);
            if known.is_none_or(|known| known.name.is_empty()) {
                tree.identify(level, own, profile.identification(level));
            }
        }
        if is_first {
            self.tell(Change::SubsystemFound(own.subsystem()));
        }
        self.tell(Change::Found(own));
        self.tell(Change::Identified(Level::Component, own));
        self.members.insert(own, 0);
        self.skip(own);
    }

    /// Removes a component of this node.
    pub(super) fn leave(&mut self, own: JausId) {
        self.members.remove(&own);
        self.registrations.take(own);
        self.tree().remove(own);
        self.tell(Change::Lost(own, Loss::Unlisted));
    }

    /// The components of this node.
    pub(super) fn members(&self) -> impl Iterator<Item = JausId> + '_ {
        self.members.keys().copied()
    }

    /// Whether a component sends calls and queries for all.
    pub(super) fn is_leader(&self, id: JausId) -> bool {
        self.members.keys().next() == Some(&id)
    }

    /// Whether `id` is a component in scope that is not of this node.
    pub(super) fn covers(&self, id: JausId) -> bool {
        let mut members = self.members.keys();
        let in_scope = match self.scope {
            Scope::System => true,
            Scope::Subsystem => members.next().map(|own| own.subsystem()) == Some(id.subsystem()),
            Scope::Nobody => false,
        };
        in_scope && id.is_unicast() && !self.members.contains_key(&id)
    }

    /// Whether a component is of this node or was heard directly. Only those are reported to
    /// others: two nodes that repeat each other's lists would keep dead components alive for ever.
    pub(super) fn is_heard(&self, id: JausId) -> bool {
        let speaks = |peer: &super::peers::Peer| peer.listed_by.is_none();
        self.members.contains_key(&id) || self.peers.get(id).is_some_and(speaks)
    }

    /// Queues a query, as far as the share of the component's address allows.
    pub(super) fn wonder(&mut self, now: Instant, about: JausId, what: What, share: Share) {
        let is_wanted = self.scope != Scope::Nobody;
        if is_wanted && !self.questions.wonder(now, Question { about, what }, share) {
            self.refuse(now, |refused| &mut refused.no_room);
        }
    }

    /// Counts something that exceeds the limits, with a warning from time to time.
    pub(super) fn refuse(&mut self, now: Instant, count: impl FnOnce(&mut Refused) -> &mut u64) {
        *count(&mut self.refused) += 1;
        if self.next_warning.is_none_or(|due| due <= now) {
            self.next_warning = Some(now + Self::WARNING_INTERVAL);
            let Refused {
                no_room,
                too_long,
                cut,
                too_often,
            } = self.refused;
            tracing::warn!(
                no_room,
                too_long,
                cut,
                too_often,
                "discovery truncates a peer's report: it exceeds the limits"
            );
        }
    }

    /// Logs a change for all components of this node.
    pub(super) fn tell(&mut self, change: Change) {
        if self.log.len() >= self.log_limit {
            self.trim();
        }
        self.log.push_back(change);
    }

    /// The next change that a component has not read.
    pub(super) fn poll_change(&mut self, own: JausId) -> Option<Change> {
        let next = self.members.get_mut(&own)?;
        *next = (*next).max(self.log_start);
        let place = usize::try_from(*next - self.log_start).ok()?;
        let change = *self.log.get(place)?;
        *next += 1;
        Some(change)
    }

    /// Marks all changes so far as read.
    pub(super) fn skip(&mut self, own: JausId) {
        let end = self.log_start + self.log.len() as u64;
        if let Some(next) = self.members.get_mut(&own) {
            *next = end;
        }
    }

    /// Drops the changes that every member has read, and the oldest ones if there are too many.
    fn trim(&mut self) {
        let end = self.log_start + self.log.len() as u64;
        let oldest = self.members.values().copied().min().unwrap_or(end);
        while self.log_start < oldest || self.log.len() >= Self::LONGEST_LOG {
            self.log.pop_front();
            self.log_start += 1;
        }
        self.log_limit = (2 * self.log.len()).clamp(Self::SHORTEST_LOG, Self::LONGEST_LOG);
        self.log.shrink_to(self.log_limit);
    }
}

impl Drop for Discovery {
    fn drop(&mut self) {
        self.known.lock().leave(self.own);
    }
}
