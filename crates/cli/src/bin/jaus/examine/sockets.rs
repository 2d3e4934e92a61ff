//! Sockets of an examination: on each interface one for queries and one per multicast group, a
//! temporary one that detects refusals, and a TCP connection.
#![expect(
    clippy::disallowed_types,
    clippy::disallowed_methods,
    reason = "the examination needs the socket at which a datagram arrives"
)]

use std::collections::BTreeMap;
use std::future::{Future, poll_fn};
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use bytes::{Bytes, BytesMut};
use jaus::link::udp::PortTaken;
use jaus::link::{Group6, Interface};
use jaus::node::Config;
use jaus::wire::{Frame, Kind, judp};
use jaus_cli::failure::Failure;
use socket2::{Domain, InterfaceIndexOrAddress, Protocol, SockRef, Socket, Type};
use tokio::io::ReadBuf;
use tokio::net::{TcpStream, UdpSocket};
use tokio::time::timeout;

use super::case::Send;
use super::seen::{Arrival, Listener, Refusal, TcpAnswer};

/// Multicast group of the Reference Architecture.
pub(crate) const RA_GROUP: SocketAddrV4 =
    SocketAddrV4::new(Ipv4Addr::new(224, 1, 0, 1), judp::PORT);

/// A network event.
pub(super) enum Happening {
    Arrived(Arrival),
    /// The system reports that this address is unreachable.
    Refused(SocketAddr, Refusal),
    Tcp(TcpAnswer),
}

/// Sockets of one interface.
struct Link {
    interface: Interface,
    unicast: UdpSocket,
    local: SocketAddr,
    group: Option<(UdpSocket, SocketAddr)>,
    ra: Option<UdpSocket>,
}

type Dialling = Pin<Box<dyn Future<Output = TcpAnswer>>>;

/// All sockets.
pub(super) struct Sockets {
    links: Vec<Link>,
    /// Why there is no group, if no interface has one.
    pub(super) no_group: Option<String>,
    /// The interface of each host heard so far.
    routes: BTreeMap<IpAddr, usize>,
    /// Connected to the address that it probes.
    probe: Option<(SocketAddr, UdpSocket)>,
    dialling: Option<Dialling>,
    buffer: Vec<u8>,
}

impl Sockets {
    /// Opens all possible sockets on each interface.
    pub(super) fn open(interfaces: Vec<Interface>, config: &Config) -> Result<Self, Failure> {
        let mut no_group = None;
        let mut links = Vec::new();
        for interface in interfaces {
            let (link, why) = Link::open(interface, config)?;
            no_group = no_group.or(why);
            links.push(link);
        }
        let no_group = no_group.filter(|_| links.iter().all(|link| link.group.is_none()));
        Ok(Self {
            links,
            no_group,
            routes: BTreeMap::new(),
            probe: None,
            dialling: None,
            buffer: vec![0; 65_536],
        })
    }

    /// Our source address.
    pub(super) fn local(&self) -> Option<SocketAddr> {
        self.links.first().map(|link| link.local)
    }

    /// The names of the interfaces.
    pub(super) fn names(&self) -> String {
        let names: Vec<&str> = self
            .links
            .iter()
            .map(|l| l.interface.name.as_str())
            .collect();
        names.join(", ")
    }

    /// Executes an action; a refusal by the system is returned as an event.
    pub(super) fn send(&mut self, send: &Send) -> Option<Happening> {
        match send {
            Send::To(address, frame) => {
                let way = self.way_to(*address);
                let link = self.links.get(way)?;
                refusal(*address, send_to(&link.unicast, *address, frame))
            }
            Send::Group(frame) => {
                for link in &self.links {
                    if let Some((_, group)) = &link.group {
                        // Another interface may reach the peer.
                        let _ = send_to(&link.unicast, *group, frame);
                    }
                }
                None
            }
            Send::Probe(address, frame) => self.ask_port(*address, frame),
            Send::Connect(address) => {
                self.dialling = Some(Box::pin(dial(*address)));
                None
            }
        }
    }

    fn way_to(&self, address: SocketAddr) -> usize {
        let known = self.routes.get(&address.ip()).copied();
        let near = || {
            self.links
                .iter()
                .position(|link| link.interface.reaches(address))
        };
        known.or_else(near).unwrap_or(0)
    }

    fn ask_port(&mut self, address: SocketAddr, frame: &Frame) -> Option<Happening> {
        if self.probe.as_ref().is_none_or(|(to, _)| *to != address) {
            let ip = self.links.get(self.way_to(address))?.local.ip();
            match connected(ip, address) {
                Ok(socket) => self.probe = Some((address, socket)),
                Err(error) => return refusal::<()>(address, Err(error)),
            }
        }
        let (_, probe) = self.probe.as_ref()?;
        refusal(address, SockRef::from(probe).send(&encoded(frame)))
    }

    /// Waits for the next event.
    pub(super) async fn next(&mut self) -> Happening {
        poll_fn(|cx| self.poll_next(cx)).await
    }

    fn poll_next(&mut self, cx: &mut Context<'_>) -> Poll<Happening> {
        if let Some(dialling) = &mut self.dialling
            && let Poll::Ready(answer) = dialling.as_mut().poll(cx)
        {
            self.dialling = None;
            return Poll::Ready(Happening::Tcp(answer));
        }
        if let Some((to, probe)) = &self.probe {
            let to = *to;
            // The runtime does not wake a task for an error alone.
            let error = SockRef::from(probe).take_error().ok().flatten();
            if let Some(happening) = error.and_then(|error| refusal::<()>(to, Err(error))) {
                self.probe = None;
                return Poll::Ready(happening);
            }
            match receive(probe, &mut self.buffer, cx) {
                Poll::Ready(Ok((from, datagram))) => {
                    let link = 0;
                    let listener = Listener::Probe;
                    let arrival = Arrival {
                        listener,
                        link,
                        from,
                        datagram,
                    };
                    return Poll::Ready(Happening::Arrived(arrival));
                }
                Poll::Ready(Err(error)) => {
                    if let Some(happening) = refusal::<()>(to, Err(error)) {
                        self.probe = None;
                        return Poll::Ready(happening);
                    }
                }
                Poll::Pending => {}
            }
        }
        self.poll_links(cx)
    }

    fn poll_links(&mut self, cx: &mut Context<'_>) -> Poll<Happening> {
        let own: Vec<SocketAddr> = self.links.iter().map(|link| link.local).collect();
        for (number, link) in self.links.iter().enumerate() {
            let group = link
                .group
                .as_ref()
                .map(|(socket, _)| (Listener::Group, socket));
            let ra = link.ra.as_ref().map(|socket| (Listener::RaGroup, socket));
            let doors = [Some((Listener::Unicast, &link.unicast)), group, ra];
            for (listener, socket) in doors.into_iter().flatten() {
                while let Poll::Ready(received) = receive(socket, &mut self.buffer, cx) {
                    let Ok((from, datagram)) = received else {
                        // An ICMP error caused by an earlier datagram.
                        continue;
                    };
                    if own.contains(&from) {
                        continue;
                    }
                    self.routes.insert(from.ip(), number);
                    let link = number;
                    let arrival = Arrival {
                        listener,
                        link,
                        from,
                        datagram,
                    };
                    return Poll::Ready(Happening::Arrived(arrival));
                }
            }
        }
        Poll::Pending
    }
}

impl Link {
    /// Opens the sockets of one interface; returns why it has no group, if so.
    fn open(interface: Interface, config: &Config) -> Result<(Self, Option<String>), Failure> {
        let refused = |error: io::Error| Failure::new(format!("{interface}: {error}"));
        let unicast = unicast(&interface, config).map_err(refused)?;
        let local = unicast.local_addr().map_err(refused)?;
        let (group, why) = match group_of(&interface, config) {
            None => (
                None,
                Some("it is disabled, or the interface has none".to_owned()),
            ),
            Some(address) => match joined(&interface, address) {
                Ok(socket) => (Some((socket, address)), None),
                Err(error) => (None, Some(format!("{address} cannot be joined: {error}"))),
            },
        };
        let has_ra = interface.address.is_ipv4() && interface.multicast;
        let ra = has_ra
            .then(|| joined(&interface, RA_GROUP.into()).ok())
            .flatten();
        let link = Self {
            interface,
            unicast,
            local,
            group,
            ra,
        };
        Ok((link, why))
    }
}

/// The multicast group on an interface.
fn group_of(interface: &Interface, config: &Config) -> Option<SocketAddr> {
    if !interface.multicast {
        return None;
    }
    if interface.address.is_ipv4() {
        return config.group.address();
    }
    match config.group6 {
        Group6::Off => None,
        Group6::At(mut group) => {
            group.set_scope_id(interface.index);
            Some(group.into())
        }
    }
}

/// The query socket: from the node's port if that is free, otherwise from any port.
fn unicast(interface: &Interface, config: &Config) -> io::Result<UdpSocket> {
    let socket = new(interface.at(0))?;
    let wanted = interface.at(config.port);
    if let Err(error) = socket.bind(&wanted.into()) {
        if config.port_taken == PortTaken::Refuse || error.kind() != io::ErrorKind::AddrInUse {
            return Err(error);
        }
        socket.bind(&interface.at(0).into())?;
    }
    match interface.address {
        IpAddr::V4(own) => {
            socket.set_multicast_if_v4(&own)?;
            socket.set_multicast_ttl_v4(config.ttl.into())?;
            socket.set_multicast_loop_v4(true)?;
        }
        IpAddr::V6(_) => {
            socket.set_multicast_if_v6(interface.index)?;
            socket.set_multicast_hops_v6(config.ttl.into())?;
            socket.set_multicast_loop_v6(true)?;
        }
    }
    // The system may grant less than requested.
    let _ = socket.set_recv_buffer_size(config.receive_buffer);
    UdpSocket::from_std(socket.into())
}

/// A socket that shares a group on one interface with other programs.
fn joined(interface: &Interface, group: SocketAddr) -> io::Result<UdpSocket> {
    let socket = new(group)?;
    socket.set_reuse_address(true)?;
    let local = match group {
        _ if !cfg!(windows) => group,
        SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, group.port()).into(),
        SocketAddr::V6(_) => (std::net::Ipv6Addr::UNSPECIFIED, group.port()).into(),
    };
    socket.bind(&local.into())?;
    match group.ip() {
        IpAddr::V4(ip) => {
            let index = InterfaceIndexOrAddress::Index(interface.index);
            socket.join_multicast_v4_n(&ip, &index)?;
        }
        IpAddr::V6(ip) => socket.join_multicast_v6(&ip, interface.index)?,
    }
    UdpSocket::from_std(socket.into())
}

fn connected(own: IpAddr, to: SocketAddr) -> io::Result<UdpSocket> {
    let socket = new(to)?;
    socket.bind(&SocketAddr::new(own, 0).into())?;
    socket.connect(&to.into())?;
    hear_of_hosts(&socket, to)?;
    UdpSocket::from_std(socket.into())
}

/// Makes the socket report unreachable hosts, which the system otherwise hides.
#[cfg(target_os = "linux")]
fn hear_of_hosts(socket: &Socket, to: SocketAddr) -> io::Result<()> {
    use nix::sys::socket::{setsockopt, sockopt};
    Ok(match to {
        SocketAddr::V4(_) => setsockopt(socket, sockopt::Ipv4RecvErr, &true),
        SocketAddr::V6(_) => setsockopt(socket, sockopt::Ipv6RecvErr, &true),
    }?)
}

#[cfg(not(target_os = "linux"))]
fn hear_of_hosts(_: &Socket, _: SocketAddr) -> io::Result<()> {
    Ok(())
}

fn new(like: SocketAddr) -> io::Result<Socket> {
    let socket = Socket::new(Domain::for_address(like), Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_nonblocking(true)?;
    if like.is_ipv6() {
        socket.set_only_v6(true)?;
    }
    Ok(socket)
}

pub(super) fn encoded(frame: &Frame) -> Bytes {
    // Every message here fits its header.
    let plain = Frame {
        kind: Kind::default(),
        ..frame.clone()
    };
    let datagram = judp::encode(&plain).unwrap_or_default();
    if frame.kind == plain.kind {
        return datagram;
    }
    // A type used only here.
    let mut typed = BytesMut::from(&datagram[..]);
    if let Some(kind) = typed.get_mut(1) {
        *kind = frame.kind.0;
    }
    typed.freeze()
}

/// Sends at once: the runtime does not know a new socket's readiness yet.
fn send_to(socket: &UdpSocket, address: SocketAddr, frame: &Frame) -> io::Result<usize> {
    SockRef::from(socket).send_to(&encoded(frame), &address.into())
}

fn receive(
    socket: &UdpSocket,
    buffer: &mut [u8],
    cx: &mut Context<'_>,
) -> Poll<io::Result<(SocketAddr, Bytes)>> {
    let mut room = ReadBuf::new(buffer);
    socket
        .poll_recv_from(cx, &mut room)
        .map(|received| received.map(|from| (from, Bytes::copy_from_slice(room.filled()))))
}

/// Interprets a system error as a refusal by the peer.
fn refusal<T>(address: SocketAddr, sent: io::Result<T>) -> Option<Happening> {
    let refusal = match sent.err()?.kind() {
        io::ErrorKind::ConnectionRefused => Refusal::Port,
        io::ErrorKind::HostUnreachable
        | io::ErrorKind::NetworkUnreachable
        | io::ErrorKind::AddrNotAvailable => Refusal::Host,
        // For example a full queue: the query is repeated anyway.
        _ => return None,
    };
    Some(Happening::Refused(address, refusal))
}

async fn dial(address: SocketAddr) -> TcpAnswer {
    const PATIENCE: Duration = Duration::from_secs(2);
    match timeout(PATIENCE, TcpStream::connect(address)).await {
        Ok(Ok(_)) => TcpAnswer::Open,
        Ok(Err(error)) if error.kind() == io::ErrorKind::ConnectionRefused => TcpAnswer::Refused,
        Ok(Err(_)) | Err(_) => TcpAnswer::Failed,
    }
}
