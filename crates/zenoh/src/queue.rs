//! What the zenoh session has yet to do, most urgent first.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::wire::Priority;

/// A sample to publish.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Publication {
    /// Its key expression.
    pub key: String,
    /// Its payload.
    pub payload: Bytes,
    /// Its priority; `None` for a view, which yields to all messages.
    pub priority: Option<Priority>,
    /// Whether the session waits for room on a congested link; otherwise the link may drop it.
    pub waits: bool,
}

impl Publication {
    fn size(&self) -> usize {
        self.key.len() + self.payload.len()
    }
}

/// Something for the zenoh session to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Declare the liveliness token of a component.
    Announce(JausId),
    /// Undeclare it.
    Withdraw(JausId),
    /// Answer requests for views of this subsystem.
    Serve(u16),
    /// Ask the network which sessions have declared a token, to log them. Its key.
    Identify(String),
    /// Publish a sample.
    Publish(Publication),
}

/// The most samples of one priority that wait.
const MOST_SAMPLES: usize = 1024;
/// The most octets of all samples that wait.
const MOST_OCTETS: usize = 8 << 20;
/// How long a sample may wait. Late commands do harm, and messages that matter are repeated.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// The commands that wait. Tokens and requests are bounded by the tables of the exchange, and questions by
/// the rate of its log.
#[derive(Debug, Default)]
pub(crate) struct Queue {
    declarations: VecDeque<Command>,
    /// Views first, then one for each priority, the lowest first.
    samples: [VecDeque<(Instant, Publication)>; Priority::ALL.len() + 1],
    octets: usize,
    /// Samples that have waited too long since the last look at this number.
    late: u64,
}

impl Queue {
    pub(crate) fn declare(&mut self, command: Command) {
        self.declarations.push_back(command);
    }

    /// Queues a sample; returns false if there is no room.
    pub(crate) fn publish(&mut self, now: Instant, publication: Publication) -> bool {
        let size = publication.size();
        let level = publication
            .priority
            .map_or(0, |it| 1 + usize::from(it.bits()));
        let Some(queue) = self.samples.get_mut(level) else {
            return false;
        };
        if queue.len() >= MOST_SAMPLES || self.octets + size > MOST_OCTETS {
            return false;
        }
        self.octets += size;
        queue.push_back((now, publication));
        true
    }

    /// The next command. Samples that have waited too long are dropped.
    pub(crate) fn pop(&mut self, now: Instant) -> Option<Command> {
        if let Some(command) = self.declarations.pop_front() {
            return Some(command);
        }
        loop {
            let mut urgent_first = self.samples.iter_mut().rev();
            let (since, publication) = urgent_first.find_map(VecDeque::pop_front)?;
            self.octets -= publication.size();
            if now.saturating_duration_since(since) <= LONGEST_WAIT {
                return Some(Command::Publish(publication));
            }
            self.late += 1;
        }
    }

    /// The number of samples dropped since the last call because they have waited too long.
    pub(crate) fn take_late(&mut self) -> u64 {
        std::mem::take(&mut self.late)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.declarations.is_empty() && self.samples.iter().all(VecDeque::is_empty)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "the tests start at an arbitrary instant"
)]
mod tests {
    use super::*;

    fn sample(priority: Option<Priority>, octets: usize) -> Publication {
        Publication {
            key: String::new(),
            payload: vec![0; octets].into(),
            priority,
            waits: false,
        }
    }

    #[test]
    fn tokens_come_first_then_samples_by_priority_and_views_last() {
        let (now, mut queue) = (Instant::now(), Queue::default());
        let levels = [
            None,
            Some(Priority::Low),
            Some(Priority::Standard),
            Some(Priority::High),
            Some(Priority::SafetyCritical),
        ];
        for level in levels {
            assert!(queue.publish(now, sample(level, 1)));
        }
        let token = Command::Announce(JausId::new(1, 1, 1));
        queue.declare(token.clone());
        assert_eq!(queue.pop(now), Some(token));
        for level in levels.into_iter().rev() {
            assert_eq!(queue.pop(now), Some(Command::Publish(sample(level, 1))));
        }
        assert!(queue.is_empty() && queue.pop(now).is_none());
    }

    #[test]
    fn a_full_queue_takes_no_more_of_that_priority_and_others_still_pass() {
        let (now, mut queue) = (Instant::now(), Queue::default());
        let (low, high) = (Some(Priority::Low), Some(Priority::High));
        for _ in 0..MOST_SAMPLES {
            assert!(queue.publish(now, sample(low, 1)));
        }
        assert!(!queue.publish(now, sample(low, 1)));
        assert!(queue.publish(now, sample(high, 1)));
    }

    #[test]
    fn the_octets_of_all_samples_have_a_bound_and_are_freed() {
        let (now, mut queue) = (Instant::now(), Queue::default());
        let low = Some(Priority::Low);
        assert!(queue.publish(now, sample(low, MOST_OCTETS)));
        assert!(!queue.publish(now, sample(low, 1)));
        queue.pop(now);
        assert!(queue.publish(now, sample(low, MOST_OCTETS)));
    }

    #[test]
    fn a_sample_that_has_waited_too_long_is_dropped_and_counted() {
        let (start, mut queue) = (Instant::now(), Queue::default());
        queue.publish(start, sample(None, 1));
        queue.publish(start + LONGEST_WAIT, sample(None, 2));
        let later = start + LONGEST_WAIT + Duration::from_millis(1);
        assert_eq!(queue.pop(later), Some(Command::Publish(sample(None, 2))));
        assert_eq!((queue.take_late(), queue.take_late()), (1, 0));
    }
}
