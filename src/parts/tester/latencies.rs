//! Latencies that were measured: their mean and their percentiles.

use std::time::Duration;

/// Times that messages took.
#[derive(Debug, Clone, Default)]
pub struct Latencies {
    /// In tenths of a microsecond, up to seven minutes; sorted when asked.
    tenths: Vec<u32>,
    is_sorted: bool,
}

impl Latencies {
    /// The most that are kept; further ones would not change the figures.
    pub const MOST: usize = 20_000_000;

    /// None yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Another message took this long.
    pub fn add(&mut self, time: Duration) {
        if self.tenths.len() < Self::MOST {
            let tenths = u32::try_from(time.as_nanos() / 100).unwrap_or(u32::MAX);
            self.tenths.push(tenths);
            self.is_sorted = false;
        }
    }

    /// Adds those of somebody else.
    pub fn merge(&mut self, other: Self) {
        let room = Self::MOST - self.tenths.len();
        self.tenths.extend(other.tenths.into_iter().take(room));
        self.is_sorted = false;
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.tenths.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tenths.is_empty()
    }

    /// Their mean; zero if there are none.
    #[must_use]
    pub fn mean(&self) -> Duration {
        let sum: u64 = self.tenths.iter().copied().map(u64::from).sum();
        let count = self.tenths.len().max(1) as u64;
        Duration::from_nanos(sum * 100 / count)
    }

    /// The time within which a share of them, from 0 to 1, lies; zero if there are none.
    pub fn within(&mut self, share: f64) -> Duration {
        if !self.is_sorted {
            self.tenths.sort_unstable();
            self.is_sorted = true;
        }
        let rank = (self.tenths.len() as f64 * share).ceil() as usize;
        let place = rank
            .saturating_sub(1)
            .min(self.tenths.len().saturating_sub(1));
        let tenths = self.tenths.get(place).copied().unwrap_or_default();
        Duration::from_nanos(u64::from(tenths) * 100)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_them_lies_within_its_percentile() {
        let mut latencies = Latencies::new();
        for microseconds in (1..=1000).rev() {
            latencies.add(Duration::from_micros(microseconds));
        }
        let micros = |time: Duration| time.as_micros();
        assert_eq!(micros(latencies.within(0.5)), 500);
        assert_eq!(micros(latencies.within(0.99)), 990);
        assert_eq!(micros(latencies.within(0.999)), 999);
        assert_eq!(micros(latencies.within(1.0)), 1000);
        assert_eq!(latencies.mean(), Duration::from_nanos(500_500));
    }

    #[test]
    fn without_any_all_is_zero() {
        let mut none = Latencies::new();
        assert_eq!((none.mean(), none.within(0.5)), Default::default());
    }
}
