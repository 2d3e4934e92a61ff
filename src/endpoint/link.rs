//! Links as the endpoint sees them: an id, a framing, and the remote ends.

use std::collections::BTreeSet;
use std::fmt;
use std::net::SocketAddr;

use bytes::Bytes;
use jaus_limits::quota_address;

use crate::rights::Acceptance;
use crate::wire::{Framing, Priority};

/// Identifies a link of the node. The owner assigns the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LinkId(pub u16);

/// What the endpoint needs to know about a link.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LinkProfile {
    /// The framing of its octets.
    pub framing: Framing,
    /// The addresses that it sends from, as peers see them. A message with one of our ids from
    /// another address is an id conflict, not an echo of our own multicast. Without addresses, only
    /// the content shows an echo.
    pub own: BTreeSet<SocketAddr>,
    /// The most datagrams that it takes in one [`Transmit`]; 0 and 1 both mean one.
    pub max_segments: usize,
    /// Whether the remote end reads only the first message of a datagram.
    pub reads_one: bool,
    /// Of a bridge: what the components of its other side may do. Ids that no grant there names and gives
    /// rights ([`Acceptance::trusts`]) give way to components on other links.
    pub bridged: Option<Acceptance>,
}

impl LinkProfile {
    /// A link that carries JUDP datagrams, one at a time, from these addresses.
    #[must_use]
    pub fn judp(own: impl IntoIterator<Item = SocketAddr>) -> Self {
        Self {
            own: own.into_iter().collect(),
            ..Self::default()
        }
    }

    /// Whether several messages may share a datagram.
    pub(super) const fn packs(&self) -> bool {
        matches!(self.framing, Framing::Judp) && !self.reads_one
    }

    /// How many datagrams it takes in one [`Transmit`].
    pub(super) fn segments(&self) -> usize {
        match self.framing {
            Framing::Judp => self.max_segments.max(1),
            Framing::Jtcp | Framing::Jserial => 1,
        }
    }
}

/// Identifies a session of a link whose remote ends authenticate themselves. The link assigns the
/// numbers; a number is not used twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(pub u64);

/// The remote end of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Remote {
    /// The address of a UDP socket, or of the remote end of one TCP connection.
    Socket(SocketAddr),
    /// The remote end of a serial line, or Junior's node manager.
    Line,
    /// An authenticated session, whatever its network address is at present.
    Session(SessionId),
}

impl Remote {
    /// The remote end without what one host chooses at will: the port, and of IPv6 the last 64 bits.
    /// What comes from equal origins shares limits.
    #[must_use]
    pub fn origin(self) -> Self {
        match self {
            Self::Socket(address) => Self::Socket((quota_address(address.ip()), 0).into()),
            other => other,
        }
    }

    /// Whether it is an authenticated session.
    #[must_use]
    pub const fn is_session(self) -> bool {
        matches!(self, Self::Session(_))
    }

    /// The address, if it has one.
    #[must_use]
    pub const fn socket(self) -> Option<SocketAddr> {
        match self {
            Self::Socket(address) => Some(address),
            Self::Line | Self::Session(_) => None,
        }
    }
}

impl From<SocketAddr> for Remote {
    fn from(address: SocketAddr) -> Self {
        Self::Socket(address)
    }
}

impl fmt::Display for Remote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Socket(address) => address.fmt(f),
            Self::Line => f.pad("the line"),
            Self::Session(SessionId(number)) => write!(f, "session {number}"),
        }
    }
}

/// The path of a message: a remote end as seen through a link. Replies take the same path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Path {
    /// The link.
    pub link: LinkId,
    /// The remote end.
    pub peer: Remote,
}

impl Path {
    /// Whether both lead to the same host, as far as the network shows.
    pub(super) fn is_near(self, other: Self) -> bool {
        match (self.peer.socket(), other.peer.socket()) {
            (Some(one), Some(two)) => one.ip().to_canonical() == two.ip().to_canonical(),
            (None, None) => self == other,
            _ => false,
        }
    }
}

/// The destination of a datagram on a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum To {
    /// One remote end.
    Peer(Remote),
    /// The link's multicast group or its equivalent, such as all its connections.
    Group,
}

/// A datagram, or a batch of datagrams, for the owner to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transmit {
    /// The link to send on.
    pub link: LinkId,
    /// The destination on that link.
    pub to: To,
    /// The priority, for links that are slower than the endpoint.
    pub priority: Priority,
    /// The octets, in the link's framing.
    pub payload: Bytes,
    /// If set, the payload is a batch of datagrams of this many octets each; the last may be
    /// shorter. Only on links that take batches; see [`LinkProfile::max_segments`].
    pub segment: Option<usize>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(link: u16, peer: Option<&str>) -> Path {
        let peer = peer.map(|text| Remote::Socket(text.parse().unwrap()));
        Path {
            link: LinkId(link),
            peer: peer.unwrap_or(Remote::Line),
        }
    }

    #[test]
    fn a_host_is_near_itself_by_any_port_a_line_by_its_link_and_a_session_by_its_number() {
        let host = path(0, Some("10.0.0.2:3794"));
        assert!(host.is_near(path(1, Some("10.0.0.2:40000"))));
        assert!(host.is_near(path(0, Some("[::ffff:10.0.0.2]:3794"))));
        assert!(!host.is_near(path(0, Some("10.0.0.3:3794"))));
        assert!(!host.is_near(path(0, None)) && !path(0, None).is_near(host));
        assert!(path(0, None).is_near(path(0, None)) && !path(0, None).is_near(path(1, None)));
        let session = |number| Path {
            link: LinkId(0),
            peer: Remote::Session(SessionId(number)),
        };
        assert!(session(1).is_near(session(1)) && !session(1).is_near(session(2)));
        assert!(!session(1).is_near(path(0, None)) && !session(1).is_near(host));
    }

    #[test]
    fn only_links_of_datagrams_take_several_messages_or_datagrams_at_once() {
        for (framing, reads_one, packs, segments) in [
            (Framing::Judp, false, true, 64),
            (Framing::Judp, true, false, 64),
            (Framing::Jtcp, false, false, 1),
            (Framing::Jserial, false, false, 1),
        ] {
            let link = LinkProfile {
                framing,
                reads_one,
                max_segments: 64,
                ..LinkProfile::default()
            };
            assert_eq!((link.packs(), link.segments()), (packs, segments));
        }
        assert_eq!(LinkProfile::default().segments(), 1, "0 means one");
    }

    #[test]
    fn a_remote_end_is_shown_by_its_address_if_it_has_one() {
        let shown = |peer| path(0, peer).peer.to_string();
        assert_eq!(shown(Some("10.0.0.2:3794")), "10.0.0.2:3794");
        assert_eq!(shown(None), "the line");
        assert_eq!(path(0, None).peer.socket(), None);
        let session = Remote::Session(SessionId(7));
        assert_eq!(
            (session.to_string().as_str(), session.socket()),
            ("session 7", None)
        );
    }
}
