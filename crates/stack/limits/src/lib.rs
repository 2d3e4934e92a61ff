//! Limits on what others may cost: token buckets of sources, and shares of bounded tables.
//!
//! | item | what it is |
//! |---|---|
//! | [`Rate`] | tokens per second, and how many a source may save |
//! | [`Bucket`] | the tokens of one source |
//! | [`Buckets`] | a bucket for each of a bounded number of sources |
//! | [`Shares`], [`Tally`] | how much of a bounded table each owner holds, and how much it may |
//! | [`Displacing`] | which idle entry of a bounded table gives way to a new one |
//! | [`first_of_largest`] | which entry of a short list gives way: of the owner that holds the most |
//! | [`last_of_crowd`] | the same for entries in use, which only a crowd gives up |
//! | [`Yielding`] | which of the holders of bounded places gives way to a newcomer |
//! | [`fair_selection`] | some of many items, evenly from all owners |
//! | [`Places`] | connections of a server, of which one address gets only a share |
//! | [`quota_address`] | the part of a network address that shares one bucket |
//!
//! Time is an argument.

mod displacing;
mod places;
mod shares;
mod yielding;

use std::collections::HashMap;
use std::hash::Hash;
use std::net::{IpAddr, Ipv6Addr};
use std::time::{Duration, Instant};

pub use displacing::{Displacing, Room};
pub use places::{NoPlace, Place, Places, Source};
pub use shares::{Shares, Tally, fair_selection, first_of_largest, last_of_crowd};
pub use yielding::Yielding;

/// A token bucket rate: a sustained rate and a burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Rate {
    /// Tokens per second, sustained; 0 counts as 1.
    pub per_second: u32,
    /// Tokens available at once after a pause; 0 counts as 1.
    pub burst: u32,
}

impl Rate {
    /// Creates a rate.
    #[must_use]
    pub const fn new(per_second: u32, burst: u32) -> Self {
        Self { per_second, burst }
    }

    /// How long it takes to gain this many tokens.
    #[must_use]
    pub fn time_for(self, tokens: u32) -> Duration {
        Duration::from_secs(tokens.into()) / self.per_second.max(1)
    }
}

/// A token bucket. It stores when it will be full again, which determines how many tokens it holds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bucket {
    full: Option<Instant>,
}

impl Bucket {
    /// Takes this many tokens.
    ///
    /// # Errors
    /// The time until there are so many.
    pub fn take(&mut self, now: Instant, rate: Rate, tokens: u32) -> Result<(), Duration> {
        let cost = rate.time_for(tokens);
        let capacity = rate.time_for(rate.burst.max(1));
        match (self.debt(now) + cost).checked_sub(capacity) {
            None | Some(Duration::ZERO) => {
                self.spend(now, cost);
                Ok(())
            }
            Some(wait) => Err(wait),
        }
    }

    /// How long until the bucket is full.
    #[must_use]
    pub fn debt(self, now: Instant) -> Duration {
        let debt = self.full.map(|full| full.saturating_duration_since(now));
        debt.unwrap_or_default()
    }

    /// Postpones the time at which the bucket is full.
    pub fn spend(&mut self, now: Instant, time: Duration) {
        self.full = Some(self.full.map_or(now, |full| full.max(now)) + time);
    }

    /// Returns tokens.
    fn give_back(&mut self, time: Duration) {
        // The clock may be younger than that.
        self.full = self.full.and_then(|full| full.checked_sub(time));
    }

    /// Whether nothing was spent that has not been refilled.
    #[must_use]
    pub fn is_full(self, now: Instant) -> bool {
        self.debt(now).is_zero()
    }
}

/// A bucket per source, as far as there is room.
#[derive(Debug)]
pub struct Buckets<K> {
    rate: Option<Rate>,
    limit: usize,
    own: HashMap<K, Bucket>,
    /// The bucket of sources without one of their own; `None` if they displace others.
    shared: Option<Bucket>,
    swept: Option<Instant>,
}

impl<K: Eq + Hash + Clone> Buckets<K> {
    /// The shortest interval between two sweeps for full buckets.
    const SWEEP: Duration = Duration::from_secs(1);

    /// Creates buckets of this rate for at most `limit` sources; `None` is unlimited. Further sources
    /// share one bucket, so that inventing sources gains nothing.
    #[must_use]
    pub fn new(rate: impl Into<Option<Rate>>, limit: usize) -> Self {
        Self {
            rate: rate.into(),
            limit: limit.max(1),
            own: HashMap::new(),
            shared: Some(Bucket::default()),
            swept: None,
        }
    }

    /// As [`new`](Self::new), but a further source displaces the one that has spent least, so that no
    /// source pays for others.
    #[must_use]
    pub fn displacing(rate: Rate, limit: usize) -> Self {
        Self {
            shared: None,
            ..Self::new(rate, limit)
        }
    }

    /// Takes a token of a source, if available.
    pub fn take(&mut self, now: Instant, source: K) -> bool {
        self.take_many(now, source, 1).is_ok()
    }

    /// Takes this many tokens of a source.
    ///
    /// # Errors
    /// The time until there are so many.
    pub fn take_many(&mut self, now: Instant, source: K, tokens: u32) -> Result<(), Duration> {
        let Some(rate) = self.rate else {
            return Ok(());
        };
        if self.own.len() >= self.limit && !self.own.contains_key(&source) {
            self.sweep(now);
            if self.own.len() >= self.limit {
                match &mut self.shared {
                    Some(shared) => return shared.take(now, rate, tokens),
                    None => self.displace(),
                }
            }
        }
        let own = self.own.entry(source).or_default();
        own.take(now, rate, tokens)
    }

    /// Returns tokens of a source.
    pub fn give_back(&mut self, source: &K, tokens: u32) {
        if let (Some(bucket), Some(rate)) = (self.own.get_mut(source), self.rate) {
            bucket.give_back(rate.time_for(tokens));
        }
    }

    /// Whether a source has spent this many tokens that have not been refilled yet.
    pub fn owes(&self, now: Instant, source: &K, tokens: u32) -> bool {
        let bucket = self.own.get(source).copied().or(self.shared);
        let debt = bucket.unwrap_or_default().debt(now);
        self.rate.is_some_and(|rate| debt >= rate.time_for(tokens))
    }

    /// The number of sources with a bucket of their own.
    #[must_use]
    pub fn len(&self) -> usize {
        self.own.len()
    }

    /// Whether no source has a bucket of its own.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.own.is_empty()
    }

    /// Drops full buckets: a missing bucket is equivalent.
    fn sweep(&mut self, now: Instant) {
        let recent = |at: Instant| now.saturating_duration_since(at) < Self::SWEEP;
        if !self.swept.is_some_and(recent) {
            self.swept = Some(now);
            self.own.retain(|_, bucket| !bucket.is_full(now));
        }
    }

    /// Drops the fullest bucket.
    fn displace(&mut self) {
        let fullest = self.own.iter().min_by_key(|(_, bucket)| bucket.full);
        if let Some(source) = fullest.map(|(source, _)| source.clone()) {
            self.own.remove(&source);
        }
    }
}

/// The quota that an address belongs to: for IPv4 the address itself, for IPv6 the 64-bit network,
/// within which one host may use any number of addresses. All hosts on a link share the network of
/// link-local addresses, so there the address counts.
#[must_use]
pub fn quota_address(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(v6) if !v6.is_unicast_link_local() => {
            Ipv6Addr::from_bits(v6.to_bits() >> 64 << 64).into()
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn start() -> Instant {
        Instant::now()
    }

    fn taken<K: Eq + Hash + Copy>(buckets: &mut Buckets<K>, now: Instant, source: K) -> usize {
        (0..1000).filter(|_| buckets.take(now, source)).count()
    }

    #[test]
    fn the_addresses_of_one_ipv6_network_share_a_quota_and_those_of_a_cable_do_not() {
        let quota = |text: &str| quota_address(text.parse().unwrap());
        assert_eq!(quota("2001:db8::1"), quota("2001:db8::ffff:1"));
        assert_ne!(quota("2001:db8::1"), quota("2001:db8:0:1::1"));
        assert_ne!(quota("fe80::1"), quota("fe80::2"));
        assert_ne!(quota("10.0.0.1"), quota("10.0.0.2"));
        assert_eq!(quota("10.0.0.1"), quota("::ffff:10.0.0.1"));
    }

    #[test]
    fn a_bucket_gives_its_burst_at_once_and_then_its_rate() {
        let (now, mut buckets) = (start(), Buckets::new(Rate::new(10, 5), 8));
        assert_eq!(taken(&mut buckets, now, 1), 5);
        assert_eq!(taken(&mut buckets, now + Duration::from_millis(200), 1), 2);
        assert_eq!(taken(&mut buckets, now + Duration::from_secs(60), 1), 5);
        assert_eq!(taken(&mut buckets, now, 2), 5, "each has its own");
    }

    #[test]
    fn who_finds_no_place_shares_one_bucket() {
        let (now, mut buckets) = (start(), Buckets::new(Rate::new(10, 5), 8));
        let all: usize = (0..1000)
            .map(|source| taken(&mut buckets, now, source))
            .sum();
        assert_eq!((all, buckets.own.len()), (9 * 5, 8));
        let later = now + Duration::from_secs(10);
        assert_eq!(taken(&mut buckets, later, 999), 5, "idle buckets make room");
        assert_eq!(buckets.own.len(), 1);
    }

    #[test]
    fn rates_of_nothing_are_one() {
        let (now, mut buckets) = (start(), Buckets::new(Rate::new(0, 0), 0));
        assert_eq!(taken(&mut buckets, now, 1), 1);
        assert_eq!(taken(&mut buckets, now + Duration::from_secs(1), 1), 1);
    }

    #[test]
    fn who_has_no_place_gets_one_when_a_bucket_is_full_but_not_each_time_it_asks() {
        let (now, mut buckets) = (start(), Buckets::new(Rate::new(1, 1), 1));
        assert!(buckets.take(now, 1) && buckets.take(now, 2));
        let ms = Duration::from_millis;
        // The bucket of 1 is full again after a second, and the last sweep was at the beginning.
        assert!(!buckets.take(now + ms(999), 2), "the shared one");
        assert!(buckets.take(now + ms(1000), 2) && buckets.own.contains_key(&2));
        assert!(buckets.take(now + ms(1500), 3), "the shared one");
        assert!(buckets.own.contains_key(&2));
        assert!(!buckets.take(now + ms(1999), 3) && buckets.own.contains_key(&2));
        assert!(buckets.take(now + ms(2000), 3) && buckets.own.contains_key(&3));
    }

    #[test]
    fn a_source_owes_what_it_has_spent_and_not_regained() {
        let (now, mut buckets) = (start(), Buckets::new(Rate::new(10, 100), 1));
        assert!(!buckets.owes(now, &1, 1));
        assert!(buckets.take_many(now, 1, 40).is_ok());
        assert!(buckets.owes(now, &1, 40) && !buckets.owes(now, &1, 41));
        assert!(!buckets.owes(now, &2, 1), "the shared one is full");
        let later = now + Duration::from_secs(1);
        assert!(buckets.owes(later, &1, 30) && !buckets.owes(later, &1, 31));
        assert!(!Buckets::new(None, 1).owes(now, &1, 0), "without a limit");
    }

    #[test]
    fn a_wait_is_named_and_tokens_given_back_are_taken_again() {
        let (now, mut buckets) = (start(), Buckets::new(Rate::new(1, 20), 8));
        let seconds = Duration::from_secs;
        for _ in 0..2 {
            assert_eq!(buckets.take_many(now, 'a', 10), Ok(()));
        }
        assert_eq!(buckets.take_many(now, 'a', 10), Err(seconds(10)));
        assert_eq!(
            buckets.take_many(now + seconds(4), 'a', 10),
            Err(seconds(6))
        );
        buckets.give_back(&'a', 10);
        assert_eq!(buckets.take_many(now, 'a', 10), Ok(()));
        assert_eq!(buckets.take_many(now + seconds(10), 'a', 10), Ok(()));
    }

    #[test]
    fn a_newcomer_displaces_the_source_that_has_spent_least() {
        let (now, mut buckets) = (start(), Buckets::displacing(Rate::new(1, 3), 16));
        assert_eq!(taken(&mut buckets, now, u32::MAX), 3);
        assert!((0..1000).all(|source| buckets.take(now, source)));
        assert_eq!(buckets.len(), 16);
        assert!(!buckets.take(now, u32::MAX));
    }
}
