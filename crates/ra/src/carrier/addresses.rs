//! Addresses and framings of subsystems, learned from their datagrams.
//!
//! A subsystem has one address at a time. While that address is active, messages with the same
//! subsystem number from elsewhere are a misconfiguration and are dropped; the subsystem may move
//! only after a silence. OpenJAUS follows the last sender, and loses both subsystems when two share
//! a number.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::time::Instant;

use super::{Dialect, Settings};
use crate::counters::{Counter, Counters};
use jaus::endpoint::Buckets;

/// Address of a subsystem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    address: SocketAddr,
    dialect: Dialect,
    heard: Instant,
}

/// Addresses of all known subsystems.
#[derive(Debug)]
pub(super) struct Addresses {
    places: BTreeMap<u8, Place>,
    newcomers: Buckets<IpAddr>,
}

impl Addresses {
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            places: BTreeMap::new(),
            newcomers: Buckets::new(settings.new_subsystems, settings.max_addresses),
        }
    }

    /// Learns the address and framing of a subsystem from a packet.
    ///
    /// # Errors
    /// The counter of the drop, if the packet is not accepted.
    pub(super) fn learn(
        &mut self,
        now: Instant,
        subsystem: u8,
        (from, dialect): (SocketAddr, Dialect),
        settings: &Settings,
        counters: &mut Counters,
    ) -> Result<(), Counter> {
        let mut address = from;
        address.set_port(settings.port);
        let silent =
            |place: &Place| now.saturating_duration_since(place.heard) >= settings.address_patience;
        if let Some(place) = self.places.get_mut(&subsystem) {
            let moved = place.address.ip() != address.ip();
            if moved && !silent(place) {
                return Err(Counter::AddressConflict);
            }
            if moved {
                counters.add(Counter::AddressMoved);
            }
            *place = Place {
                address,
                dialect,
                heard: now,
            };
            return Ok(());
        }
        if !self.newcomers.take(now, address.ip().to_canonical()) {
            return Err(Counter::NewSubsystemRate);
        }
        if self.places.len() >= settings.max_subsystems && !self.make_room(silent) {
            return Err(Counter::SubsystemsFull);
        }
        self.places.insert(
            subsystem,
            Place {
                address,
                dialect,
                heard: now,
            },
        );
        Ok(())
    }

    /// Removes the longest silent subsystem, if it was silent long enough.
    fn make_room(&mut self, silent: impl Fn(&Place) -> bool) -> bool {
        let oldest = self.places.iter().min_by_key(|(_, place)| place.heard);
        let oldest = oldest.filter(|(_, place)| silent(place));
        let Some((&subsystem, _)) = oldest else {
            return false;
        };
        self.places.remove(&subsystem);
        true
    }

    /// The address and framing of a subsystem.
    pub(super) fn of(&self, subsystem: u8) -> Option<(SocketAddr, Dialect)> {
        let place = self.places.get(&subsystem)?;
        Some((place.address, place.dialect))
    }

    /// The framing of a host, if it is known.
    pub(super) fn dialect_at(&self, host: IpAddr) -> Option<Dialect> {
        let mut places = self.places.values();
        let place = places.find(|place| place.address.ip() == host)?;
        Some(place.dialect)
    }

    /// Whether a subsystem uses this framing.
    pub(super) fn speaks(&self, dialect: Dialect) -> bool {
        self.places.values().any(|place| place.dialect == dialect)
    }

    /// Number of known addresses.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Forgets the address of a subsystem.
    pub(super) fn forget(&mut self, subsystem: u8) {
        self.places.remove(&subsystem);
    }
}
