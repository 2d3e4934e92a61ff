//! Where subsystems are and how they write, learned from what they send.
//!
//! A subsystem is believed at one address at a time. While it is heard there, the same number
//! from elsewhere is somebody else's mistake, and is not listened to; only after a silence it may
//! move. OpenJAUS follows whoever spoke last, and loses both when two have one number.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::time::Instant;

use super::{Dialect, Settings};
use crate::{Counter, Counters};
use jaus::endpoint::Buckets;

/// Where a subsystem is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    address: SocketAddr,
    dialect: Dialect,
    heard: Instant,
}

/// The places of all subsystems that were heard.
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

    /// A subsystem spoke from an address in a framing.
    ///
    /// # Errors
    /// What the message is counted as, if it is not to be believed.
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

    /// Forgets the one that was silent for longest, if it was silent for long enough.
    fn make_room(&mut self, silent: impl Fn(&Place) -> bool) -> bool {
        let oldest = self.places.iter().min_by_key(|(_, place)| place.heard);
        let oldest = oldest.filter(|(_, place)| silent(place));
        let Some((&subsystem, _)) = oldest else {
            return false;
        };
        self.places.remove(&subsystem);
        true
    }

    /// Where to send what is for a subsystem, and in which framing.
    pub(super) fn of(&self, subsystem: u8) -> Option<(SocketAddr, Dialect)> {
        let place = self.places.get(&subsystem)?;
        Some((place.address, place.dialect))
    }

    /// In which framing a host writes, if it has been heard.
    pub(super) fn dialect_at(&self, host: IpAddr) -> Option<Dialect> {
        let mut places = self.places.values();
        let place = places.find(|place| place.address.ip() == host)?;
        Some(place.dialect)
    }

    /// Whether somebody writes in that framing.
    pub(super) fn speaks(&self, dialect: Dialect) -> bool {
        self.places.values().any(|place| place.dialect == dialect)
    }

    /// How many places are known.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Forgets where a subsystem is.
    pub(super) fn forget(&mut self, subsystem: u8) {
        self.places.remove(&subsystem);
    }
}
