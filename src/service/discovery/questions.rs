//! The queue of discovery queries: first queries, round robin over the network addresses that they
//! are about, and repeated queries.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;
use std::time::{Duration, Instant};

use jaus_limits::Shares;

use crate::address::JausId;
use crate::service::Level;
use crate::service::share::Share;

/// A fact to query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Question {
    /// The component that it is about.
    pub(super) about: JausId,
    pub(super) what: What,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum What {
    /// Kind and name, queried from the component itself.
    Name(Level),
    /// Its services, queried from the component itself or from the one that listed it.
    Services,
    /// The components of its subsystem.
    Configuration,
}

/// The tries of a query, and when the next one is due.
#[derive(Debug)]
struct Attempts {
    made: u32,
    next: Instant,
    share: Share,
    number: u64,
}

#[derive(Debug)]
pub(super) struct Questions {
    all: BTreeMap<Question, Attempts>,
    /// Queries that were never sent, by share and age.
    fresh: BTreeSet<(Share, u64, Question)>,
    /// The others, by due time.
    asked: BTreeSet<(Instant, Question)>,
    /// The share whose query was sent last.
    turn: Share,
    last: u64,
    shares: Shares<Share>,
}

impl Questions {
    /// A query is sent at most this often before the next refresh: with one answer in two lost, one of 30
    /// queries stays without an answer until then …
    const TRIES: u32 = 5;
    /// … with this pause after the first try, and each time twice as long.
    const RETRY: Duration = Duration::from_secs(1);

    pub(super) const fn new(most: usize) -> Self {
        Self {
            all: BTreeMap::new(),
            fresh: BTreeSet::new(),
            asked: BTreeSet::new(),
            turn: Share::Here,
            last: 0,
            shares: Shares::new(most),
        }
    }

    /// Queues a query unless it is in the queue. An unanswered query stays for a while, so that a
    /// component without Discovery is not queried for ever. Returns whether it is in the queue.
    pub(super) fn wonder(&mut self, now: Instant, question: Question, share: Share) -> bool {
        if self.all.contains_key(&question) {
            return true;
        }
        if !self.shares.has_room(share, 1) {
            return false;
        }
        self.shares.take(share, 1);
        self.last += 1;
        let attempts = Attempts {
            made: 0,
            next: now,
            share,
            number: self.last,
        };
        self.fresh.insert((share, self.last, question));
        self.all.insert(question, attempts);
        true
    }

    /// Whether this is being queried for any of these components.
    pub(super) fn is_open(&self, what: What, about: impl IntoIterator<Item = JausId>) -> bool {
        let mut about = about.into_iter();
        about.any(|about| self.all.contains_key(&Question { about, what }))
    }

    /// Removes a query; returns whether it was in the queue and had been sent.
    pub(super) fn settle(&mut self, question: Question) -> bool {
        let Some(attempts) = self.all.remove(&question) else {
            return false;
        };
        self.unqueue(question, &attempts);
        self.shares.give_back(attempts.share, 1);
        attempts.made > 0
    }

    /// Removes all queries about a component.
    pub(super) fn forget(&mut self, id: JausId) {
        let levels = [Level::Subsystem, Level::Node, Level::Component];
        let names = levels.into_iter().map(What::Name);
        for what in names.chain([What::Services, What::Configuration]) {
            self.settle(Question { about: id, what });
        }
    }

    fn unqueue(&mut self, question: Question, attempts: &Attempts) {
        if attempts.made == 0 {
            let (share, number) = (attempts.share, attempts.number);
            self.fresh.remove(&(share, number, question));
        } else {
            self.asked.remove(&(attempts.next, question));
        }
    }

    /// The next first query, round robin over the shares.
    pub(super) fn next_fresh(&self) -> Option<Question> {
        let end = Question {
            about: JausId::from_u32(u32::MAX),
            what: What::Configuration,
        };
        let end_of_turn = Bound::Excluded((self.turn, u64::MAX, end));
        let mut after = self.fresh.range((end_of_turn, Bound::Unbounded));
        let (_, _, question) = after.next().or_else(|| self.fresh.first())?;
        Some(*question)
    }

    /// Since when the next first query has been due.
    pub(super) fn fresh_since(&self) -> Option<Instant> {
        Some(self.all.get(&self.next_fresh()?)?.next)
    }

    /// The next query to repeat. Queries without tries left are removed.
    pub(super) fn next_due(&mut self, now: Instant) -> Option<Question> {
        loop {
            let &(next, question) = self.asked.first()?;
            if next > now {
                return None;
            }
            if self.all.get(&question)?.made < Self::TRIES {
                return Some(question);
            }
            self.settle(question);
        }
    }

    /// When the first query to repeat is due.
    pub(super) fn first_due(&self) -> Option<Instant> {
        self.asked.first().map(|&(next, _)| next)
    }

    /// The number of tries of a query that is due.
    pub(super) fn made(&self, now: Instant, question: Question) -> Option<u32> {
        let attempts = self.all.get(&question).filter(|it| it.next <= now)?;
        (attempts.made < Self::TRIES).then_some(attempts.made)
    }

    /// Notes that a query is sent now. After the last try it rests for `rest`.
    pub(super) fn ask(&mut self, now: Instant, question: Question, rest: Duration) {
        let Some(mut attempts) = self.all.remove(&question) else {
            return;
        };
        self.unqueue(question, &attempts);
        if attempts.made == 0 {
            self.turn = attempts.share;
        }
        attempts.made += 1;
        attempts.next = now
            + if attempts.made < Self::TRIES {
                Self::RETRY * (1 << (attempts.made - 1))
            } else {
                rest
            };
        self.asked.insert((attempts.next, question));
        self.all.insert(question, attempts);
    }
}
