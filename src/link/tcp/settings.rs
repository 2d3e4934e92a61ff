//! The settings of a TCP link, and its limits.

use std::net::SocketAddr;
use std::time::Duration;

use crate::endpoint::Access;
use crate::link::backlog::Bounds;

/// The settings of a [`TcpLink`](super::TcpLink).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The address to accept connections at; none by default.
    pub listen: Option<SocketAddr>,
    /// The peers to connect to, and to reconnect to after a loss.
    pub connect: Vec<SocketAddr>,
    /// Limit of accepted connections. When it is reached, a new connection displaces one that has
    /// sent nothing valid for [`HANDSHAKE`], or else the longest idle connection of the network
    /// address with the most connections, if that is not the newcomer's own.
    pub max_accepted: usize,
    /// Limit of accepted connections from one IPv4 address, or from the 64-bit network of an IPv6
    /// address.
    pub max_per_address: usize,
    /// Which network addresses may connect. Connections from others are closed at once.
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

/// How long a connection may send nothing valid before it can be displaced.
pub const HANDSHAKE: Duration = Duration::from_secs(5);

/// The timeout of an attempt to connect.
pub const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);

/// The pause after the first failed attempt. It doubles with each further one, up to
/// [`LONGEST_PAUSE`]. A random ± 25 % prevents many nodes from reconnecting to a restarted one at
/// the same time.
pub const FIRST_PAUSE: Duration = Duration::from_millis(250);

/// The longest pause between attempts to connect, without the random part.
pub const LONGEST_PAUSE: Duration = Duration::from_secs(15);

/// How long a peer may take nothing, while messages for it are dropped, before its connection is
/// closed.
pub const STUCK: Duration = Duration::from_secs(10);

/// Limit of the octets that wait for all connections together. Beyond it the connection with the
/// largest backlog drops its oldest messages of the lowest priority.
pub(super) const MAX_WAITING: usize = 16 << 20;

/// Limits of the backlog of one connection. Beyond them the oldest message of the lowest priority
/// is dropped.
pub(super) const BACKLOG: Bounds = Bounds {
    items: 4096,
    octets: 4 << 20,
};
