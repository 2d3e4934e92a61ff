//! Limits of size and rate.

use std::collections::HashMap;
use std::hash::Hash;
use std::time::{Duration, Instant};

/// Maximum frame size in octets. The largest request takes a tenth of it.
pub(super) const LARGEST_FRAME: usize = 4096;

/// A token bucket rate: a burst, and a sustained rate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rate {
    pub(crate) burst: u32,
    /// Refill period of one token.
    pub(crate) period: Duration,
}

/// Frames of a page: a burst for those that it sends after a delay, and five times the rate of a
/// page that drives.
pub(super) const FRAMES: Rate = Rate {
    burst: 100,
    period: Duration::from_millis(20),
};

/// A token bucket. It stores when it will be full again, which determines how many tokens it holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bucket {
    full: Instant,
}

impl Bucket {
    /// A full bucket.
    pub(crate) const fn new(now: Instant) -> Self {
        Self { full: now }
    }

    /// Takes a token. Without one, returns the time until there is one.
    pub(crate) fn take(&mut self, now: Instant, rate: Rate) -> Result<(), Duration> {
        let full = self.full.max(now) + rate.period;
        let latest = now + rate.period * rate.burst;
        if full > latest {
            return Err(full - latest);
        }
        self.full = full;
        Ok(())
    }

    /// Returns a token.
    fn give_back(&mut self, rate: Rate) {
        // The clock may be younger than a period.
        if let Some(full) = self.full.checked_sub(rate.period) {
            self.full = full;
        }
    }
}

/// A token bucket for each key. Of more keys than it holds, the fullest bucket is forgotten.
#[derive(Debug)]
pub(super) struct Buckets<K> {
    rate: Rate,
    most: usize,
    by_key: HashMap<K, Bucket>,
}

impl<K: Eq + Hash + Clone> Buckets<K> {
    pub(super) fn new(rate: Rate, most: usize) -> Self {
        Self {
            rate,
            most,
            by_key: HashMap::new(),
        }
    }

    /// Takes a token of a key. Without one, returns the time until there is one.
    pub(super) fn take(&mut self, now: Instant, key: &K) -> Result<(), Duration> {
        if !self.by_key.contains_key(key) && self.by_key.len() >= self.most {
            self.forget(now);
        }
        let bucket = self.by_key.entry(key.clone()).or_insert(Bucket::new(now));
        bucket.take(now, self.rate)
    }

    /// Returns a token of a key.
    pub(super) fn give_back(&mut self, key: &K) {
        if let Some(bucket) = self.by_key.get_mut(key) {
            bucket.give_back(self.rate);
        }
    }

    fn forget(&mut self, now: Instant) {
        self.by_key.retain(|_, bucket| bucket.full > now);
        if self.by_key.len() >= self.most {
            let fullest = self.by_key.iter().min_by_key(|(_, bucket)| bucket.full);
            if let Some(key) = fullest.map(|(key, _)| key.clone()) {
                self.by_key.remove(&key);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_page_that_drives_is_never_too_fast() {
        let start = Instant::now();
        let mut bucket = Bucket::new(start);
        for step in 0..1000 {
            let now = start + Duration::from_millis(20) * step;
            assert_eq!(bucket.take(now, FRAMES), Ok(()));
        }
    }

    #[test]
    fn a_flood_is_noticed_after_its_first_hundred_frames_and_forgiven_later() {
        let start = Instant::now();
        let mut bucket = Bucket::new(start);
        let taken = (0..1000).filter(|_| bucket.take(start, FRAMES).is_ok());
        assert_eq!(taken.count(), 100);
        assert_eq!(bucket.take(start + 3600 * SECOND, FRAMES), Ok(()));
    }

    #[test]
    fn keys_do_not_share_tokens_and_a_token_given_back_is_taken_again() {
        let rate = Rate {
            burst: 2,
            period: 10 * SECOND,
        };
        let now = Instant::now() + 3600 * SECOND;
        let mut buckets = Buckets::new(rate, 8);
        for _ in 0..2 {
            assert_eq!(buckets.take(now, &'a'), Ok(()));
        }
        assert_eq!(buckets.take(now, &'a'), Err(10 * SECOND));
        assert_eq!(buckets.take(now + 4 * SECOND, &'a'), Err(6 * SECOND));
        assert_eq!(buckets.take(now, &'b'), Ok(()));
        buckets.give_back(&'a');
        assert_eq!(buckets.take(now, &'a'), Ok(()));
        assert_eq!(buckets.take(now + 10 * SECOND, &'a'), Ok(()));
    }

    #[test]
    fn the_number_of_keys_is_bounded_and_the_emptiest_bucket_is_kept() {
        let rate = Rate {
            burst: 3,
            period: SECOND,
        };
        let now = Instant::now();
        let mut buckets = Buckets::new(rate, 16);
        for _ in 0..3 {
            buckets.take(now, &u32::MAX).unwrap();
        }
        for key in 0..1000 {
            buckets.take(now, &key).unwrap();
        }
        assert!(buckets.by_key.len() <= 16);
        assert!(buckets.take(now, &u32::MAX).is_err());
    }
}
