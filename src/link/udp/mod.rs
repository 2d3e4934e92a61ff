//! The UDP link of one network interface: a unicast socket, plus a receiving socket for the
//! multicast group, the network's broadcast address, or both.
//!
//! See the [parent module](super) for why these are separate sockets. Errors of a single datagram
//! (an ICMP error, a full network queue, a temporarily missing route) are counted and traced. They
//! never close the link.

#[cfg(target_os = "linux")]
mod batch;
mod open;
mod receive;
mod send;
mod settings;

use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;

use bytes::Bytes;

use send::GsoBatch;

pub use settings::{Broadcasts, PortTaken, Settings};

use super::backlog::{Backlog, Bounds};
use super::socket::Socket;
use super::socket_table;
use super::{Error, Interface};

/// Counts of a UDP link since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// Datagrams received, without echoes of our own.
    pub received: u64,
    /// Octets of those datagrams.
    pub received_octets: u64,
    /// Our own multicast and broadcast datagrams, received back and ignored.
    pub own_echo: u64,
    /// Datagrams sent; each copy to a peer counts.
    pub sent: u64,
    /// Octets of those datagrams.
    pub sent_octets: u64,
    /// System calls made to send, including failed ones.
    pub send_calls: u64,
    /// Receive errors, such as ICMP errors caused by our datagrams.
    pub receive_errors: u64,
    /// Datagrams that the operating system rejected.
    pub send_errors: u64,
    /// Queue entries (a datagram, or a batch of them) dropped because the network was too slow.
    pub send_overflows: u64,
}

/// Limits of the queue in front of the kernel's send buffer.
const OUTBOX: Bounds = Bounds {
    items: 2048,
    octets: 4 << 20,
};

const CAN_BATCH: bool = cfg!(target_os = "linux");

/// Linux's limit of datagrams in one GSO batch.
const MAX_SEGMENTS: usize = 64;

/// The sockets of one interface. Must be opened within a tokio runtime.
#[derive(Debug)]
pub struct UdpLink {
    interface: Interface,
    local: SocketAddr,
    /// First the unicast socket, which sends everything; then the sockets of `groups`, which only
    /// receive.
    sockets: Vec<Socket>,
    groups: Vec<SocketAddr>,
    /// The sockets' inode numbers, where the kernel reports them.
    inodes: Vec<u64>,
    peers: Vec<SocketAddr>,
    outbox: Backlog<GsoBatch>,
    /// The batches being passed to the kernel; nothing overtakes them.
    leaving: VecDeque<GsoBatch>,
    /// Whether the kernel's send buffer is full.
    full: bool,
    /// The longest datagram, in octets, that is sent in a batch; 0 sends each by itself.
    gso_limit: usize,
    /// Whether one system call may send or receive several datagrams.
    batch: bool,
    /// Received datagrams that are not returned yet; all are from one system call.
    arrived: VecDeque<(SocketAddr, Bytes)>,
    /// The socket that the latest fetch tried first.
    turn: usize,
    /// The socket that `arrived` came from.
    fetched_from: usize,
    last_error: Option<io::ErrorKind>,
    counters: Counters,
}

impl UdpLink {
    /// Opens the link on `interface`. Without multicast and broadcast the link is unicast only.
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

    /// The address that this link sends from, and that peers reply to.
    #[must_use]
    pub const fn local(&self) -> SocketAddr {
        self.local
    }

    /// The interface that the link was opened on.
    #[must_use]
    pub const fn interface(&self) -> &Interface {
        &self.interface
    }

    /// The multicast group that the link has joined, or the broadcast address that it uses instead.
    #[must_use]
    pub fn group(&self) -> Option<SocketAddr> {
        self.groups.first().copied()
    }

    /// The counters so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The most datagrams to one peer that [`transmit`](Self::transmit) can send as one batch.
    #[must_use]
    pub const fn max_segments(&self) -> usize {
        if self.batch { MAX_SEGMENTS } else { 1 }
    }

    /// The sockets' inode numbers, for [`kernel_drops`]; empty if the kernel does not report them.
    #[must_use]
    pub fn inodes(&self) -> &[u64] {
        &self.inodes
    }

    /// Sets the peers that get a unicast copy of everything sent to the group, for networks that
    /// do not carry multicast.
    pub fn set_peers(&mut self, peers: Vec<SocketAddr>) {
        self.peers = peers;
    }

    /// Logs an error, as a warning only if its kind differs from the last one's, so that a broken
    /// network cannot fill the log.
    fn report(&mut self, doing: &str, peer: Option<SocketAddr>, error: &io::Error) {
        let interface = &self.interface.name;
        if self.last_error.replace(error.kind()) == Some(error.kind()) {
            tracing::debug!(interface, doing, ?peer, %error, "datagram lost");
        } else {
            tracing::warn!(interface, doing, ?peer, %error, "datagram lost");
        }
    }
}

/// The number of datagrams for each link, given by its [`inodes`](UdpLink::inodes), that the kernel
/// dropped because the process did not read them in time; `None` if the kernel does not report it.
/// Linux does. Reads a table of all UDP sockets of the host.
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
