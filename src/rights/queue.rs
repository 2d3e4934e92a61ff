//! What waits for the reader of an audit log.

use std::collections::VecDeque;

use super::{Decision, Weight};

/// Records that may wait: of each weight, so that refusals do not displace what was done, nor what
/// everybody may that which needs a right.
const MOST_WAITING: usize = 256;

/// A record for an audit log.
pub trait Weighted: PartialEq {
    /// How much it matters.
    fn weight(&self) -> Weight;
}

/// Records that wait for the reader of an audit log: up to 256 of each weight.
///
/// Equal ones are counted as one. Of those that matter most, only ones that follow each other: who had
/// control at the end shows in their order.
#[derive(Debug)]
pub struct WeightedQueue<T>(VecDeque<(T, u64)>);

impl<T> Default for WeightedQueue<T> {
    fn default() -> Self {
        Self(VecDeque::new())
    }
}

impl<T: Weighted> WeightedQueue<T> {
    /// Adds a record, or counts it with an equal one; returns whether there was room.
    pub fn push(&mut self, record: T) -> bool {
        let weight = record.weight();
        let mut alike = self.0.iter_mut().filter(|(it, _)| it.weight() == weight);
        let known = match weight {
            Weight::Evidence => alike.next_back().filter(|(it, _)| *it == record),
            Weight::Refusal | Weight::Free => alike.find(|(it, _)| *it == record),
        };
        if let Some((_, times)) = known {
            *times += 1;
            return true;
        }
        let alike = self.0.iter().filter(|(it, _)| it.weight() == weight);
        let has_room = alike.count() < MOST_WAITING;
        if has_room {
            self.0.push_back((record, 1));
        }
        has_room
    }

    /// The next record, and how often it came.
    pub fn pop(&mut self) -> Option<(T, u64)> {
        self.0.pop_front()
    }
}

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

impl<C: PartialEq> Weighted for (Decision, C) {
    fn weight(&self) -> Weight {
        self.0.weight()
    }
}

/// Decisions about clients that wait for the reader of an audit log.
#[derive(Debug)]
pub struct DecisionQueue<C>(WeightedQueue<(Decision, C)>);

impl<C> Default for DecisionQueue<C> {
    fn default() -> Self {
        Self(WeightedQueue::default())
    }
}

impl<C: PartialEq> DecisionQueue<C> {
    /// Adds a decision, or counts it with an equal one; returns whether there was room.
    pub fn push(&mut self, decision: Decision, client: C) -> bool {
        self.0.push((decision, client))
    }

    /// The next decision.
    pub fn pop(&mut self) -> Option<Decided<C>> {
        let ((decision, client), times) = self.0.pop()?;
        Some(Decided {
            decision,
            client,
            times,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Weighted for (Weight, usize) {
        fn weight(&self) -> Weight {
            self.0
        }
    }

    fn all<T: Weighted>(queue: &mut WeightedQueue<T>) -> Vec<(T, u64)> {
        std::iter::from_fn(|| queue.pop()).collect()
    }

    #[test]
    fn each_weight_keeps_its_places() {
        let mut queue = WeightedQueue::default();
        let weights = [Weight::Refusal, Weight::Free, Weight::Evidence];
        for weight in weights {
            let kept = (0..1000).filter(|number| queue.push((weight, *number)));
            assert_eq!(kept.count(), MOST_WAITING, "{weight:?}");
        }
        assert_eq!(all(&mut queue).len(), 3 * MOST_WAITING);
    }

    #[test]
    fn equal_records_are_counted_but_the_order_of_evidence_is_kept() {
        let mut queue = WeightedQueue::default();
        let (granted, ended) = (1, 2);
        for number in [granted, ended, granted, granted] {
            assert!(queue.push((Weight::Refusal, number)));
            assert!(queue.push((Weight::Evidence, number)));
        }
        let (refused, done): (Vec<_>, Vec<_>) = all(&mut queue)
            .into_iter()
            .partition(|((weight, _), _)| *weight == Weight::Refusal);
        let counts = |it: Vec<((Weight, usize), u64)>| -> Vec<_> {
            it.into_iter()
                .map(|((_, number), times)| (number, times))
                .collect()
        };
        assert_eq!(counts(refused), [(granted, 3), (ended, 1)]);
        assert_eq!(counts(done), [(granted, 1), (ended, 1), (granted, 2)]);
    }
}
