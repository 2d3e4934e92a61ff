//! Captures all IP packets of this host with a packet socket (Linux).
#![expect(
    clippy::disallowed_types,
    reason = "records other nodes' traffic, past our own links"
)]

use std::collections::BTreeMap;
use std::io;
use std::net;
use std::os::fd::AsRawFd;

use bytes::Bytes;
use jaus::link::interface;
use jaus_cli::failure::Failure;
use nix::errno::Errno;
use nix::sys::socket::{
    AddressFamily, LinkAddr, SockFlag, SockProtocol, SockType, recvfrom, socket,
};
use tokio::io::Interest;
use tokio::net::UdpSocket;

use super::Packet;

/// Packets per turn.
const BATCH: usize = 64;
/// Maximum length of an IP packet.
const LONGEST: usize = 65_536;
/// The kernel's mark of an outgoing packet (`PACKET_OUTGOING`). On loopback it returns a moment
/// later, and is recorded then.
const OUTGOING: u8 = 4;

pub(crate) struct PacketSocket {
    /// Not a UDP socket, but the runtime only needs to poll its readiness.
    socket: UdpSocket,
    /// By interface number; only the chosen ones.
    interfaces: BTreeMap<usize, Interface>,
    buffer: Vec<u8>,
}

struct Interface {
    name: String,
    is_loopback: bool,
}

pub(super) enum OpenError {
    /// The process lacks the permission.
    NotAllowed,
    Other(Failure),
}

impl From<Failure> for OpenError {
    fn from(failure: Failure) -> Self {
        Self::Other(failure)
    }
}

impl PacketSocket {
    /// Opens a socket for the interfaces with these names and addresses, or for all.
    pub(super) fn open(wanted: &[String]) -> Result<Self, OpenError> {
        let present = interface::list().map_err(Failure::of)?;
        let is = |one: &interface::Interface, name: &String| {
            one.name == *name || one.address.to_string() == *name
        };
        for name in wanted {
            if !present.iter().any(|one| is(one, name)) {
                let available = interface::Available(present);
                return Err(Failure::new(format!(
                    "there is no network interface `{name}` on this host; choose from: {available}"
                ))
                .into());
            }
        }
        let chosen = present
            .into_iter()
            .filter(|one| wanted.is_empty() || wanted.iter().any(|name| is(one, name)));
        let interfaces = chosen.map(|one| {
            let interface = Interface {
                is_loopback: one.is_loopback(),
                name: one.name,
            };
            (one.index as usize, interface)
        });
        let interfaces = interfaces.collect();
        let socket = socket(
            AddressFamily::Packet,
            SockType::Datagram,
            SockFlag::SOCK_NONBLOCK | SockFlag::SOCK_CLOEXEC,
            SockProtocol::EthAll,
        );
        let socket = socket.map_err(|error| match error {
            Errno::EPERM | Errno::EACCES => OpenError::NotAllowed,
            error => Failure::new(format!("cannot open a packet socket: {error}")).into(),
        })?;
        let socket = UdpSocket::from_std(net::UdpSocket::from(socket))
            .map_err(|error| Failure::new(format!("cannot poll the packet socket: {error}")))?;
        Ok(Self {
            socket,
            interfaces,
            buffer: vec![0; LONGEST],
        })
    }

    /// Waits for packets of the chosen interfaces.
    pub(super) async fn next(&mut self) -> Result<Vec<Packet>, Failure> {
        let failed =
            |error: io::Error| Failure::new(format!("cannot read the packet socket: {error}"));
        self.socket.readable().await.map_err(failed)?;
        let mut packets = Vec::new();
        while packets.len() < BATCH {
            match self.take() {
                Ok(packet) => packets.extend(packet),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                // An interface that goes down reports it once.
                Err(error) if error.raw_os_error() == Some(Errno::ENETDOWN as i32) => {}
                Err(error) => return Err(failed(error)),
            }
        }
        Ok(packets)
    }

    /// Takes a packet from the socket; `None` if it is filtered out.
    fn take(&mut self) -> io::Result<Option<Packet>> {
        let (socket, buffer) = (&self.socket, &mut self.buffer);
        let (length, from) = socket.try_io(Interest::READABLE, || {
            Ok(recvfrom::<LinkAddr>(socket.as_raw_fd(), buffer)?)
        })?;
        let interface = from.and_then(|from| Some((self.interfaces.get(&from.ifindex())?, from)));
        Ok(interface
            .filter(|(interface, from)| !(interface.is_loopback && from.pkttype() == OUTGOING))
            .map(|(interface, _)| {
                let octets = Bytes::copy_from_slice(&self.buffer[..length]);
                Packet::now(&interface.name, octets)
            }))
    }
}
