//! How a TCP link is set up, and its bounds.

use std::net::SocketAddr;
use std::time::Duration;

use crate::endpoint::Access;
use crate::link::backlog::Bounds;

/// How a [`TcpLink`](super::TcpLink) is set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Where others may connect to; nowhere by default.
    pub listen: Option<SocketAddr>,
    /// Whom to connect to, again and again when a connection is lost.
    pub connect: Vec<SocketAddr>,
    /// The most connections that others may open. With so many, one that has not said anything
    /// valid for [`HANDSHAKE`] gives way to a new one, or else the longest idle connection of the
    /// network address that holds the most, if that is not the newcomer's own.
    pub max_accepted: usize,
    /// The most connections that may be opened from one IPv4 address, or from the 64-bit network of
    /// an IPv6 address.
    pub max_per_address: usize,
    /// Whose connections are accepted; those of other network addresses are closed at once.
    pub access: Access,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            listen: None,
            connect: Vec::new(),
            max_accepted: 64,
            max_per_address: 32,
            access: Access::default(),
        }
    }
}

/// How long a connection may say nothing valid before it can lose its place.
pub const HANDSHAKE: Duration = Duration::from_secs(5);

/// How long an attempt to connect may take.
pub const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);

/// The pause after the first attempt that failed. It doubles with each further one, up to
/// [`LONGEST_PAUSE`]; a quarter more or less is left to chance, so that many nodes do not come back
/// to a restarted one at the same time.
pub const FIRST_PAUSE: Duration = Duration::from_millis(250);

/// The longest pause between two attempts to connect, but for the quarter that chance may add.
pub const LONGEST_PAUSE: Duration = Duration::from_secs(15);

/// How long a peer may take nothing while messages for it are lost, before its connection is closed.
pub const STUCK: Duration = Duration::from_secs(10);

/// The most octets that may wait for all connections together. Then the one for which the most waits
/// loses the oldest of its least urgent messages.
pub(super) const MAX_WAITING: usize = 16 << 20;

/// How much may wait for one connection. Then the oldest of the least urgent goes.
pub(super) const BACKLOG: Bounds = Bounds {
    items: 4096,
    octets: 4 << 20,
};
