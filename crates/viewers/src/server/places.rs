//! The places of connections: a limit in all, and half of them for one address. Of IPv6 the first 64 bits count,
//! because a host chooses the others at will.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};

use jaus::endpoint::quota_address;

/// Counts connections.
#[derive(Debug, Clone)]
pub(super) struct Places {
    most: usize,
    taken: Arc<Mutex<BTreeMap<IpAddr, usize>>>,
}

/// A place, free again when it is dropped.
#[derive(Debug)]
pub(super) struct Place {
    places: Places,
    address: IpAddr,
}

impl Places {
    pub(super) fn new(most: usize) -> Self {
        Self {
            most,
            taken: Arc::default(),
        }
    }

    /// A place for a connection from this address, if one is free.
    pub(super) fn take(&self, address: IpAddr) -> Option<Place> {
        let address = quota_address(address);
        let mut taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let of_address = taken.get(&address).copied().unwrap_or(0);
        if taken.values().sum::<usize>() >= self.most || of_address >= self.most / 2 {
            return None;
        }
        taken.insert(address, of_address + 1);
        Some(Place {
            places: self.clone(),
            address,
        })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let taken = self.places.taken.lock();
        let mut taken = taken.unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = taken.get_mut(&self.address) {
            *count -= 1;
            if *count == 0 {
                taken.remove(&self.address);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_address_takes_half_of_the_places_and_places_become_free() {
        let places = Places::new(4);
        let address = |last: u8| IpAddr::from([10, 0, 0, last]);
        let first: Vec<_> = (0..3).filter_map(|_| places.take(address(1))).collect();
        assert_eq!(first.len(), 2);
        let others: Vec<_> = (2..9).filter_map(|it| places.take(address(it))).collect();
        assert_eq!(others.len(), 2);
        drop(first);
        assert!(places.take(address(1)).is_some());
    }
}
