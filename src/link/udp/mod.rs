//! The UDP link of one network interface: a unicast socket, and one for each address by which
//! everyone is reached: the multicast group, the network's broadcast address, or both.
//!
//! See the [module above](super) for why there are several. Errors of a single datagram (an ICMP
//! answer, a full network queue, a route that is missing just now) are counted and traced and
//! never end the link.

#[cfg(target_os = "linux")]
mod batch;
mod gso_batch;
mod open;
mod receive;
mod send;
mod settings;
mod socket;

use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;

use bytes::Bytes;

use gso_batch::GsoBatch;
use socket::Socket;

pub use settings::{Broadcasts, PortTaken, Settings};

use super::backlog::{Backlog, Bounds};
use super::socket_table;
use super::{Error, Interface};

/// What a link has done since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// Datagrams received, without our own.
    pub received: u64,
    /// Octets in them.
    pub received_octets: u64,
    /// Our own datagrams for everyone, heard again and ignored.
    pub own_echo: u64,
    /// Datagrams sent, each copy to a peer counted.
    pub sent: u64,
    /// Octets in them.
    pub sent_octets: u64,
    /// Calls into the operating system for all that.
    pub send_calls: u64,
    /// Errors while receiving, such as ICMP answers to what we sent.
    pub receive_errors: u64,
    /// Datagrams that the operating system refused to send.
    pub send_errors: u64,
    /// Datagrams dropped because the network was slower than this node for too long.
    pub send_overflows: u64,
}

/// What waits in a link while the kernel's send buffer is full.
const OUTBOX: Bounds = Bounds {
    items: 2048,
    octets: 4 << 20,
};

const CAN_BATCH: bool = cfg!(target_os = "linux");

/// The most datagrams to one peer that Linux takes as one batch.
const MAX_SEGMENTS: usize = 64;

/// The sockets of one interface. Must be opened within a tokio runtime.
#[derive(Debug)]
pub struct UdpLink {
    interface: Interface,
    local: SocketAddr,
    /// The unicast socket, which is always there and sends everything, and then those of `groups`,
    /// which only hear.
    sockets: Vec<Socket>,
    groups: Vec<SocketAddr>,
    /// Of the sockets, where the kernel numbers them.
    inodes: Vec<u64>,
    peers: Vec<SocketAddr>,
    outbox: Backlog<GsoBatch>,
    /// On its way into the kernel; nothing overtakes it.
    leaving: VecDeque<GsoBatch>,
    /// Whether the kernel has no room for the next of `leaving`.
    full: bool,
    /// Several datagrams to one peer leave with one call if each has no more octets than this.
    gso_limit: usize,
    /// Whether several datagrams are sent and fetched with one call.
    batch: bool,
    /// Fetched already; all from one call.
    arrived: VecDeque<(SocketAddr, Bytes)>,
    /// The socket that is read first the next time.
    turn: usize,
    /// The socket that the latest came from.
    fetched_from: usize,
    last_error: Option<io::ErrorKind>,
    counters: Counters,
}

impl UdpLink {
    /// Opens the link of `interface`. An interface without multicast and broadcast gets a link for
    /// unicast alone.
    ///
    /// # Errors
    /// [`Error::PortTaken`], [`Error::GroupTaken`], [`Error::InvalidGroup`],
    /// [`Error::Permission`], [`Error::AddressGone`] or [`Error::Io`].
    pub fn open(interface: &Interface, settings: &Settings) -> Result<Self, Error> {
        settings.validate()?;
        let unicast = open::unicast(interface, settings)?;
        let local = unicast
            .get()
            .local_addr()
            .map_err(Error::io("reading the local address"))?;
        let groups = settings.addresses_of_all(interface);
        let mut sockets = vec![unicast];
        for &group in &groups {
            sockets.push(open::group(interface, group, settings)?);
        }
        let batch = CAN_BATCH && settings.batch;
        #[cfg(target_os = "linux")]
        if batch {
            sockets
                .iter()
                .for_each(|socket| batch::prepare(socket.get()));
        }
        tracing::info!(%interface, %local, ?groups, "link opened");
        let inodes = sockets
            .iter()
            .filter_map(|s| socket_table::inode_of(s.get()));
        Ok(Self {
            inodes: inodes.collect(),
            interface: interface.clone(),
            local,
            sockets,
            groups,
            peers: Vec::new(),
            outbox: Backlog::new(OUTBOX),
            leaving: VecDeque::new(),
            full: false,
            gso_limit: if batch { usize::MAX } else { 0 },
            batch,
            arrived: VecDeque::new(),
            turn: 0,
            fetched_from: 0,
            last_error: None,
            counters: Counters::default(),
        })
    }

    /// The address that this link sends from, and that peers answer to.
    #[must_use]
    pub const fn local(&self) -> SocketAddr {
        self.local
    }

    /// The interface that it was opened on.
    #[must_use]
    pub const fn interface(&self) -> &Interface {
        &self.interface
    }

    /// The multicast group that it has joined, or the broadcast address that it uses instead.
    #[must_use]
    pub fn group(&self) -> Option<SocketAddr> {
        self.groups.first().copied()
    }

    /// What it has done so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// How many datagrams to one peer are best given to [`transmit`](Self::transmit) at once.
    #[must_use]
    pub const fn max_segments(&self) -> usize {
        if self.batch { MAX_SEGMENTS } else { 1 }
    }

    /// The kernel's numbers of its sockets, for [`kernel_drops`]; none where it has no such numbers.
    #[must_use]
    pub fn inodes(&self) -> &[u64] {
        &self.inodes
    }

    /// Names the peers that get a unicast copy of everything sent to the group, for networks that
    /// do not carry multicast.
    pub fn set_peers(&mut self, peers: Vec<SocketAddr>) {
        self.peers = peers;
    }

    /// Warns when the kind of error is a new one, so that a broken network cannot fill a log.
    fn report(&mut self, doing: &str, peer: Option<SocketAddr>, error: &io::Error) {
        let interface = &self.interface.name;
        if self.last_error.replace(error.kind()) == Some(error.kind()) {
            tracing::debug!(interface, doing, ?peer, %error, "datagram lost");
        } else {
            tracing::warn!(interface, doing, ?peer, %error, "datagram lost");
        }
    }
}

/// How many datagrams for each of several links, named by their [`inodes`](UdpLink::inodes), the
/// kernel dropped because the process did not read them in time, if it says so (Linux does). Reads
/// a table of all sockets of the host.
#[must_use]
pub fn kernel_drops<'a>(links: impl IntoIterator<Item = &'a [u64]>) -> Vec<Option<u64>> {
    let table = socket_table::all();
    let drops = |inodes: &[u64]| {
        let ours = table.iter().filter(|entry| inodes.contains(&entry.inode));
        let drops: Vec<u64> = ours.map(|entry| entry.drops).collect();
        (!drops.is_empty()).then(|| drops.iter().sum())
    };
    links.into_iter().map(drops).collect()
}
