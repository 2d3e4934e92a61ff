//! Fill levels of the tables in which an endpoint remembers peers and messages, for monitoring and
//! tests.

use super::Endpoint;

/// Entries of the tables that peers can fill. Each has a bound in [`Config`](super::Config).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Occupancy {
    /// Peers, up to [`max_peers`](super::Config::max_peers).
    pub peers: usize,
    /// Messages remembered for duplicate detection, up to 2½ times
    /// [`max_recent`](super::Config::max_recent).
    pub messages: usize,
    /// Sources with a rate limit bucket, up to [`max_peers`](super::Config::max_peers) for each
    /// kind of [`Rates`](super::Rates).
    pub sources: usize,
}

impl Endpoint {
    /// The fill levels of the tables that peers can fill.
    #[must_use]
    pub fn occupancy(&self) -> Occupancy {
        Occupancy {
            peers: self.peers.len(),
            messages: self.heard.len(),
            sources: self.gate.len(),
        }
    }
}
