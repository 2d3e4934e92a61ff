//! The application's queries to other components: repeated on timeout, failed after the last try,
//! and sent one at a time where answers would be ambiguous.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::{Outbox, code_of};
use crate::address::JausId;
use crate::endpoint::Received;
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
/// JAUS answers do not say which query they answer. So of several queries to the same peer for the
/// same report only the oldest is sent; the next follows when that one has ended.
#[derive(Debug, Default)]
pub(super) struct Inquiries {
    last: u64,
    waiting: BTreeMap<Inquiry, Waiting>,
    /// The queries to one peer for one report, in order. The first is the one that was sent.
    turns: BTreeMap<Turn, VecDeque<Inquiry>>,
    /// The turns whose peer id has wildcards.
    open: BTreeSet<Turn>,
    due: BTreeSet<(Instant, Inquiry)>,
    failed: VecDeque<(Inquiry, NoAnswer)>,
}

/// The code of a report, and the peer that sends it.
type Turn = (u16, JausId);

#[derive(Debug)]
struct Waiting {
    turn: Turn,
    query: Bytes,
    priority: Priority,
    patience: Patience,
    asked: Option<Asked>,
}

#[derive(Debug, Clone, Copy)]
struct Asked {
    first: Instant,
    tries: u32,
    next: Instant,
}

impl Inquiries {
    /// The limit of pending queries; the next one fails at once.
    const MOST: usize = 4096;

    pub(super) fn ask(
        &mut self,
        now: Instant,
        peer: JausId,
        query: Bytes,
        report: u16,
        options: QueryOptions,
        out: &mut Outbox,
    ) -> Inquiry {
        self.last += 1;
        let (inquiry, turn) = (Inquiry(self.last), (report, peer));
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
            query,
            priority: options.priority,
            patience: options.patience.unwrap_or_default(),
            asked: None,
        };
        self.waiting.insert(inquiry, waiting);
        self.turns.entry(turn).or_default().push_back(inquiry);
        if peer.has_wildcard() {
            self.open.insert(turn);
        }
        self.proceed(now, turn, out);
        inquiry
    }

    /// Cancels a query.
    pub(super) fn cancel(&mut self, now: Instant, inquiry: Inquiry, out: &mut Outbox) {
        self.end(now, inquiry, out);
    }

    /// The query that this message answers, if any.
    pub(super) fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        out: &mut Outbox,
    ) -> Option<Inquiry> {
        let code = code_of(&message.payload)?;
        let all = (code, JausId::from_u32(0))..=(code, JausId::from_u32(u32::MAX));
        let open = self.open.range(all);
        let open = open.filter(|(_, peer)| peer.matches(message.source));
        let own = (code, message.source);
        let turns = open.chain([&own]);
        let first = turns.filter_map(|turn| self.turns.get(turn)?.front());
        let inquiry = first.min().copied()?;
        self.end(now, inquiry, out);
        Some(inquiry)
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
                asked.next = now + waiting.patience.interval;
                self.due.insert((asked.next, inquiry));
                out.send_octets_with(peer, waiting.priority, waiting.query.clone());
                continue;
            }
            let failure = NoAnswer {
                peer,
                tries: asked.tries,
                waited: now.saturating_duration_since(asked.first),
            };
            self.failed.push_back((inquiry, failure));
            self.end(now, inquiry, out);
        }
    }

    pub(super) fn poll_failure(&mut self) -> Option<(Inquiry, NoAnswer)> {
        self.failed.pop_front()
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.due.first().map(|&(due, _)| due)
    }

    /// Ends a query, and sends the next one of its turn.
    fn end(&mut self, now: Instant, inquiry: Inquiry, out: &mut Outbox) {
        let Some(ended) = self.waiting.remove(&inquiry) else {
            return;
        };
        if let Some(asked) = ended.asked {
            self.due.remove(&(asked.next, inquiry));
        }
        if let Some(queue) = self.turns.get_mut(&ended.turn) {
            if queue.front() == Some(&inquiry) {
                queue.pop_front();
            } else {
                queue.retain(|other| *other != inquiry);
            }
            if queue.is_empty() {
                self.turns.remove(&ended.turn);
                self.open.remove(&ended.turn);
            }
        }
        self.proceed(now, ended.turn, out);
    }

    /// Sends the first query of a turn unless it was already sent.
    fn proceed(&mut self, now: Instant, turn: Turn, out: &mut Outbox) {
        let first = self.turns.get(&turn).and_then(VecDeque::front);
        let Some((&inquiry, waiting)) = first.and_then(|it| Some((it, self.waiting.get_mut(it)?)))
        else {
            return;
        };
        if waiting.asked.is_some() {
            return;
        }
        let next = now + waiting.patience.interval;
        waiting.asked = Some(Asked {
            first: now,
            tries: 1,
            next,
        });
        self.due.insert((next, inquiry));
        out.send_octets_with(turn.1, waiting.priority, waiting.query.clone());
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    const US: JausId = JausId::new(101, 1, 1);
    const PEER: JausId = JausId::new(102, 1, 1);

    #[test]
    fn a_question_too_many_fails_at_once_and_the_others_take_their_turns() {
        let (mut inquiries, now) = (Inquiries::default(), Instant::now());
        let mut out = Outbox::new(US);
        let ask = |inquiries: &mut Inquiries, out: &mut Outbox| {
            let options = QueryOptions::default();
            inquiries.ask(now, PEER, Bytes::new(), 0x4202, options, out)
        };
        for _ in 0..Inquiries::MOST {
            ask(&mut inquiries, &mut out);
        }
        assert!(inquiries.poll_failure().is_none());
        let last = ask(&mut inquiries, &mut out);
        let failed = inquiries.poll_failure().map(|(inquiry, _)| inquiry);
        assert_eq!(failed, Some(last));
        assert!(out.pop().is_some() && out.pop().is_none(), "one at a time");
        inquiries.cancel(now, Inquiry(2), &mut out);
        inquiries.cancel(now, Inquiry(1), &mut out);
        assert!(out.pop().is_some() && out.pop().is_none(), "the third");
        assert_eq!(inquiries.waiting.len(), Inquiries::MOST - 2);
    }

    #[test]
    fn the_patience_of_a_query_holds_for_that_query_alone() {
        let (mut inquiries, start) = (Inquiries::default(), Instant::now());
        let mut out = Outbox::new(US);
        let (usual, patient) = (QueryOptions::default(), QueryOptions::default());
        let patient = patient.within(Duration::from_secs(5));
        for (report, options) in [(0x4202, usual), (0x4203, patient), (0x4204, usual)] {
            inquiries.ask(start, PEER, Bytes::new(), report, options, &mut out);
        }
        let mut ends = Vec::new();
        while let Some(now) = inquiries.poll_timeout() {
            inquiries.handle_timeout(now, &mut out);
            while let Some((Inquiry(number), failure)) = inquiries.poll_failure() {
                ends.push((number, failure.tries, failure.waited.as_millis()));
            }
        }
        assert_eq!(ends, [(1, 3, 1500), (3, 3, 1500), (2, 10, 5000)]);
    }

    #[test]
    fn a_query_is_not_repeated_while_parts_of_a_large_report_arrive() {
        let (mut inquiries, start) = (Inquiries::default(), Instant::now());
        let mut out = Outbox::new(US);
        let options = QueryOptions::default()
            .within(Duration::from_secs(1))
            .priority(Priority::High);
        inquiries.ask(start, PEER, Bytes::new(), 0x4202, options, &mut out);
        assert_eq!(out.pop().map(|it| it.priority), Some(Priority::High));
        let at = |milliseconds| start + Duration::from_millis(milliseconds);
        // Parts arrive for 4 s.
        for milliseconds in (100..=4000).step_by(100) {
            let now = at(milliseconds);
            for peer in inquiries.overdue(now).collect::<Vec<_>>() {
                assert_eq!(peer, PEER);
                inquiries.handle_progress(now, peer, at(milliseconds - 50));
            }
            inquiries.handle_timeout(now, &mut out);
            assert!(out.pop().is_none(), "{milliseconds} ms");
        }
        // Then they stop.
        for (milliseconds, is_sent, has_failed) in [
            (4400, false, false),
            (4500, true, false),
            (5000, false, true),
        ] {
            inquiries.handle_progress(at(milliseconds), PEER, at(3950));
            inquiries.handle_timeout(at(milliseconds), &mut out);
            assert_eq!(out.pop().is_some(), is_sent, "{milliseconds} ms");
            assert_eq!(
                inquiries.poll_failure().is_some(),
                has_failed,
                "{milliseconds} ms"
            );
        }
    }
}
