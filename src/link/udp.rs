//! The UDP link of one network interface: a unicast socket and a multicast group socket.
//!
//! See the [module above](super) for why there are two. Errors of a single datagram (an ICMP
//! answer, a full network queue, a route that is missing just now) are counted and traced and
//! never end the link.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::path::PathBuf;
use std::task::{Context, Poll, ready};

use bytes::Bytes;
use socket2::{Domain, InterfaceIndexOrAddress, Protocol, SockRef, Socket, Type};
use tokio::net::UdpSocket;

use super::backlog::{Backlog, Bounds};
use super::group::{Group, STANDARD_PORT};
use super::socket_table::{self, Entry};
use super::{Error, Holder, Interface, Slab};
use crate::wire::Priority;

/// What to do when another socket has the unicast address and port.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum PortTaken {
    /// Fail with [`Error::PortTaken`].
    #[default]
    Refuse,
    /// Take any free port instead, and say so in the log. Peers learn it from our messages;
    /// only peers with this node's port in their own configuration cannot reach it.
    UseFree,
}

/// How the sockets of a link are set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The unicast port; 0 takes any free one.
    pub port: u16,
    /// What to do if `port` is taken.
    pub port_taken: PortTaken,
    /// The multicast group and its port.
    pub group: Group,
    /// How many routers a multicast datagram may pass, 0 to 255; 0 keeps it on this host.
    pub ttl: u8,
    /// How many octets of received datagrams the kernel is asked to hold for each socket.
    pub receive_buffer: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            port: STANDARD_PORT,
            port_taken: PortTaken::Refuse,
            group: Group::default(),
            ttl: 16,
            receive_buffer: 4 << 20,
        }
    }
}

/// What a link has done since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// Datagrams received, without our own.
    pub received: u64,
    /// Octets in them.
    pub received_octets: u64,
    /// Our own multicast datagrams, heard again and ignored.
    pub own_echo: u64,
    /// Datagrams sent, each copy to a peer counted.
    pub sent: u64,
    /// Octets in them.
    pub sent_octets: u64,
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

/// The sockets of one interface. Must be opened within a tokio runtime.
#[derive(Debug)]
pub struct UdpLink {
    interface: Interface,
    local: SocketAddr,
    unicast: UdpSocket,
    group: Option<GroupSocket>,
    peers: Vec<SocketAddr>,
    outbox: Backlog<(SocketAddr, Bytes)>,
    group_first: bool,
    last_error: Option<io::ErrorKind>,
    counters: Counters,
}

#[derive(Debug)]
struct GroupSocket {
    address: SocketAddr,
    socket: UdpSocket,
}

impl UdpLink {
    /// Opens the link of `interface`. An interface without multicast gets a link without group.
    ///
    /// # Errors
    /// [`Error::PortTaken`], [`Error::GroupTaken`], [`Error::InvalidGroup`],
    /// [`Error::Permission`], [`Error::AddressGone`] or [`Error::Io`].
    pub fn open(interface: &Interface, settings: &Settings) -> Result<Self, Error> {
        settings.group.validate()?;
        let unicast = open_unicast(interface, settings)?;
        let group = match settings.group {
            Group::At(group) if interface.multicast => {
                Some(open_group(interface, group, settings)?)
            }
            _ => None,
        };
        let local = unicast
            .local_addr()
            .map_err(io_error("reading the local address"))?;
        tracing::info!(%interface, %local, multicast = group.is_some(), "link opened");
        Ok(Self {
            interface: interface.clone(),
            local,
            unicast,
            group,
            peers: Vec::new(),
            outbox: Backlog::new(OUTBOX),
            group_first: false,
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

    /// The multicast group that it has joined.
    #[must_use]
    pub fn group(&self) -> Option<SocketAddr> {
        self.group.as_ref().map(|g| g.address)
    }

    /// What it has done so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// How many datagrams the kernel dropped because this process did not read them in time, if
    /// it tells (Linux does). Reads a table of all sockets: nothing to ask every second.
    #[must_use]
    pub fn kernel_drops(&self) -> Option<u64> {
        let group = self.group.as_ref().map(|group| &group.socket);
        let sockets = [Some(&self.unicast), group].into_iter().flatten();
        let files: Vec<PathBuf> = sockets.filter_map(file).collect();
        let ours = |entry: &Entry| files.contains(&socket_table::file_of(entry.inode).into());
        let table = socket_table::all();
        let drops: Vec<u64> = table.iter().filter(|e| ours(e)).map(|e| e.drops).collect();
        (!drops.is_empty()).then(|| drops.iter().sum())
    }

    /// Names the peers that get a unicast copy of everything sent to the group, for networks that
    /// do not carry multicast.
    pub fn set_peers(&mut self, peers: Vec<SocketAddr>) {
        self.peers = peers;
    }

    /// Sends a datagram to one peer. If the network takes nothing just now, the urgent go first
    /// when it does again.
    pub fn send_to(&mut self, peer: SocketAddr, priority: Priority, datagram: &Bytes) {
        // Straight to the socket: the runtime learns that a new socket can send only later.
        let straight = |socket: &UdpSocket| SockRef::from(socket).send_to(datagram, &peer.into());
        if !self.outbox.is_empty() || !self.try_send(peer, straight) {
            let waiting = (peer, datagram.clone());
            self.counters.send_overflows += self.outbox.push(priority, datagram.len(), waiting);
        }
    }

    /// Sends a datagram to the group, and a copy to each peer of [`set_peers`](Self::set_peers).
    pub fn send_to_group(&mut self, priority: Priority, datagram: &Bytes) {
        if let Some(group) = self.group() {
            self.send_to(group, priority, datagram);
        }
        for i in 0..self.peers.len() {
            self.send_to(self.peers[i], priority, datagram);
        }
    }

    /// Sends what waits for the network; ready when nothing waits.
    pub fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        while let Some((peer, datagram)) = self.outbox.first().cloned() {
            if self.try_send(peer, |socket| socket.try_send_to(&datagram, peer)) {
                self.outbox.pop();
            } else if ready!(self.unicast.poll_send_ready(cx)).is_err() {
                // The runtime is shutting down.
                return Poll::Ready(());
            }
        }
        Poll::Ready(())
    }

    /// The next datagram and who sent it. Our own multicast is left out.
    pub fn poll_recv(
        &mut self,
        cx: &mut Context<'_>,
        slab: &mut Slab,
    ) -> Poll<(SocketAddr, Bytes)> {
        // Turn about, so that a flood on one socket does not silence the other.
        self.group_first = !self.group_first;
        for from_group in [self.group_first, !self.group_first] {
            if let Poll::Ready(datagram) = self.poll_recv_from(from_group, cx, slab) {
                return Poll::Ready(datagram);
            }
        }
        Poll::Pending
    }

    fn poll_recv_from(
        &mut self,
        from_group: bool,
        cx: &mut Context<'_>,
        slab: &mut Slab,
    ) -> Poll<(SocketAddr, Bytes)> {
        loop {
            let socket = match (&self.group, from_group) {
                (Some(group), true) => &group.socket,
                (None, true) => return Poll::Pending,
                (_, false) => &self.unicast,
            };
            match slab.receive(|free| socket.try_recv_buf_from(free)) {
                Ok(((_, peer), _)) if peer == self.local => self.counters.own_echo += 1,
                Ok(((_, peer), datagram)) => {
                    self.counters.received += 1;
                    self.counters.received_octets += datagram.len() as u64;
                    return Poll::Ready((peer, datagram));
                }
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    if ready!(socket.poll_recv_ready(cx)).is_err() {
                        return Poll::Pending;
                    }
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => {
                    self.counters.receive_errors += 1;
                    self.report("receiving", None, &e);
                    // Again soon, but not at the cost of everybody else.
                    cx.waker().wake_by_ref();
                    return Poll::Pending;
                }
            }
        }
    }

    /// Whether the datagram is dealt with: sent, or refused for good. `false` is "not now".
    fn try_send(
        &mut self,
        peer: SocketAddr,
        send: impl Fn(&UdpSocket) -> io::Result<usize>,
    ) -> bool {
        loop {
            match send(&self.unicast) {
                Ok(octets) => {
                    self.counters.sent += 1;
                    self.counters.sent_octets += octets as u64;
                    return true;
                }
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => return false,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => {
                    self.counters.send_errors += 1;
                    self.report("sending", Some(peer), &e);
                    return true;
                }
            }
        }
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

/// The socket that sends everything, bound to one address for itself alone.
fn open_unicast(interface: &Interface, settings: &Settings) -> Result<UdpSocket, Error> {
    let socket = new_socket()?;
    let wanted = SocketAddrV4::new(interface.address, settings.port);
    if let Err(e) = socket.bind(&wanted.into()) {
        let taken = e.kind() == io::ErrorKind::AddrInUse;
        if !taken || settings.port_taken == PortTaken::Refuse {
            return Err(bind_error(wanted, e));
        }
        let free = SocketAddrV4::new(interface.address, 0);
        socket.bind(&free.into()).map_err(|e| bind_error(free, e))?;
        tracing::warn!(%wanted, "port taken, using a free one instead");
    }
    let doing = || format!("setting up multicast on {interface}");
    let set_up = || {
        socket.set_multicast_if_v4(&interface.address)?;
        socket.set_multicast_ttl_v4(settings.ttl.into())?;
        socket.set_multicast_loop_v4(true)
    };
    if interface.multicast {
        set_up().map_err(|source| Error::Io {
            doing: doing(),
            source,
        })?;
    }
    finish(socket, settings.receive_buffer)
}

/// The socket that hears the group on this interface, shared with other nodes of the host.
fn open_group(
    interface: &Interface,
    group: SocketAddrV4,
    settings: &Settings,
) -> Result<GroupSocket, Error> {
    let socket = new_socket()?;
    socket
        .set_reuse_address(true)
        .map_err(io_error("sharing the multicast port"))?;
    // Bound to the group itself, the socket leaves unicast to this port to the unicast socket.
    let local = if cfg!(windows) {
        Ipv4Addr::UNSPECIFIED
    } else {
        *group.ip()
    };
    socket
        .bind(&SocketAddrV4::new(local, group.port()).into())
        .map_err(|e| match e.kind() {
            io::ErrorKind::AddrInUse => Error::GroupTaken {
                group: group.into(),
                holder: Holder::of(group.into()),
            },
            _ => bind_error(group, e),
        })?;
    // Otherwise Linux also delivers what other sockets of this host joined on other interfaces.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    socket
        .set_multicast_all_v4(false)
        .map_err(io_error("keeping other groups out"))?;
    let on = InterfaceIndexOrAddress::Index(interface.index);
    socket
        .join_multicast_v4_n(group.ip(), &on)
        .map_err(|source| Error::Io {
            doing: format!("joining the multicast group {} on {interface}", group.ip()),
            source,
        })?;
    let socket = finish(socket, settings.receive_buffer)?;
    Ok(GroupSocket {
        address: group.into(),
        socket,
    })
}

/// What the socket's file descriptor links to: its number in the kernel.
#[cfg(unix)]
fn file(socket: &UdpSocket) -> Option<PathBuf> {
    use std::os::fd::AsRawFd;
    std::fs::read_link(format!("/proc/self/fd/{}", socket.as_raw_fd())).ok()
}

#[cfg(not(unix))]
fn file(_: &UdpSocket) -> Option<PathBuf> {
    None
}

fn new_socket() -> Result<Socket, Error> {
    Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP)).map_err(|e| match e.kind() {
        io::ErrorKind::PermissionDenied => Error::Permission {
            doing: "opening a UDP socket".into(),
            port: 0,
            source: e,
        },
        _ => io_error("opening a UDP socket")(e),
    })
}

fn finish(socket: Socket, receive_buffer: usize) -> Result<UdpSocket, Error> {
    // Linux answers with twice the size in force: the other half is its own bookkeeping.
    let granted = socket
        .set_recv_buffer_size(receive_buffer)
        .and_then(|()| socket.recv_buffer_size())
        .map_err(io_error("setting the receive buffer size"))?;
    if granted < receive_buffer {
        tracing::info!(
            wanted = receive_buffer,
            granted,
            "the kernel limits the receive buffer; raise net.core.rmem_max against losses in bursts"
        );
    } else {
        tracing::debug!(granted, "receive buffer");
    }
    socket
        .set_nonblocking(true)
        .and_then(|()| UdpSocket::from_std(socket.into()))
        .map_err(io_error("handing the socket to the runtime"))
}

fn bind_error(address: SocketAddrV4, source: io::Error) -> Error {
    match source.kind() {
        io::ErrorKind::AddrInUse => Error::PortTaken {
            address: address.into(),
            holder: Holder::of(address.into()),
        },
        io::ErrorKind::PermissionDenied => Error::Permission {
            doing: format!("binding to UDP {address}"),
            port: address.port(),
            source,
        },
        io::ErrorKind::AddrNotAvailable => Error::AddressGone(*address.ip()),
        _ => Error::Io {
            doing: format!("binding to UDP {address}"),
            source,
        },
    }
}

fn io_error(doing: &'static str) -> impl Fn(io::Error) -> Error {
    move |source| Error::Io {
        doing: doing.into(),
        source,
    }
}
