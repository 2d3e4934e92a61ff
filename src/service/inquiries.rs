//! Questions of the application to other components: asked again if no answer comes, given up in
//! the end, and one at a time where answers could not be told apart.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::{Outbox, code_of};
use crate::address::JausId;
use crate::endpoint::Received;

/// Names one question until its answer comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Inquiry(u64);

/// How long to wait for an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// How often to ask; at least once.
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

/// A question that nobody answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoAnswer {
    /// Who was asked.
    pub peer: JausId,
    /// How often.
    pub tries: u32,
    /// From the first try until now.
    pub waited: Duration,
}

/// The questions of one component that wait for an answer.
///
/// JAUS answers do not say which question they answer. So of several questions to the same peer
/// for the same report only the oldest is asked, and the next when that one has ended.
#[derive(Debug, Default)]
pub(super) struct Inquiries {
    last: u64,
    waiting: Vec<Waiting>,
    failed: VecDeque<(Inquiry, NoAnswer)>,
}

#[derive(Debug)]
struct Waiting {
    inquiry: Inquiry,
    peer: JausId,
    query: Bytes,
    report: u16,
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
        let inquiry = Inquiry(self.last);
        self.waiting.push(Waiting {
            inquiry,
            peer,
            query,
            report,
            patience,
            asked: None,
        });
        self.proceed(now, out);
        inquiry
    }

    /// Forgets a question whose answer nobody waits for any more.
    pub(super) fn cancel(&mut self, now: Instant, inquiry: Inquiry, out: &mut Outbox) {
        self.waiting.retain(|waiting| waiting.inquiry != inquiry);
        self.proceed(now, out);
    }

    /// The question that this message answers, if any.
    pub(super) fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        out: &mut Outbox,
    ) -> Option<Inquiry> {
        let code = code_of(&message.payload)?;
        let answered = self.waiting.iter().position(|waiting| {
            waiting.asked.is_some()
                && waiting.report == code
                && waiting.peer.matches(message.source)
        })?;
        let inquiry = self.waiting.remove(answered).inquiry;
        self.proceed(now, out);
        Some(inquiry)
    }

    pub(super) fn handle_timeout(&mut self, now: Instant, out: &mut Outbox) {
        let failed = &mut self.failed;
        self.waiting.retain_mut(|waiting| {
            let Some(asked) = &mut waiting.asked else {
                return true;
            };
            if asked.next > now {
                return true;
            }
            if asked.tries < waiting.patience.tries {
                asked.tries += 1;
                asked.next = now + waiting.patience.interval;
                out.send_octets(waiting.peer, waiting.query.clone());
                return true;
            }
            let waited = now.saturating_duration_since(asked.first);
            let failure = NoAnswer {
                peer: waiting.peer,
                tries: asked.tries,
                waited,
            };
            failed.push_back((waiting.inquiry, failure));
            false
        });
        self.proceed(now, out);
    }

    pub(super) fn poll_failure(&mut self) -> Option<(Inquiry, NoAnswer)> {
        self.failed.pop_front()
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.waiting
            .iter()
            .filter_map(|waiting| Some(waiting.asked?.next))
            .min()
    }

    /// Asks the questions whose turn has come.
    fn proceed(&mut self, now: Instant, out: &mut Outbox) {
        for turn in 0..self.waiting.len() {
            let (before, rest) = self.waiting.split_at_mut(turn);
            let Some(waiting) = rest.first_mut() else {
                return;
            };
            let busy = before
                .iter()
                .any(|other| other.peer == waiting.peer && other.report == waiting.report);
            if waiting.asked.is_none() && !busy {
                let next = now + waiting.patience.interval;
                waiting.asked = Some(Asked {
                    first: now,
                    tries: 1,
                    next,
                });
                out.send_octets(waiting.peer, waiting.query.clone());
            }
        }
    }
}
