//! Numbers of connections and pages of a server, of which one network address gets only a share.

use std::collections::HashMap;
use std::fmt;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::quota_address;

/// The network address of a client, as far as limits tell addresses apart: of IPv6 the first 64
/// bits, because a host chooses the others at will.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Source(IpAddr);

impl Source {
    /// The network address that counts for a socket address.
    #[must_use]
    pub fn of(address: SocketAddr) -> Self {
        Self(quota_address(address.ip()))
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Why there is no place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPlace {
    /// All are taken.
    Full,
    /// The address has its share.
    Share,
}

/// A number of places, and how many of them one address gets.
#[derive(Clone, Debug)]
pub struct Places(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    most: usize,
    share: usize,
    taken: Mutex<HashMap<Source, usize>>,
}

impl Places {
    /// `most` places in all, and `share` for one address.
    #[must_use]
    pub fn new(most: usize, share: usize) -> Self {
        let taken = Mutex::new(HashMap::new());
        Self(Arc::new(Inner { most, share, taken }))
    }

    /// Takes a place, until it is dropped.
    ///
    /// # Errors
    /// [`NoPlace`] says whether all places are taken, or the share of the address.
    pub fn take(&self, source: Source) -> Result<Place, NoPlace> {
        let mut taken = self.0.taken();
        if taken.get(&source).is_some_and(|it| *it >= self.0.share) {
            return Err(NoPlace::Share);
        }
        if taken.values().sum::<usize>() >= self.0.most {
            return Err(NoPlace::Full);
        }
        *taken.entry(source).or_default() += 1;
        let places = self.0.clone();
        Ok(Place { places, source })
    }

    /// Number of places taken.
    #[must_use]
    pub fn taken(&self) -> usize {
        self.0.taken().values().sum()
    }
}

impl Inner {
    fn taken(&self) -> MutexGuard<'_, HashMap<Source, usize>> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A place that is taken.
#[derive(Debug)]
pub struct Place {
    places: Arc<Inner>,
    source: Source,
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.places.taken();
        if let Some(count) = taken.get_mut(&self.source) {
            *count -= 1;
            if *count == 0 {
                taken.remove(&self.source);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: &str) -> Source {
        Source::of(SocketAddr::new(text.parse().unwrap(), 1))
    }

    #[test]
    fn one_address_gets_its_share_and_leaves_the_rest_to_others() {
        let places = Places::new(10, 4);
        let [one, other] = ["10.0.0.1", "10.0.0.2"].map(source);
        let mut taken: Vec<_> = (0..300).flat_map(|_| places.take(one)).collect();
        assert_eq!(taken.len(), 4);
        assert_eq!(places.take(one).err(), Some(NoPlace::Share));
        let others: Vec<_> = (0..4).map(|_| places.take(other).unwrap()).collect();
        assert_eq!(places.taken(), 8);
        taken.pop();
        taken.push(places.take(one).unwrap());
        drop((taken, others));
        assert_eq!(places.taken(), 0);
        assert!(places.0.taken().is_empty());
    }

    #[test]
    fn all_addresses_together_get_no_more_than_all_places() {
        let places = Places::new(10, 4);
        let taken: Vec<_> = (0..9)
            .flat_map(|it| (0..4).map(move |_| source(&format!("10.0.0.{it}"))))
            .map(|it| places.take(it))
            .collect();
        assert_eq!(taken.iter().filter(|it| it.is_ok()).count(), 10);
        assert_eq!(taken[11].as_ref().err(), Some(&NoPlace::Full));
    }

    #[test]
    fn the_addresses_of_one_ipv6_network_are_one_source() {
        assert_eq!(source("2001:db8::1"), source("2001:db8::ffff:0:0:2"));
        assert_ne!(source("2001:db8::1"), source("2001:db8:0:1::1"));
        assert_eq!(source("::ffff:10.0.0.1"), source("10.0.0.1"));
    }
}
