//! Links as the endpoint sees them: numbered, with the octets that they want, and with somebody at
//! the other end.

use std::collections::BTreeSet;
use std::fmt;
use std::net::SocketAddr;

use bytes::Bytes;

use crate::wire::{Framing, Priority};

/// A link of the node, numbered by its owner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LinkId(pub u16);

/// What the endpoint needs to know about a link.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LinkProfile {
    /// How its octets are framed.
    pub framing: Framing,
    /// The addresses that it sends from, as peers see them. A message from one of our ids that
    /// comes from elsewhere is an id conflict and not an echo of our own multicast; without
    /// addresses only the content tells.
    pub own: BTreeSet<SocketAddr>,
    /// The most datagrams that it takes in one [`Transmit`]; 0 and 1 mean one.
    pub max_segments: usize,
    /// Whether the other end reads only the first message of a datagram.
    pub reads_one: bool,
}

impl LinkProfile {
    /// A link that carries JUDP datagrams, one at a time, from these addresses.
    #[must_use]
    pub fn judp(own: impl IntoIterator<Item = SocketAddr>) -> Self {
        Self {
            framing: Framing::Judp,
            own: own.into_iter().collect(),
            max_segments: 1,
            reads_one: false,
        }
    }

    /// Whether several messages may share a datagram.
    pub(super) const fn packs(&self) -> bool {
        matches!(self.framing, Framing::Judp) && !self.reads_one
    }
}

/// The other end, as a link names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Remote {
    /// An address: of a UDP socket, or of the far side of one TCP connection.
    Socket(SocketAddr),
    /// Whoever is at the other end of a serial line.
    Line,
}

impl Remote {
    /// The address, if it has one.
    #[must_use]
    pub const fn socket(self) -> Option<SocketAddr> {
        match self {
            Self::Socket(address) => Some(address),
            Self::Line => None,
        }
    }
}

impl From<SocketAddr> for Remote {
    fn from(address: SocketAddr) -> Self {
        Self::Socket(address)
    }
}

impl PartialEq<SocketAddr> for Remote {
    fn eq(&self, address: &SocketAddr) -> bool {
        self.socket() == Some(*address)
    }
}

impl fmt::Display for Remote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Socket(address) => address.fmt(f),
            Self::Line => f.pad("the line"),
        }
    }
}

/// Where a message came from, and where answers go: the other end as seen through a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Path {
    /// The link.
    pub link: LinkId,
    /// The other end.
    pub peer: Remote,
}

impl Path {
    /// Whether both lead to the same host, as far as the network tells.
    pub(super) fn is_near(self, other: Self) -> bool {
        match (self.peer.socket(), other.peer.socket()) {
            (Some(one), Some(two)) => one.ip().to_canonical() == two.ip().to_canonical(),
            (None, None) => self.link == other.link,
            _ => false,
        }
    }
}

/// Whereto on a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum To {
    /// One other end.
    Peer(Remote),
    /// The link's multicast group or what it has instead, such as all its connections.
    Group,
}

/// What the owner is to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transmit {
    /// Through this link.
    pub link: LinkId,
    /// Whereto.
    pub to: To,
    /// How urgent it is, should the link be slower than the endpoint.
    pub priority: Priority,
    /// The octets, framed as the link wants them.
    pub payload: Bytes,
    /// If set, the payload is several datagrams of so many octets each, of which the last may be
    /// shorter. Only on links that take more than one; see [`LinkProfile::max_segments`].
    pub segment: Option<usize>,
}
