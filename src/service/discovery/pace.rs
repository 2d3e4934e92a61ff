//! The pace of discovery: a seeded jitter, so that components that start together do not send
//! together, and a budget that limits mistakes and malicious peers alike.

use std::time::{Duration, Instant};

use crate::random::Random;

/// Random durations that spread packets in time.
#[derive(Debug, Clone)]
pub(super) struct Jitter(Random);

impl Jitter {
    pub(super) const fn new(seed: u64) -> Self {
        Self(Random::new(seed))
    }

    /// A duration between 0 and `most`.
    pub(super) fn up_to(&mut self, most: Duration) -> Duration {
        most.mul_f64(self.0.unit())
    }

    /// A duration between 90 % and 110 % of `middle`.
    pub(super) fn around(&mut self, middle: Duration) -> Duration {
        middle.mul_f64(0.9) + self.up_to(middle.mul_f64(0.2))
    }
}

/// A token bucket: allows a burst, and a rate in the long run.
#[derive(Debug, Clone)]
pub(in crate::service) struct Budget {
    burst: u32,
    /// The interval at which a token is added.
    refill: Duration,
    tokens: u32,
    /// When the newest token was added.
    since: Option<Instant>,
}

impl Budget {
    /// A full bucket.
    pub(in crate::service) const fn new(burst: u32, refill: Duration) -> Self {
        Self {
            burst,
            refill,
            tokens: burst,
            since: None,
        }
    }

    /// Takes a token if there is one.
    pub(in crate::service) fn take(&mut self, now: Instant) -> bool {
        self.fill(now);
        let is_any = self.tokens > 0;
        self.tokens -= u32::from(is_any);
        is_any
    }

    /// When the next token is added; `None` if there is one already.
    pub(super) fn next(&self) -> Option<Instant> {
        let since = self.since.filter(|_| self.tokens == 0)?;
        Some(since + self.refill)
    }

    fn fill(&mut self, now: Instant) {
        let since = *self.since.get_or_insert(now);
        let passed = now.saturating_duration_since(since);
        let tokens = (passed.as_nanos() / self.refill.as_nanos().max(1)).min(self.burst.into());
        let tokens = u32::try_from(tokens).unwrap_or(self.burst);
        self.tokens = self.tokens.saturating_add(tokens).min(self.burst);
        if self.tokens == self.burst {
            self.since = Some(now);
        } else {
            self.since = Some(since + self.refill * tokens);
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "the test starts at an arbitrary instant"
)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_times() {
        let times = |seed| {
            let mut jitter = Jitter::new(seed);
            std::array::from_fn::<_, 8, _>(|_| jitter.around(Duration::from_secs(10)))
        };
        assert_eq!(times(1), times(1));
        assert_ne!(times(1), times(2));
    }

    #[test]
    fn jitter_stays_within_a_tenth() {
        let mut jitter = Jitter::new(7);
        for _ in 0..1000 {
            let drawn = jitter.around(Duration::from_secs(10));
            assert!((9.0..=11.0).contains(&drawn.as_secs_f64()), "{drawn:?}");
        }
    }

    #[test]
    fn a_budget_allows_a_burst_and_then_its_rate() {
        let start = Instant::now();
        let mut budget = Budget::new(3, Duration::from_secs(1));
        let taken = (0..100_u32)
            .filter(|tick| budget.take(start + Duration::from_millis(100) * *tick))
            .count();
        assert_eq!(taken, 3 + 9, "three at once, then one a second for 9.9 s");
        assert_eq!(budget.next(), Some(start + Duration::from_secs(10)));
    }
}
