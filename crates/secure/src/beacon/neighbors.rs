//! The nodes that beacons have shown: which beacons count, at a bounded cost.

use std::collections::HashMap;
use std::net::{IpAddr, SocketAddr};
use std::time::{Duration, Instant};

use jaus_limits::{Buckets, Rate, quota_address};

use super::{Beacon, Received, Stamp};
use crate::key::{Fingerprint, PublicKey};
use crate::trust::TrustFile;

/// How long a beacon counts. A dial ends when the last beacon of its peer is older.
pub(crate) const LIFETIME: Duration = Duration::from_secs(30);
/// Signature checks of one key's beacons from one address. A check takes some 50 µs, and a node sends
/// a beacon every 2 s or 5 s.
const CHECKS: Rate = Rate::new(1, 8);
/// Addresses with a limit of their own for each trusted key. The others share one, so the checks for
/// one key take less than 0.1 % of a processor even if their senders invent addresses.
const ADDRESSES: usize = 16;

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
    /// Beacons whose signature was not checked, because too many of their key came from their address.
    Limited = "beacons ignored: too many of one key from one address",
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
    keys: HashMap<Fingerprint, Candidate>,
    counters: Counters,
}

/// A trusted key, and what beacons have shown of it.
#[derive(Debug)]
struct Candidate {
    key: PublicKey,
    /// Its last beacon, and when it came.
    last: Option<(Stamp, Instant)>,
    checks: Buckets<IpAddr>,
    /// The address of its last beacon, with a limit that no other address can use up.
    home: Option<(IpAddr, Buckets<()>)>,
}

impl Candidate {
    fn new(key: PublicKey) -> Self {
        Self {
            key,
            last: None,
            checks: Buckets::new(CHECKS, ADDRESSES),
            home: None,
        }
    }

    fn is_replayed(&self, now: Instant, stamp: Stamp) -> bool {
        self.last
            .is_some_and(|(last, at)| stamp <= last && now < at + LIFETIME)
    }

    /// Whether the signature of a beacon from this address may be checked.
    fn may_check(&mut self, now: Instant, from: IpAddr) -> bool {
        match &mut self.home {
            Some((home, checks)) if *home == from => checks.take(now, ()),
            _ => self.checks.take(now, quota_address(from)),
        }
    }

    /// Notes a beacon that the key has signed.
    fn note(&mut self, now: Instant, from: IpAddr, stamp: Stamp) {
        self.last = Some((stamp, now));
        if self.home.as_ref().is_none_or(|(home, _)| *home != from) {
            self.home = Some((from, Buckets::new(CHECKS, 1)));
        }
    }
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
        let candidate = self.keys.get_mut(&claim.fingerprint);
        let candidate = candidate.ok_or(Counter::Unknown)?;
        let key = candidate.key;
        let address = link_address(claim, from).ok_or(Counter::Misplaced)?;
        let peer = self.trust.find(key).ok_or(Counter::Unknown)?;
        if !claim.may_come_from(&peer.ids) {
            return Err(Counter::ForeignIds);
        }
        if candidate.is_replayed(now, claim.stamp) {
            return Err(Counter::Replayed);
        }
        if !candidate.may_check(now, from.ip()) {
            return Err(Counter::Limited);
        }
        received.verify(key).ok_or(Counter::Forged)?;
        candidate.note(now, from.ip(), claim.stamp);
        Ok(Sighting { key, address })
    }

    /// Computes the fingerprints again if the trusted keys have changed.
    fn follow_trust(&mut self) {
        let edition = self.trust.edition();
        if self.edition == Some(edition) {
            return;
        }
        self.edition = Some(edition);
        let mut known = std::mem::take(&mut self.keys);
        let candidates = self.trust.keys().into_iter().map(|key| {
            let fingerprint = key.fingerprint();
            let candidate = known.remove(&fingerprint);
            (
                fingerprint,
                candidate.unwrap_or_else(|| Candidate::new(key)),
            )
        });
        self.keys = candidates.collect();
    }
}

/// The address of the sender's link, if the beacon came from the address that it names: otherwise
/// it was recorded elsewhere. A link-local address has the interface of its arrival.
fn link_address(claim: &Beacon, mut from: SocketAddr) -> Option<SocketAddr> {
    let is_there = claim.address == from.ip().to_canonical() && claim.port != 0;
    from.set_port(claim.port);
    is_there.then_some(from)
}
