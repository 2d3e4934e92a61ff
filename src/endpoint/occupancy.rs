//! How full the tables are in which an endpoint remembers others, for people and for tests.

use super::Endpoint;

/// Entries of the tables that others can fill. Each has a bound in [`Config`](super::Config).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Occupancy {
    /// Peers, up to [`max_peers`](super::Config::max_peers).
    pub peers: usize,
    /// Messages remembered to tell duplicates, up to 2½ times
    /// [`max_recent`](super::Config::max_recent).
    pub messages: usize,
    /// Sources whose rate is watched, up to [`max_peers`](super::Config::max_peers) for each kind of
    /// [`Rates`](super::Rates).
    pub sources: usize,
}

impl Endpoint {
    /// How full the tables are in which others are remembered.
    #[must_use]
    pub fn occupancy(&self) -> Occupancy {
        Occupancy {
            peers: self.peers.len(),
            messages: self.heard.len(),
            sources: self.gate.len(),
        }
    }
}
