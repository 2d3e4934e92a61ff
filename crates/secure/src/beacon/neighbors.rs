//! The nodes that beacons have shown: which beacons count, at a bounded cost.

use std::collections::HashMap;
use std::net::{IpAddr, SocketAddr};
use std::time::{Duration, Instant};

use jaus::endpoint::{Buckets, Rate};

use super::{Beacon, Received, Stamp};
use crate::key::{Fingerprint, PublicKey};
use crate::trust::TrustFile;

/// How long a beacon counts. A dial ends when the last beacon of its peer is older.
pub(crate) const LIFETIME: Duration = Duration::from_secs(30);
/// Signature checks for one address. A check takes some 50 µs, and a node sends a beacon every 2 s
/// or 5 s.
const CHECKS: Rate = Rate::new(4, 16);
/// Addresses with a limit of their own. The others share one, so all checks together take about 1 %
/// of a processor even if their senders invent addresses.
const ADDRESSES: usize = 64;

jaus::counters! {
    /// Counts of received beacons.
    pub struct Counters;

    BeaconsAccepted = "beacons accepted",
    /// Beacons with the key of this node.
    Own = "beacons ignored: own",
    Malformed = "beacons ignored: malformed",
    Unknown = "beacons ignored: untrusted key",
    /// Beacons that came from another address than they name, or name no port.
    Misplaced = "beacons ignored: from another address",
    /// Beacons that were not newer than an earlier one of their key.
    Replayed = "beacons ignored: not newer than the last one",
    /// Beacons whose signature was not checked, because too many came from their address.
    Limited = "beacons ignored: too many from one address",
    Forged = "beacons ignored: wrong signature",
    /// Beacons of ids for which their key may not speak.
    ForeignIds = "beacons ignored: id that their key may not use",
}

/// A node that was found by its beacon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sighting {
    /// Its key.
    pub key: PublicKey,
    /// Where its secure link listens.
    pub address: SocketAddr,
}

/// Checks received beacons.
///
/// The clocks of nodes may be wrong: vehicles often have none that survives a restart. A beacon
/// therefore has to be newer than the last one of its key, whatever the time of day is here. The
/// last one is forgotten 30 s after it came, so that a node whose clock was set back is found again.
#[derive(Debug)]
pub struct Neighbors {
    own: Fingerprint,
    trust: TrustFile,
    /// The edition of the trust that `keys` are from.
    edition: Option<u64>,
    keys: HashMap<Fingerprint, PublicKey>,
    /// The last beacon of each key, and when it came. Only trusted keys have one.
    last: HashMap<PublicKey, (Stamp, Instant)>,
    checks: Buckets<IpAddr>,
    counters: Counters,
}

impl Neighbors {
    /// For a node with this key, which trusts these.
    #[must_use]
    pub fn new(own: PublicKey, trust: TrustFile) -> Self {
        Self {
            own: own.fingerprint(),
            trust,
            edition: None,
            keys: HashMap::new(),
            last: HashMap::new(),
            checks: Buckets::new(CHECKS, ADDRESSES),
            counters: Counters::default(),
        }
    }

    /// The counters so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Checks a datagram from this address; returns the node that it shows.
    pub fn handle(&mut self, now: Instant, from: SocketAddr, datagram: &[u8]) -> Option<Sighting> {
        match self.check(now, from, datagram) {
            Ok(sighting) => {
                self.counters.add(Counter::BeaconsAccepted);
                Some(sighting)
            }
            Err(reason) => {
                self.counters.add(reason);
                tracing::trace!(%from, "{reason}");
                None
            }
        }
    }

    /// The checks, the cheap ones first. The error is the counter of the reason.
    fn check(
        &mut self,
        now: Instant,
        from: SocketAddr,
        datagram: &[u8],
    ) -> Result<Sighting, Counter> {
        self.follow_trust();
        let received = Received::decode(datagram).ok_or(Counter::Malformed)?;
        let claim = received.claim();
        if claim.fingerprint == self.own {
            return Err(Counter::Own);
        }
        let key = self.keys.get(&claim.fingerprint).copied();
        let key = key.ok_or(Counter::Unknown)?;
        let address = link_address(claim, from).ok_or(Counter::Misplaced)?;
        if self.is_replayed(now, key, claim.stamp) {
            return Err(Counter::Replayed);
        }
        if !self.checks.take(now, from.ip()) {
            return Err(Counter::Limited);
        }
        let beacon = received.verify(key).ok_or(Counter::Forged)?;
        let peer = self.trust.find(key).ok_or(Counter::Unknown)?;
        if !beacon.may_come_from(&peer.ids) {
            return Err(Counter::ForeignIds);
        }
        self.last.insert(key, (beacon.stamp, now));
        Ok(Sighting { key, address })
    }

    fn is_replayed(&self, now: Instant, key: PublicKey, stamp: Stamp) -> bool {
        self.last
            .get(&key)
            .is_some_and(|&(last, at)| stamp <= last && now < at + LIFETIME)
    }

    /// Computes the fingerprints again if the trusted keys have changed.
    fn follow_trust(&mut self) {
        let edition = self.trust.edition();
        if self.edition == Some(edition) {
            return;
        }
        self.edition = Some(edition);
        let keys = self.trust.keys();
        self.last.retain(|key, _| keys.contains(key));
        self.keys = keys
            .into_iter()
            .map(|key| (key.fingerprint(), key))
            .collect();
    }
}

/// The address of the sender's link, if the beacon came from the address that it names: otherwise
/// it was recorded elsewhere. A link-local address has the interface of its arrival.
fn link_address(claim: &Beacon, mut from: SocketAddr) -> Option<SocketAddr> {
    let is_there = claim.address == from.ip().to_canonical() && claim.port != 0;
    from.set_port(claim.port);
    is_there.then_some(from)
}
