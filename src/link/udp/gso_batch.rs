//! A batch of datagrams to one peer, which one system call sends and the kernel splits (GSO).

use std::net::SocketAddr;

use bytes::Bytes;

use super::MAX_SEGMENTS;
use crate::endpoint::MOST_OCTETS;

/// Datagrams to one peer of `segment` octets each; the last may be shorter.
#[derive(Clone, Debug)]
pub(super) struct GsoBatch {
    pub(super) peer: SocketAddr,
    pub(super) octets: Bytes,
    pub(super) segment: usize,
}

impl GsoBatch {
    /// The datagrams to send with the next call, if those of up to `limit` octets may share one.
    pub(super) fn part(&self, limit: usize) -> &[u8] {
        let datagrams = if self.segment <= limit {
            (MOST_OCTETS / self.segment).clamp(1, MAX_SEGMENTS)
        } else {
            1
        };
        let octets = self.octets.len().min(datagrams * self.segment);
        &self.octets[..octets]
    }
}
