//! Decisions that wait for the reader of an audit log.

use std::collections::VecDeque;

use super::Decision;

/// Decisions that may wait: of each weight, so that refusals do not displace what was done, nor what
/// everybody may that which needs a right.
const MOST_WAITING: usize = 128;

/// A decision about a client, such as a network address.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Decided<C> {
    /// The decision.
    pub decision: Decision,
    /// The client.
    pub client: C,
    /// How often it was decided since the last time.
    pub times: u64,
}

/// Decisions that wait for the reader of an audit log: up to 128 of each weight, equal ones as one.
#[derive(Debug)]
pub struct DecisionQueue<C>(VecDeque<Decided<C>>);

impl<C> Default for DecisionQueue<C> {
    fn default() -> Self {
        Self(VecDeque::new())
    }
}

impl<C: PartialEq> DecisionQueue<C> {
    /// Adds a decision, or counts it with an equal one; returns whether there was room.
    pub fn push(&mut self, decision: Decision, client: C) -> bool {
        let is_same = |it: &&mut Decided<C>| it.client == client && it.decision == decision;
        if let Some(known) = self.0.iter_mut().find(is_same) {
            known.times += 1;
            return true;
        }
        let weight = decision.weight();
        let alike = self.0.iter();
        let alike = alike.filter(|it| it.decision.weight() == weight);
        if alike.count() >= MOST_WAITING {
            return false;
        }
        self.0.push_back(Decided {
            decision,
            client,
            times: 1,
        });
        true
    }

    /// The next decision.
    pub fn pop(&mut self) -> Option<Decided<C>> {
        self.0.pop_front()
    }
}
