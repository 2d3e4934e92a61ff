//! When a node sends beacons, and what they say.

use std::net::IpAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;

use super::{Beacon, Stamp};
use crate::key::{Fingerprint, Key};

/// The interval of the first beacons, so that a node that has just started is found soon.
const FIRST_INTERVAL: Duration = Duration::from_secs(2);
/// The number of first beacons.
const FIRST: u32 = 5;
/// The interval of later beacons.
const INTERVAL: Duration = Duration::from_secs(5);
/// The share of an interval by which beacons are sent earlier, at most.
const JITTER: f64 = 0.2;

/// Makes the beacons of a node.
#[derive(Debug)]
pub struct Announcer {
    key: Key,
    fingerprint: Fingerprint,
    node: JausId,
    port: u16,
    rounds: u32,
    stamp: Stamp,
    due: Option<Instant>,
}

impl Announcer {
    /// For the node of this id, whose secure link listens on this UDP port. The component of the id
    /// does not matter.
    #[must_use]
    pub fn new(key: &Key, node: JausId, port: u16) -> Self {
        Self {
            key: key.clone(),
            fingerprint: key.public().fingerprint(),
            node,
            port,
            rounds: 0,
            stamp: Stamp::default(),
            due: None,
        }
    }

    /// When the next beacons are due; `None` at once.
    #[must_use]
    pub const fn due(&self) -> Option<Instant> {
        self.due
    }

    /// Whether beacons are due.
    #[must_use]
    pub fn is_due(&self, now: Instant) -> bool {
        self.due.is_none_or(|due| due <= now)
    }

    /// The beacon for each of these addresses of the node, made at this time since 1970; sets when
    /// the next ones are due.
    pub fn announce(
        &mut self,
        now: Instant,
        time_of_day: Duration,
        addresses: impl IntoIterator<Item = IpAddr>,
    ) -> Vec<Option<Bytes>> {
        self.due = Some(now + self.interval());
        self.rounds = self.rounds.saturating_add(1);
        let beacons = addresses.into_iter().map(|it| self.beacon(time_of_day, it));
        beacons.collect()
    }

    fn beacon(&mut self, time_of_day: Duration, address: IpAddr) -> Option<Bytes> {
        self.stamp = self.stamp.after(time_of_day);
        let beacon = Beacon {
            fingerprint: self.fingerprint,
            subsystem: self.node.subsystem(),
            node: self.node.node(),
            address,
            port: self.port,
            stamp: self.stamp,
        };
        beacon.sign(&self.key)
    }

    /// The time until the next beacons. The octets of the fingerprint vary it, which differ between
    /// nodes: those that were started together do not go on together.
    fn interval(&self) -> Duration {
        let interval = match self.rounds {
            ..FIRST => FIRST_INTERVAL,
            _ => INTERVAL,
        };
        let octets = self.fingerprint.as_octets();
        let octet = octets[self.rounds as usize % octets.len()];
        interval.mul_f64(1.0 - JITTER * f64::from(octet) / 255.0)
    }
}
