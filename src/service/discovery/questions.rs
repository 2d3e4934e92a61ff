//! What is still to be found out: new questions, by turns of the addresses that they are about, and
//! those that were asked in vain.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;
use std::time::{Duration, Instant};

use crate::address::JausId;
use crate::service::Level;
use crate::service::share::{Share, Shares};

/// Something to be found out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Question {
    /// The component in question.
    pub(super) about: JausId,
    pub(super) what: What,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum What {
    /// Kind and name, asked of the component itself.
    Name(Level),
    /// Its services, asked of itself or of the one that listed it.
    Services,
    /// The components of its subsystem.
    Configuration,
}

/// How often a question has been asked, and when it is due again.
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
    /// Those that were never asked, by share and age.
    fresh: BTreeSet<(Share, u64, Question)>,
    /// The others, by when they are due.
    asked: BTreeSet<(Instant, Question)>,
    /// The share whose question was asked last.
    turn: Share,
    last: u64,
    shares: Shares,
}

impl Questions {
    /// A question is asked at most so often before the next refresh …
    const TRIES: u32 = 3;
    /// … again after this time, then after twice as long, and so on.
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

    /// Puts a question on the list, unless it is there: also one that was asked in vain stays for
    /// a while, so that a component without Discovery is not asked for ever. Says whether it is there.
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

    /// Whether somebody of these is being asked this.
    pub(super) fn is_open(&self, what: What, about: impl IntoIterator<Item = JausId>) -> bool {
        let mut about = about.into_iter();
        about.any(|about| self.all.contains_key(&Question { about, what }))
    }

    /// Takes a question off the list; says whether it was on it and asked.
    pub(super) fn settle(&mut self, question: Question) -> bool {
        let Some(attempts) = self.all.remove(&question) else {
            return false;
        };
        self.unqueue(question, &attempts);
        self.shares.give_back(attempts.share, 1);
        attempts.made > 0
    }

    /// Forgets all that was to be asked about a component.
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

    /// The question that was never asked and whose turn it is.
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

    /// Since when a question waits that was never asked.
    pub(super) fn fresh_since(&self) -> Option<Instant> {
        Some(self.all.get(&self.next_fresh()?)?.next)
    }

    /// A question that is to be asked once more. Those asked often enough leave the list.
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

    /// When the first question that was asked before is due.
    pub(super) fn first_due(&self) -> Option<Instant> {
        self.asked.first().map(|&(next, _)| next)
    }

    /// How often a question that is due has been asked.
    pub(super) fn made(&self, now: Instant, question: Question) -> Option<u32> {
        let attempts = self.all.get(&question).filter(|it| it.next <= now)?;
        (attempts.made < Self::TRIES).then_some(attempts.made)
    }

    /// A question is asked now. After the last try it rests for `rest`.
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
                Self::RETRY * attempts.made
            } else {
                rest
            };
        self.asked.insert((attempts.next, question));
        self.all.insert(question, attempts);
    }
}
