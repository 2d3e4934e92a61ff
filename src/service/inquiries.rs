//! The application's queries to other components: repeated on timeout, failed after the last try,
//! and sent one at a time where answers would be ambiguous.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::{Outbox, code_of};
use crate::address::JausId;
use crate::endpoint::Received;

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
        patience: Patience,
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
            patience,
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
                out.send_octets(peer, waiting.query.clone());
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
        out.send_octets(turn.1, waiting.query.clone());
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
            let patience = Patience::default();
            inquiries.ask(now, PEER, Bytes::new(), 0x4202, patience, out)
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
}
