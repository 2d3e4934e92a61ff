//! The application's queries to other components: repeated on timeout, failed after the last try,
//! and sent one at a time where answers would be ambiguous.
//!
//! A report does not say which query it answers. What tells them apart are the numbers that both have in
//! common ([`Echo`]), and the time: each try of a query may still be answered after the query has ended, so
//! the next one waits for these answers, or for as long as the peer takes.

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::{Outbox, code_of};
use crate::address::JausId;
use crate::codec::Echo;
use crate::endpoint::Received;
use crate::messages;
use crate::wire::Priority;

/// Identifies one query until it ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Inquiry(u64);

/// How long to wait for an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// How often to send the query; at least once.
    pub tries: u32,
    /// How long to wait after each try.
    pub interval: Duration,
}

impl Default for Patience {
    /// Three times, half a second each. Peers are expected to answer within 250 ms (JAUS++) to
    /// 1.5 s (the competitions' judging tool).
    fn default() -> Self {
        Self {
            tries: 3,
            interval: Duration::from_millis(500),
        }
    }
}

/// How to send one query, and how long to wait for its report.
///
/// ```
/// use std::time::Duration;
/// use jaus::service::QueryOptions;
/// use jaus::wire::Priority;
///
/// let options = QueryOptions::default().within(Duration::from_secs(5)).priority(Priority::High);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct QueryOptions {
    /// How long to wait; `None` for the component's default.
    pub patience: Option<Patience>,
    /// The priority of the query, which the report usually takes over.
    pub priority: Priority,
}

impl From<Patience> for QueryOptions {
    fn from(patience: Patience) -> Self {
        let patience = Some(patience);
        let priority = Priority::default();
        Self { patience, priority }
    }
}

impl QueryOptions {
    /// Waits for the report up to `limit`, and repeats the query about every 500 ms until then.
    /// While parts of a large report arrive, the query is neither repeated nor given up.
    #[must_use]
    pub fn within(mut self, limit: Duration) -> Self {
        let interval = Patience::default().interval.min(limit);
        let tries = limit.as_millis().div_ceil(interval.as_millis().max(1));
        let tries = u32::try_from(tries).unwrap_or(u32::MAX).max(1);
        let interval = limit / tries;
        self.patience = Some(Patience { tries, interval });
        self
    }

    /// Sends the query with a priority.
    #[must_use]
    pub const fn priority(mut self, priority: Priority) -> Self {
        self.priority = priority;
        self
    }
}

/// A query, and what answers it.
#[derive(Debug, Clone)]
pub struct Question {
    /// The query, from its message code.
    query: Bytes,
    /// The code of the report.
    report: u16,
    echoes: &'static [Echo],
}

impl Question {
    /// A query with this report. What both have in common is looked up among the messages of this library.
    #[must_use]
    pub fn new(query: Bytes, report: u16) -> Self {
        let code = code_of(&query).unwrap_or_default();
        let known = messages::registry().by_code(code).next();
        let echoes = known.map_or(&[][..], |it| it.echoes);
        Self {
            query,
            report,
            echoes,
        }
    }

    /// The same for messages that the library does not have, with what they have in common.
    #[must_use]
    pub const fn echoing(mut self, echoes: &'static [Echo]) -> Self {
        self.echoes = echoes;
        self
    }

    /// The code of the query.
    #[must_use]
    pub fn code(&self) -> u16 {
        code_of(&self.query).unwrap_or_default()
    }

    /// Whether nothing in a report with the code says that it answers another query.
    fn agrees(&self, report: &[u8]) -> bool {
        self.echoes.iter().all(|it| it.is_in(&self.query, report))
    }

    /// Whether a report may answer both this question and another.
    fn is_like(&self, other: &Self) -> bool {
        let mut echoes = self.echoes.iter();
        self.echoes != other.echoes
            || echoes.all(|it| {
                let number = it.query..it.query + it.octets;
                self.query.get(number.clone()) == other.query.get(number)
            })
    }
}

/// A query that timed out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoAnswer {
    /// The queried component.
    pub peer: JausId,
    /// How often the query was sent.
    pub tries: u32,
    /// Time since the first try.
    pub waited: Duration,
}

/// The pending queries of one component.
///
/// Of several queries to the same peer for the same report only the oldest is sent; the next follows when
/// that one has ended, and its answers have come that could be taken for those of the next.
#[derive(Debug, Default)]
pub(super) struct Inquiries {
    last: u64,
    waiting: BTreeMap<Inquiry, Waiting>,
    /// The queries to one peer for one report, in order. The first is the one that was sent.
    turns: BTreeMap<Turn, VecDeque<Inquiry>>,
    /// The turns whose peer id has wildcards.
    open: BTreeSet<Turn>,
    due: BTreeSet<(Instant, Inquiry)>,
    /// What may still come for queries that have ended, the oldest first.
    owed: VecDeque<Owed>,
    failed: VecDeque<(Inquiry, NoAnswer)>,
}

/// The code of a report, and the peer that sends it.
type Turn = (u16, JausId);

/// Whether one message may answer queries of both turns.
fn overlap(one: Turn, other: Turn) -> bool {
    one.0 == other.0 && one.1.overlaps(other.1)
}

#[derive(Debug)]
struct Waiting {
    turn: Turn,
    question: Question,
    priority: Priority,
    patience: Patience,
    asked: Option<Asked>,
}

/// Answers that may still come for a query that has ended.
#[derive(Debug)]
struct Owed {
    turn: Turn,
    question: Question,
    answers: u32,
    /// How long the peer may take for the next one, and until when.
    patience: Duration,
    until: Instant,
}

#[derive(Debug, Clone, Copy)]
struct Asked {
    first: Instant,
    tries: u32,
    latest: Instant,
    next: Instant,
}

impl Inquiries {
    /// The limit of pending queries; the next one fails at once.
    const MOST: usize = 4096;
    /// The limit of ended queries whose answers are still awaited; of more, the oldest are forgotten.
    const MOST_OWED: usize = 1024;

    pub(super) fn ask(
        &mut self,
        now: Instant,
        peer: JausId,
        question: Question,
        options: QueryOptions,
        out: &mut Outbox,
    ) -> Inquiry {
        self.last += 1;
        let (inquiry, turn) = (Inquiry(self.last), (question.report, peer));
        if self.waiting.len() >= Self::MOST {
            let (tries, waited) = (0, Duration::ZERO);
            let failure = NoAnswer {
                peer,
                tries,
                waited,
            };
            self.failed.push_back((inquiry, failure));
            return inquiry;
        }
        let waiting = Waiting {
            turn,
            question,
            priority: options.priority,
            patience: options.patience.unwrap_or_default(),
            asked: None,
        };
        self.waiting.insert(inquiry, waiting);
        self.turns.entry(turn).or_default().push_back(inquiry);
        if peer.has_wildcard() {
            self.open.insert(turn);
        }
        self.send_first(now, turn, out);
        inquiry
    }

    /// Cancels a query.
    pub(super) fn cancel(&mut self, now: Instant, inquiry: Inquiry, out: &mut Outbox) {
        self.end(now, inquiry, 0, out);
    }

    /// The query that this message answers, if any.
    pub(super) fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        out: &mut Outbox,
    ) -> Option<Inquiry> {
        let turn = (code_of(&message.payload)?, message.source);
        let asked = self.asked(turn);
        let agrees = |it: &(Inquiry, &Question)| it.1.agrees(&message.payload);
        let answered = asked.filter(agrees).map(|it| it.0).min();
        match answered {
            Some(inquiry) => self.end(now, inquiry, 1, out),
            None => self.receive_owed(now, turn, &message.payload, out),
        }
        answered
    }

    /// Notes the answer to a query that has ended.
    fn receive_owed(&mut self, now: Instant, turn: Turn, report: &[u8], out: &mut Outbox) {
        let is_it = |it: &&mut Owed| overlap(it.turn, turn) && it.question.agrees(report);
        if let Some(owed) = self.owed.iter_mut().find(is_it) {
            owed.answers -= 1;
            if !owed.turn.1.has_wildcard() {
                // The peer is late, but does answer: so the others will come, too.
                owed.until = now + owed.patience;
            }
            self.forget_owed(now, out);
        }
    }

    /// The turns that overlap this one.
    fn overlapping(&self, turn: Turn) -> Vec<Turn> {
        let of_code = |peer| (turn.0, JausId::from_u32(peer));
        let all = of_code(0)..=of_code(u32::MAX);
        if turn.1.has_wildcard() {
            let all = self.turns.range(all).map(|(turn, _)| *turn);
            return all.filter(|it| overlap(*it, turn)).collect();
        }
        let open = self.open.range(all).copied();
        let open = open.filter(|it| overlap(*it, turn));
        let own = self.turns.contains_key(&turn).then_some(turn);
        open.chain(own).collect()
    }

    /// The queries that were sent, and that a message of this turn may answer.
    fn asked(&self, turn: Turn) -> impl Iterator<Item = (Inquiry, &Question)> {
        let turns = self.overlapping(turn).into_iter();
        turns.filter_map(|turn| {
            let inquiry = self.turns.get(&turn)?.front()?;
            let waiting = self.waiting.get(inquiry)?;
            let question = &waiting.question;
            waiting.asked.map(|_| (*inquiry, question))
        })
    }

    /// The peers whose queries would be repeated now, or time out.
    pub(super) fn overdue(&self, now: Instant) -> impl Iterator<Item = JausId> {
        let due = self.due.iter().take_while(move |(due, _)| *due <= now);
        due.filter_map(|(_, inquiry)| Some(self.waiting.get(inquiry)?.turn.1))
    }

    /// Postpones the next try of the queries to a peer that is sending a large message, of which a
    /// part arrived at `latest`. It may be the report.
    pub(super) fn handle_progress(&mut self, now: Instant, peer: JausId, latest: Instant) {
        let due = self.due.iter().take_while(|(due, _)| *due <= now);
        let inquiries: Vec<_> = due.map(|&(_, inquiry)| inquiry).collect();
        for inquiry in inquiries {
            let waiting = self.waiting.get_mut(&inquiry);
            let Some(waiting) = waiting.filter(|waiting| waiting.turn.1 == peer) else {
                continue;
            };
            let next = latest + waiting.patience.interval;
            if let Some(asked) = &mut waiting.asked
                && next > now
            {
                self.due.remove(&(asked.next, inquiry));
                asked.next = next;
                self.due.insert((next, inquiry));
            }
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Instant, out: &mut Outbox) {
        while let Some(&(due, inquiry)) = self.due.first().filter(|(due, _)| *due <= now) {
            self.due.remove(&(due, inquiry));
            let Some(waiting) = self.waiting.get_mut(&inquiry) else {
                continue;
            };
            let peer = waiting.turn.1;
            let Some(asked) = &mut waiting.asked else {
                continue;
            };
            if asked.tries < waiting.patience.tries {
                asked.tries += 1;
                asked.latest = now;
                asked.next = now + waiting.patience.interval;
                self.due.insert((asked.next, inquiry));
                out.send_octets_with(peer, waiting.priority, waiting.question.query.clone());
                continue;
            }
            let failure = NoAnswer {
                peer,
                tries: asked.tries,
                waited: now.saturating_duration_since(asked.first),
            };
            self.failed.push_back((inquiry, failure));
            self.end(now, inquiry, 0, out);
        }
        self.forget_owed(now, out);
    }

    /// Forgets the answers that have come or do not come any more, and sends the queries that waited
    /// for them.
    fn forget_owed(&mut self, now: Instant, out: &mut Outbox) {
        let mut freed = Vec::new();
        self.owed.retain(|it| {
            let stays = it.answers > 0 && now < it.until;
            if !stays {
                freed.push(it.turn);
            }
            stays
        });
        for turn in freed {
            self.proceed(now, turn, out);
        }
    }

    /// The next query that has timed out.
    pub(super) fn poll_failure(&mut self) -> Option<(Inquiry, NoAnswer)> {
        self.failed.pop_front()
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let due = self.due.first().map(|&(due, _)| due);
        let owed = self.owed.iter().map(|it| it.until);
        due.into_iter().chain(owed).min()
    }

    /// Ends a query that has got this many answers, and sends the next one of its turn.
    fn end(&mut self, now: Instant, inquiry: Inquiry, answers: u32, out: &mut Outbox) {
        let Some(ended) = self.waiting.remove(&inquiry) else {
            return;
        };
        let turn = ended.turn;
        if let Some(queue) = self.turns.get_mut(&turn) {
            if queue.front() == Some(&inquiry) {
                queue.pop_front();
            } else {
                queue.retain(|other| *other != inquiry);
            }
            if queue.is_empty() {
                self.turns.remove(&turn);
                self.open.remove(&turn);
            }
        }
        if let Some(asked) = ended.asked {
            self.due.remove(&(asked.next, inquiry));
            self.owe(now, ended, asked, answers);
        }
        self.proceed(now, turn, out);
    }

    /// Notes the answers that may still come for a query: one for each try, or from a group any number.
    /// They come within the time that the peer has taken so far, or within the interval of its tries.
    fn owe(&mut self, now: Instant, ended: Waiting, asked: Asked, answers: u32) {
        let answers = match ended.turn.1.has_wildcard() {
            true => u32::MAX,
            false => asked.tries.saturating_sub(answers),
        };
        let taken = now.saturating_duration_since(asked.first);
        let patience = taken.max(ended.patience.interval);
        let until = asked.latest + patience;
        if answers == 0 || until <= now {
            return;
        }
        if self.owed.len() >= Self::MOST_OWED {
            self.owed.pop_front();
        }
        self.owed.push_back(Owed {
            turn: ended.turn,
            question: ended.question,
            answers,
            patience,
            until,
        });
    }

    /// Sends the first query of this turn and of those that overlap it.
    fn proceed(&mut self, now: Instant, turn: Turn, out: &mut Outbox) {
        for turn in self.overlapping(turn) {
            self.send_first(now, turn, out);
        }
    }

    /// Sends the first query of a turn, unless it was sent already, or its answer could be taken for that
    /// to another query, or the other way round.
    fn send_first(&mut self, now: Instant, turn: Turn, out: &mut Outbox) {
        let first = self.turns.get(&turn).and_then(VecDeque::front);
        let Some((&inquiry, waiting)) = first.and_then(|it| Some((it, self.waiting.get(it)?)))
        else {
            return;
        };
        let owed = self.owed.iter().filter(|it| overlap(it.turn, turn));
        let asked = self.asked(turn).map(|it| it.1);
        let others: Vec<_> = asked.chain(owed.map(|it| &it.question)).collect();
        if waiting.asked.is_some() || others.iter().any(|it| it.is_like(&waiting.question)) {
            return;
        }
        if let Some(waiting) = self.waiting.get_mut(&inquiry) {
            let next = now + waiting.patience.interval;
            waiting.asked = Some(Asked {
                first: now,
                tries: 1,
                latest: now,
                next,
            });
            self.due.insert((next, inquiry));
            out.send_octets_with(turn.1, waiting.priority, waiting.question.query.clone());
        }
    }
}
