//! Beacons: signed datagrams by which secure nodes of a network find each other.
//!
//! A node with beacons sends one to a multicast group every few seconds. It says where the node's
//! secure link listens, and which key will prove itself there. A node that trusts this key dials
//! that address. A beacon causes nothing but the dial: the handshake authenticates both sides, so a
//! replayed beacon costs its receiver one handshake with an address where the peer once was.
//!
//! A beacon is 137 octets long, numbers little-endian:
//!
//! | octets | content |
//! |--:|---|
//! | 8 | the text `JAUSBCN` and the version, 1 |
//! | 32 | the fingerprint of the sender's key: SHA-256 of the public key |
//! | 3 | the sender's subsystem (2 octets) and node (1) |
//! | 16 | its IP address on this network; IPv4 as IPv4-mapped IPv6 |
//! | 2 | the UDP port of its secure link |
//! | 8 | seconds since 1970 |
//! | 4 | a number that makes time and number together grow with each beacon |
//! | 64 | an Ed25519 signature of a context and of everything before |
//!
//! It contains no name, no list of ids and no key, and it leaves the network of its interface
//! neither by its TTL nor by its content: the beacon on each interface names only the address there.

mod announcer;
mod neighbors;
#[cfg(test)]
mod tests;

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddrV4, SocketAddrV6};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;

pub use announcer::Announcer;
pub(crate) use neighbors::LIFETIME;
pub use neighbors::{Counter, Counters, Neighbors, Sighting};

use crate::key::{Fingerprint, Key, PublicKey};

/// The UDP port of beacons, for IPv4 and IPv6. That of secure links is next to it, because a shared
/// and an exclusive socket cannot have the same one.
pub const PORT: u16 = 3796;
/// The multicast group of beacons.
pub const GROUP: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(239, 255, 0, 2), PORT);
/// The multicast group of beacons for IPv6, which cannot leave a network.
pub const GROUP6: SocketAddrV6 =
    SocketAddrV6::new(Ipv6Addr::new(0xFF12, 0, 0, 0, 0, 0, 0xEFFF, 2), PORT, 0, 0);

/// The length of a beacon in octets.
pub const LENGTH: usize = SIGNED + SIGNATURE;

const MAGIC: [u8; 8] = *b"JAUSBCN\x01";
/// Octets before the signature.
const SIGNED: usize = 73;
const SIGNATURE: usize = 64;
/// Precedes the signed octets, so that no signature for another purpose passes as that of a beacon.
const CONTEXT: &[u8] = b"jaus secure link: beacon 1\0";

/// When a beacon was made. The stamps of a node grow as long as it runs, whatever its clock does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stamp {
    /// Seconds since 1970.
    pub seconds: u64,
    /// Distinguishes beacons of the same second.
    pub number: u32,
}

impl Stamp {
    /// The stamp of a beacon that is made at this time since 1970, after one with this stamp.
    #[must_use]
    pub const fn after(self, time_of_day: Duration) -> Self {
        if time_of_day.as_secs() > self.seconds {
            return Self {
                seconds: time_of_day.as_secs(),
                number: 0,
            };
        }
        match self.number.checked_add(1) {
            Some(number) => Self { number, ..self },
            None => Self {
                seconds: self.seconds.saturating_add(1),
                number: 0,
            },
        }
    }
}

/// The content of a beacon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beacon {
    /// The fingerprint of the sender's key.
    pub fingerprint: Fingerprint,
    /// The sender's subsystem.
    pub subsystem: u16,
    /// Its node.
    pub node: u8,
    /// Its address on the network of the beacon.
    pub address: IpAddr,
    /// The UDP port of its secure link.
    pub port: u16,
    /// When the beacon was made.
    pub stamp: Stamp,
}

impl Beacon {
    /// The beacon as a datagram, signed with the key that its fingerprint names; `None` if the key
    /// cannot sign.
    #[must_use]
    pub fn sign(&self, key: &Key) -> Option<Bytes> {
        let octets = self.encode();
        let signature = key.sign(&[CONTEXT, &octets].concat())?;
        Some([&octets[..], &signature].concat().into())
    }

    /// The octets before the signature.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let address = match self.address {
            IpAddr::V4(v4) => v4.to_ipv6_mapped(),
            IpAddr::V6(v6) => v6,
        };
        [
            &MAGIC[..],
            self.fingerprint.as_octets(),
            &self.subsystem.to_le_bytes(),
            &[self.node],
            &address.octets(),
            &self.port.to_le_bytes(),
            &self.stamp.seconds.to_le_bytes(),
            &self.stamp.number.to_le_bytes(),
        ]
        .concat()
    }

    /// Whether a key that speaks for these ids speaks for any component of the sender.
    fn may_come_from(&self, ids: &[JausId]) -> bool {
        ids.iter().any(|ids| {
            let component = match ids.component() {
                u8::MAX => 1,
                component => component,
            };
            let source = JausId::new(self.subsystem, self.node, component);
            source.is_unicast() && ids.matches(source)
        })
    }
}

/// A beacon whose signature is not verified yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received<'a> {
    beacon: Beacon,
    signed: &'a [u8; SIGNED],
    signature: &'a [u8; SIGNATURE],
}

impl<'a> Received<'a> {
    /// Reads a datagram; `None` if it is no beacon of this version.
    #[must_use]
    pub fn decode(datagram: &'a [u8]) -> Option<Self> {
        let (signed, signature) = datagram.split_first_chunk::<SIGNED>()?;
        let mut reader = Reader(signed);
        if reader.take()? != MAGIC {
            return None;
        }
        let fingerprint = Fingerprint::from_octets(reader.take()?);
        let subsystem = u16::from_le_bytes(reader.take()?);
        let [node] = reader.take()?;
        let beacon = Beacon {
            fingerprint,
            subsystem,
            node,
            address: Ipv6Addr::from(reader.take::<16>()?).to_canonical(),
            port: u16::from_le_bytes(reader.take()?),
            stamp: Stamp {
                seconds: u64::from_le_bytes(reader.take()?),
                number: u32::from_le_bytes(reader.take()?),
            },
        };
        Some(Self {
            beacon,
            signed,
            signature: signature.try_into().ok()?,
        })
    }

    /// What the datagram claims.
    #[must_use]
    pub const fn claim(&self) -> &Beacon {
        &self.beacon
    }

    /// The beacon, if this key has signed it.
    #[must_use]
    pub fn verify(&self, key: PublicKey) -> Option<&Beacon> {
        let message = [CONTEXT, self.signed].concat();
        key.has_signed(&message, self.signature)
            .then_some(&self.beacon)
    }
}

/// Takes fields of fixed length from the front of octets.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (field, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*field)
    }
}
