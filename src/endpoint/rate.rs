//! Rate limits per source, by network address and by id.
//!
//! By default only the rate of new ids is limited: a flood of invented senders needs many new ids,
//! and no real peer does. The message rate is limited only if configured. The bucket tables are
//! bounded: sources without a place in a full table share a single bucket, so inventing addresses
//! gains nothing.

use std::net::IpAddr;
use std::time::Instant;

pub use jaus_limits::{Bucket, Buckets, Rate, quota_address};

use super::{Counter, LinkId, Path, Remote, SessionId};
use crate::address::JausId;

/// Limits of what is accepted from others.
///
/// ```toml
/// [limits]
/// max_peers = 1024
/// new_ids_per_address = { per_second = 64, burst = 1024 }
/// messages_per_address = { per_second = 20000, burst = 40000 }
/// messages_per_id = { per_second = 5000, burst = 10000 }
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct Limits {
    /// The most peers whose address is remembered, 1 to 65536. At the limit, a new peer evicts a
    /// peer of the network address that holds most of them, else a peer that we have not spoken to,
    /// else the peer heard longest ago. Messages to an evicted peer go to the group until it is
    /// heard again. Addresses of static peers do not count and are never evicted.
    pub max_peers: usize,
    /// New ids from one network address. The default is a burst of 1024 and 64 per second: all
    /// components of four full nodes, or of a router's whole network.
    pub new_ids_per_address: Rate,
    /// Messages from one network address; unlimited if omitted.
    pub messages_per_address: Option<Rate>,
    /// Messages from one id; unlimited if omitted.
    pub messages_per_id: Option<Rate>,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_peers: 1024,
            new_ids_per_address: Rate::new(64, 1024),
            messages_per_address: None,
            messages_per_id: None,
        }
    }
}

/// The origin of traffic as far as the network shows: the unit that shares one quota.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Origin {
    Address(IpAddr),
    Line(LinkId),
    Session(LinkId, SessionId),
}

impl From<Path> for Origin {
    fn from(path: Path) -> Self {
        match path.peer {
            Remote::Socket(address) => Self::Address(quota_address(address.ip())),
            Remote::Line => Self::Line(path.link),
            Remote::Session(session) => Self::Session(path.link, session),
        }
    }
}

/// The rate limits of an endpoint.
#[derive(Debug)]
pub(super) struct Gate {
    pub(super) new_ids: Buckets<Origin>,
    messages_by_address: Buckets<Origin>,
    messages_by_id: Buckets<JausId>,
}

impl Gate {
    /// Creates buckets for at most as many sources in each table as there may be peers.
    pub(super) fn new(limits: &Limits) -> Self {
        let most = limits.max_peers;
        Self {
            new_ids: Buckets::new(limits.new_ids_per_address, most),
            messages_by_address: Buckets::new(limits.messages_per_address, most),
            messages_by_id: Buckets::new(limits.messages_per_id, most),
        }
    }

    /// Applies the limits to a message; `is_new` says whether its sender is unknown.
    pub(super) fn admit(
        &mut self,
        now: Instant,
        from: Path,
        source: JausId,
        is_new: bool,
    ) -> Result<(), Counter> {
        let origin = Origin::from(from);
        if !self.messages_by_address.take(now, origin) || !self.messages_by_id.take(now, source) {
            return Err(Counter::MessageRate);
        }
        if is_new && !self.new_ids.take(now, origin) {
            return Err(Counter::NewIdRate);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn start() -> Instant {
        Instant::now()
    }

    #[test]
    fn each_limit_counts_on_its_own() {
        let path = Path {
            link: LinkId(0),
            peer: Remote::Line,
        };
        let (all, new) = (Err(Counter::MessageRate), Err(Counter::NewIdRate));
        let two = Rate::new(1, 2);
        let rates = |new_ids_per_address, messages_per_address, messages_per_id| Limits {
            new_ids_per_address,
            messages_per_address,
            messages_per_id,
            ..Limits::default()
        };
        for (limits, expected) in [
            (rates(two, None, None), [Ok(()), Ok(()), Ok(()), new]),
            (
                rates(Rate::new(1, 9), Some(two), None),
                [Ok(()), Ok(()), all, all],
            ),
            (
                rates(Rate::new(1, 9), None, Some(two)),
                [Ok(()), Ok(()), all, Ok(())],
            ),
        ] {
            let (mut gate, now) = (Gate::new(&limits), start());
            let said = [(1, true), (1, true), (1, false), (2, true)];
            let admitted = said.map(|(component, is_new)| {
                let source = JausId::new(42, 1, component);
                gate.admit(now, path, source, is_new)
            });
            assert_eq!(admitted, expected);
        }
    }
}
