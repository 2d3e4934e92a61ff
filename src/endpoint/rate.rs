//! How much is taken from one source: token buckets by network address and by id.
//!
//! By default only the learning of new ids is limited, because that is what a flood of invented
//! senders needs and no peer does; how many messages somebody sends is limited only if configured.
//! The tables of buckets are bounded: who finds no place in a full one shares a single bucket with
//! all others without a place, so that inventing addresses gains nothing.

use std::collections::HashMap;
use std::hash::Hash;
use std::net::{IpAddr, Ipv6Addr};
use std::time::{Duration, Instant};

use super::{Counter, LinkId, Path};
use crate::address::JausId;

/// Nanoseconds of a second.
const NANOS: u64 = 1_000_000_000;

/// So many in a second in the long run, and so many at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Rate {
    /// In the long run, each second; 0 is taken for 1.
    pub per_second: u32,
    /// At once, after a pause; 0 is taken for 1.
    pub burst: u32,
}

impl Rate {
    /// A rate.
    #[must_use]
    pub const fn new(per_second: u32, burst: u32) -> Self {
        Self { per_second, burst }
    }

    /// How long it takes until so many more are allowed.
    fn time_for(self, tokens: u32) -> Duration {
        Duration::from_nanos(u64::from(tokens) * NANOS / u64::from(self.per_second.max(1)))
    }
}

/// What is limited, for each source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rates {
    /// New ids heard from one network address. By default 1024 at once and 64 a second: all
    /// components of four full nodes, or of a router's whole network.
    pub new_ids: Rate,
    /// Messages from one network address. By default not limited.
    pub messages_per_address: Option<Rate>,
    /// Messages from one id. By default not limited.
    pub messages_per_id: Option<Rate>,
}

impl Default for Rates {
    fn default() -> Self {
        Self {
            new_ids: Rate::new(64, 1024),
            messages_per_address: None,
            messages_per_id: None,
        }
    }
}

/// A token bucket. It holds when it will be full again, which says how many tokens it has.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bucket {
    full: Option<Instant>,
}

impl Bucket {
    /// Takes a token, if there is one.
    pub(super) fn take(&mut self, now: Instant, rate: Rate) -> bool {
        self.take_many(now, rate, 1)
    }

    /// Takes so many tokens, if they are there.
    pub(super) fn take_many(&mut self, now: Instant, rate: Rate, tokens: u32) -> bool {
        let cost = rate.time_for(tokens);
        let is_there = self.debt(now) + cost <= rate.time_for(rate.burst.max(1));
        if is_there {
            self.spend(now, cost);
        }
        is_there
    }

    /// How long it takes until it is full.
    pub(super) fn debt(self, now: Instant) -> Duration {
        let debt = self.full.map(|full| full.saturating_duration_since(now));
        debt.unwrap_or_default()
    }

    /// It takes so much longer until it is full.
    pub(super) fn spend(&mut self, now: Instant, time: Duration) {
        self.full = Some(self.full.map_or(now, |full| full.max(now)) + time);
    }

    /// How many tokens are missing.
    fn owed(self, now: Instant, rate: Rate) -> u32 {
        let owed =
            self.debt(now).as_nanos() * u128::from(rate.per_second.max(1)) / u128::from(NANOS);
        u32::try_from(owed).unwrap_or(u32::MAX)
    }

    pub(super) fn is_full(self, now: Instant) -> bool {
        self.debt(now).is_zero()
    }
}

/// A bucket for each source, as far as there is room.
#[derive(Debug)]
pub struct Buckets<K> {
    rate: Rate,
    limit: usize,
    own: HashMap<K, Bucket>,
    shared: Bucket,
    swept: Option<Instant>,
}

impl<K: Eq + Hash> Buckets<K> {
    /// The shortest time between two looks for buckets that can be given up.
    const SWEEP: Duration = Duration::from_secs(1);

    /// Buckets of that rate for at most `limit` sources.
    #[must_use]
    pub fn new(rate: Rate, limit: usize) -> Self {
        Self {
            rate,
            limit: limit.max(1),
            own: HashMap::new(),
            shared: Bucket::default(),
            swept: None,
        }
    }

    /// Takes a token of a source, if there is one.
    pub fn take(&mut self, now: Instant, source: K) -> bool {
        self.take_many(now, source, 1)
    }

    /// How much each source may take.
    pub(super) const fn rate(&self) -> Rate {
        self.rate
    }

    /// How many tokens a source has taken that have not come back yet.
    pub(super) fn owed(&self, now: Instant, source: &K) -> u32 {
        let bucket = self.own.get(source).copied();
        bucket.unwrap_or(self.shared).owed(now, self.rate)
    }

    /// Takes so many tokens of a source, if they are there.
    pub(super) fn take_many(&mut self, now: Instant, source: K, tokens: u32) -> bool {
        if self.own.len() >= self.limit && !self.own.contains_key(&source) {
            self.sweep(now);
            if self.own.len() >= self.limit {
                return self.shared.take_many(now, self.rate, tokens);
            }
        }
        let own = self.own.entry(source).or_default();
        own.take_many(now, self.rate, tokens)
    }

    /// Gives up full buckets: an absent one is as good.
    fn sweep(&mut self, now: Instant) {
        let recent = |at: Instant| now.saturating_duration_since(at) < Self::SWEEP;
        if !self.swept.is_some_and(recent) {
            self.swept = Some(now);
            self.own.retain(|_, bucket| !bucket.is_full(now));
        }
    }
}

/// What shares one quota: an IPv4 address, or the 64 bits of an IPv6 network, in which one host may
/// take any number of addresses. Hosts on one cable share the network of link-local addresses, so
/// there it is the address.
pub(crate) fn quota_address(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(v6) if !v6.is_unicast_link_local() => {
            Ipv6Addr::from_bits(v6.to_bits() >> 64 << 64).into()
        }
        other => other,
    }
}

/// Where something comes from, as far as the network tells: what shares one quota.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Origin {
    Address(IpAddr),
    Line(LinkId),
}

impl From<Path> for Origin {
    fn from(path: Path) -> Self {
        match path.peer.socket() {
            Some(address) => Self::Address(quota_address(address.ip())),
            None => Self::Line(path.link),
        }
    }
}

/// The buckets of an endpoint.
#[derive(Debug)]
pub(super) struct Gate {
    new_ids: Buckets<Origin>,
    messages_by_address: Option<Buckets<Origin>>,
    messages_by_id: Option<Buckets<JausId>>,
}

impl Gate {
    /// Buckets for at most `limit` sources in each table.
    pub(super) fn new(rates: &Rates, limit: usize) -> Self {
        Self {
            new_ids: Buckets::new(rates.new_ids, limit),
            messages_by_address: rates
                .messages_per_address
                .map(|rate| Buckets::new(rate, limit)),
            messages_by_id: rates.messages_per_id.map(|rate| Buckets::new(rate, limit)),
        }
    }

    /// How many sources have a bucket.
    pub(super) fn len(&self) -> usize {
        let by_address = self.messages_by_address.as_ref();
        let by_id = self.messages_by_id.as_ref();
        self.new_ids.own.len()
            + by_address.map_or(0, |buckets| buckets.own.len())
            + by_id.map_or(0, |buckets| buckets.own.len())
    }

    /// Whether one more message may come from there.
    pub(super) fn admit_message(
        &mut self,
        now: Instant,
        from: Path,
        source: JausId,
    ) -> Result<(), Counter> {
        let in_rate = |admitted: Option<bool>| {
            let admitted = admitted.unwrap_or(true);
            admitted.then_some(()).ok_or(Counter::MessageRate)
        };
        let by_address = self.messages_by_address.as_mut();
        in_rate(by_address.map(|buckets| buckets.take(now, from.into())))?;
        let by_id = self.messages_by_id.as_mut();
        in_rate(by_id.map(|buckets| buckets.take(now, source)))
    }

    /// Whether an id that was not known may come from there.
    pub(super) fn admit_new_id(&mut self, now: Instant, from: Path) -> Result<(), Counter> {
        let admitted = self.new_ids.take(now, from.into());
        admitted.then_some(()).ok_or(Counter::NewIdRate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[expect(
        clippy::disallowed_methods,
        reason = "an arbitrary beginning of virtual time"
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
}
