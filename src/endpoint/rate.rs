//! Rate limits per source: token buckets by network address and by id.
//!
//! By default only the rate of new ids is limited: a flood of invented senders needs many new ids,
//! and no real peer does. The message rate is limited only if configured. The bucket tables are
//! bounded: sources without a place in a full table share a single bucket, so inventing addresses
//! gains nothing.

use std::collections::HashMap;
use std::hash::Hash;
use std::net::{IpAddr, Ipv6Addr};
use std::time::{Duration, Instant};

use super::{Counter, LinkId, Path, Remote, SessionId};
use crate::address::JausId;

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

/// Limits of what is accepted from others.
///
/// ```toml
/// [limits]
/// max_peers = 1024
/// new_ids_per_address = { per_second = 64, burst = 1024 }
/// messages_per_address = { per_second = 20000, burst = 40000 }
/// messages_per_id = { per_second = 5000, burst = 10000 }
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct Limits {
    /// The most peers whose address is remembered, 1 to 65536. At the limit, a new peer evicts a
    /// peer of the network address that holds most of them, else a peer that we have not spoken to,
    /// else the peer heard longest ago. Messages to an evicted peer go to the group until it is
    /// heard again. Addresses of static peers do not count and are never evicted.
    pub max_peers: usize,
    /// New ids from one network address. The default is a burst of 1024 and 64 per second: all
    /// components of four full nodes, or of a router's whole network.
    pub new_ids_per_address: Rate,
    /// Messages from one network address; unlimited if omitted.
    pub messages_per_address: Option<Rate>,
    /// Messages from one id; unlimited if omitted.
    pub messages_per_id: Option<Rate>,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_peers: 1024,
            new_ids_per_address: Rate::new(64, 1024),
            messages_per_address: None,
            messages_per_id: None,
        }
    }
}

/// A token bucket. It stores when it will be full again, which determines how many tokens it holds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bucket {
    full: Option<Instant>,
}

impl Bucket {
    /// Takes this many tokens, if available.
    pub(super) fn take(&mut self, now: Instant, rate: Rate, tokens: u32) -> bool {
        let cost = rate.time_for(tokens);
        let is_there = self.debt(now) + cost <= rate.time_for(rate.burst.max(1));
        if is_there {
            self.spend(now, cost);
        }
        is_there
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

    pub(super) fn is_full(self, now: Instant) -> bool {
        self.debt(now).is_zero()
    }
}

/// A bucket per source, as far as there is room.
#[derive(Debug)]
pub struct Buckets<K> {
    rate: Option<Rate>,
    limit: usize,
    pub(super) own: HashMap<K, Bucket>,
    shared: Bucket,
    swept: Option<Instant>,
}

impl<K: Eq + Hash> Buckets<K> {
    /// The shortest interval between two sweeps for full buckets.
    const SWEEP: Duration = Duration::from_secs(1);

    /// Creates buckets of this rate for at most `limit` sources; `None` is unlimited.
    #[must_use]
    pub fn new(rate: impl Into<Option<Rate>>, limit: usize) -> Self {
        Self {
            rate: rate.into(),
            limit: limit.max(1),
            own: HashMap::new(),
            shared: Bucket::default(),
            swept: None,
        }
    }

    /// Takes a token of a source, if available.
    pub fn take(&mut self, now: Instant, source: K) -> bool {
        self.take_many(now, source, 1)
    }

    /// Whether a source has spent this many tokens that have not been refilled yet.
    pub(super) fn owes(&self, now: Instant, source: &K, tokens: u32) -> bool {
        let debt = self.own.get(source).unwrap_or(&self.shared).debt(now);
        self.rate.is_some_and(|rate| debt >= rate.time_for(tokens))
    }

    /// Takes this many tokens of a source, if available.
    pub(super) fn take_many(&mut self, now: Instant, source: K, tokens: u32) -> bool {
        let Some(rate) = self.rate else {
            return true;
        };
        if self.own.len() >= self.limit && !self.own.contains_key(&source) {
            self.sweep(now);
            if self.own.len() >= self.limit {
                return self.shared.take(now, rate, tokens);
            }
        }
        let own = self.own.entry(source).or_default();
        own.take(now, rate, tokens)
    }

    /// Drops full buckets: a missing bucket is equivalent.
    fn sweep(&mut self, now: Instant) {
        let recent = |at: Instant| now.saturating_duration_since(at) < Self::SWEEP;
        if !self.swept.is_some_and(recent) {
            self.swept = Some(now);
            self.own.retain(|_, bucket| !bucket.is_full(now));
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

/// The origin of traffic as far as the network shows: the unit that shares one quota.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Origin {
    Address(IpAddr),
    Line(LinkId),
    Session(LinkId, SessionId),
}

impl From<Path> for Origin {
    fn from(path: Path) -> Self {
        match path.peer {
            Remote::Socket(address) => Self::Address(quota_address(address.ip())),
            Remote::Line => Self::Line(path.link),
            Remote::Session(session) => Self::Session(path.link, session),
        }
    }
}

/// The rate limits of an endpoint.
#[derive(Debug)]
pub(super) struct Gate {
    pub(super) new_ids: Buckets<Origin>,
    messages_by_address: Buckets<Origin>,
    messages_by_id: Buckets<JausId>,
}

impl Gate {
    /// Creates buckets for at most as many sources in each table as there may be peers.
    pub(super) fn new(limits: &Limits) -> Self {
        let most = limits.max_peers;
        Self {
            new_ids: Buckets::new(limits.new_ids_per_address, most),
            messages_by_address: Buckets::new(limits.messages_per_address, most),
            messages_by_id: Buckets::new(limits.messages_per_id, most),
        }
    }

    /// Applies the limits to a message; `is_new` says whether its sender is unknown.
    pub(super) fn admit(
        &mut self,
        now: Instant,
        from: Path,
        source: JausId,
        is_new: bool,
    ) -> Result<(), Counter> {
        let origin = Origin::from(from);
        if !self.messages_by_address.take(now, origin) || !self.messages_by_id.take(now, source) {
            return Err(Counter::MessageRate);
        }
        if is_new && !self.new_ids.take(now, origin) {
            return Err(Counter::NewIdRate);
        }
        Ok(())
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
        assert!(buckets.take_many(now, 1, 40));
        assert!(buckets.owes(now, &1, 40) && !buckets.owes(now, &1, 41));
        assert!(!buckets.owes(now, &2, 1), "the shared one is full");
        let later = now + Duration::from_secs(1);
        assert!(buckets.owes(later, &1, 30) && !buckets.owes(later, &1, 31));
        assert!(!Buckets::new(None, 1).owes(now, &1, 0), "without a limit");
    }

    #[test]
    fn each_limit_counts_on_its_own() {
        let path = Path {
            link: LinkId(0),
            peer: Remote::Line,
        };
        let (all, new) = (Err(Counter::MessageRate), Err(Counter::NewIdRate));
        let two = Rate::new(1, 2);
        let rates = |new_ids_per_address, messages_per_address, messages_per_id| Limits {
            new_ids_per_address,
            messages_per_address,
            messages_per_id,
            ..Limits::default()
        };
        for (limits, expected) in [
            (rates(two, None, None), [Ok(()), Ok(()), Ok(()), new]),
            (
                rates(Rate::new(1, 9), Some(two), None),
                [Ok(()), Ok(()), all, all],
            ),
            (
                rates(Rate::new(1, 9), None, Some(two)),
                [Ok(()), Ok(()), all, Ok(())],
            ),
        ] {
            let (mut gate, now) = (Gate::new(&limits), start());
            let said = [(1, true), (1, true), (1, false), (2, true)];
            let admitted = said.map(|(component, is_new)| {
                let source = JausId::new(42, 1, component);
                gate.admit(now, path, source, is_new)
            });
            assert_eq!(admitted, expected);
        }
    }
}
