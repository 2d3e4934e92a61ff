//! A histogram of latencies: exact mean, count and maximum, percentiles within 1.6 %.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// Buckets per power of two of nanoseconds, as a power of two.
const PRECISION: u32 = 6;

/// Latencies in nanoseconds, in buckets at most 1/64 of their value wide. Its size does not depend
/// on the number of latencies.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Latencies {
    /// Number of latencies in each nonempty bucket.
    buckets: BTreeMap<u32, u64>,
    count: u64,
    sum: u64,
    max: u64,
}

impl Latencies {
    pub(super) fn add(&mut self, latency: Duration) {
        let nanoseconds = u64::try_from(latency.as_nanos()).unwrap_or(u64::MAX);
        *self.buckets.entry(bucket(nanoseconds)).or_default() += 1;
        self.count += 1;
        self.sum = self.sum.saturating_add(nanoseconds);
        self.max = self.max.max(nanoseconds);
    }

    pub(super) fn merge(&mut self, other: &Self) {
        for (&bucket, count) in &other.buckets {
            *self.buckets.entry(bucket).or_default() += count;
        }
        self.count += other.count;
        self.sum = self.sum.saturating_add(other.sum);
        self.max = self.max.max(other.max);
    }

    pub(super) const fn count(&self) -> u64 {
        self.count
    }

    /// Zero if empty.
    pub(super) fn mean(&self) -> Duration {
        Duration::from_nanos(self.sum / self.count.max(1))
    }

    /// The latency that a share (0 to 1) of them does not exceed; zero if empty.
    pub(super) fn percentile(&self, share: f64) -> Duration {
        let rank = (self.count as f64 * share).ceil() as u64;
        let mut seen = 0;
        let reached = self.buckets.iter().find(|(_, count)| {
            seen += **count;
            seen >= rank
        });
        let highest = reached.map_or(0, |(&bucket, _)| highest(bucket));
        Duration::from_nanos(highest.min(self.max))
    }
}

/// The bucket of a value: its power of two and the `PRECISION` bits below the leading one. Values
/// below `2 << PRECISION` have a bucket each.
const fn bucket(value: u64) -> u32 {
    let shift = (u64::BITS - value.leading_zeros()).saturating_sub(PRECISION + 1);
    (shift << PRECISION) + (value >> shift) as u32
}

/// The highest value in a bucket.
const fn highest(bucket: u32) -> u64 {
    let shift = (bucket >> PRECISION).saturating_sub(1);
    let lowest = (bucket - (shift << PRECISION)) as u64;
    (lowest << shift) + ((1 << shift) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_lie_within_the_width_of_a_bucket() {
        let (mut odd, mut even) = (Latencies::default(), Latencies::default());
        for microseconds in 1..=1000 {
            let half = if microseconds % 2 == 0 {
                &mut even
            } else {
                &mut odd
            };
            half.add(Duration::from_micros(microseconds));
        }
        odd.merge(&even);
        for (share, exact) in [(0.001, 1.0), (0.5, 500.0), (0.99, 990.0), (0.999, 999.0)] {
            let measured = odd.percentile(share).as_secs_f64() * 1e6;
            assert!(
                (exact..exact * 1.016).contains(&measured),
                "{share}: {measured}"
            );
        }
        assert_eq!(odd.percentile(1.0), Duration::from_millis(1));
        assert_eq!(odd.mean(), Duration::from_nanos(500_500));
        assert_eq!(odd.count(), 1000);
    }

    #[test]
    fn every_value_lies_in_its_bucket() {
        let powers = (0..63).flat_map(|power| [(1u64 << power) - 1, 1 << power, (1 << power) + 1]);
        for value in powers.chain([100, 1000, 123_456_789]) {
            let bucket = bucket(value);
            assert!(value <= highest(bucket), "{value}");
            assert!(bucket == 0 || highest(bucket - 1) < value, "{value}");
        }
    }

    #[test]
    fn an_empty_histogram_reports_zero() {
        let none = Latencies::default();
        assert_eq!((none.mean(), none.percentile(0.5)), Default::default());
    }
}
