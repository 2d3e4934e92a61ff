//! Captures all IP packets of this host with a packet socket (Linux).
#![expect(
    clippy::disallowed_types,
    reason = "records other nodes' traffic, past our own links"
)]

use std::collections::BTreeMap;
use std::io;
use std::net;
use std::os::fd::{AsFd, AsRawFd};

use bytes::Bytes;
use jaus::link::interface;
use jaus_cli::failure::Failure;
use nix::errno::Errno;
use nix::sys::socket::{
    AddressFamily, LinkAddr, SockFlag, SockProtocol, SockType, getsockopt, recvfrom, setsockopt,
    socket, sockopt,
};
use nix::{getsockopt_impl, libc, sockopt_impl};
use tokio::io::Interest;
use tokio::net::UdpSocket;

use super::Packet;

/// Packets per turn.
const BATCH: usize = 64;
/// Octets of packets that may wait in the kernel: a burst of some thousand packets.
const BUFFER: usize = 8 << 20;
/// Octets of memory that the kernel uses for a packet besides its content, at least.
const AROUND: usize = 256;
/// Maximum length of an IP packet.
const LONGEST: usize = 65_536;
/// The kernel's mark of an outgoing packet (`PACKET_OUTGOING`). On loopback it returns a moment
/// later, and is recorded then.
const OUTGOING: u8 = 4;

sockopt_impl!(
    /// Packets received and dropped since the option was last read.
    Statistics,
    GetOnly,
    libc::SOL_PACKET,
    libc::PACKET_STATISTICS,
    libc::tpacket_stats
);

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
        set_buffer(&socket, BUFFER);
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
        let ready = self.socket.readable().await;
        ready.map_err(|error| failed(&error))?;
        let mut packets = Vec::new();
        for _ in 0..BATCH {
            let (socket, buffer) = (&self.socket, &mut self.buffer);
            let received = socket.try_io(Interest::READABLE, || receive(socket, buffer));
            if self.keep(received, &mut packets)?.is_none() {
                break;
            }
        }
        Ok(packets)
    }

    /// The packets that wait in the kernel.
    pub(super) fn rest(&mut self) -> Result<Vec<Packet>, Failure> {
        let mut packets = Vec::new();
        // The kernel doubles the size of the buffer.
        let mut left = 2 * BUFFER;
        // Directly, because the runtime may not have noticed yet that there are packets.
        while left > 0 {
            let received = receive(&self.socket, &mut self.buffer);
            let Some(octets) = self.keep(received, &mut packets)? else {
                break;
            };
            left = left.saturating_sub(octets);
        }
        Ok(packets)
    }

    /// Number of packets, of any protocol and interface, that the kernel has dropped since the last
    /// call because its buffer was full.
    pub(super) fn take_lost(&self) -> u64 {
        // Reading the option of an open packet socket does not fail.
        getsockopt(&self.socket, Statistics).map_or(0, |it| it.tp_drops.into())
    }

    /// Keeps a received packet, unless it is filtered out. Returns the memory that it used in the
    /// kernel, at least; `None` if there was no packet.
    fn keep(
        &self,
        received: io::Result<(usize, Option<LinkAddr>)>,
        packets: &mut Vec<Packet>,
    ) -> Result<Option<usize>, Failure> {
        let length = match received {
            Ok((length, from)) => {
                let octets = &self.buffer[..length];
                packets.extend(from.and_then(|from| self.packet(&from, octets)));
                length
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => 0,
            // An interface that goes down reports it once.
            Err(error) if error.raw_os_error() == Some(Errno::ENETDOWN as i32) => 0,
            Err(error) => return Err(failed(&error)),
        };
        Ok(Some(length + AROUND))
    }

    /// The packet, if its interface was chosen.
    fn packet(&self, from: &LinkAddr, octets: &[u8]) -> Option<Packet> {
        let interface = self.interfaces.get(&from.ifindex())?;
        let returns = interface.is_loopback && from.pkttype() == OUTGOING;
        (!returns).then(|| Packet::now(&interface.name, Bytes::copy_from_slice(octets)))
    }
}

fn receive(socket: &UdpSocket, buffer: &mut [u8]) -> io::Result<(usize, Option<LinkAddr>)> {
    Ok(recvfrom(socket.as_raw_fd(), buffer)?)
}

fn failed(error: &io::Error) -> Failure {
    Failure::new(format!("cannot read the packet socket: {error}"))
}

/// Enlarges the receive buffer: with `CAP_NET_ADMIN` to this size, otherwise at most to the limit of
/// the system (`net.core.rmem_max`).
fn set_buffer(socket: &impl AsFd, octets: usize) {
    if setsockopt(socket, sockopt::RcvBufForce, &octets).is_err() {
        // Then the default remains.
        let _ = setsockopt(socket, sockopt::RcvBuf, &octets);
    }
}

#[cfg(test)]
mod tests {
    use jaus_test_kit::evidence::{not_tested, this_test};
    use jaus_test_kit::waiting::within_limit;

    use super::*;

    fn on_loopback() -> Option<PacketSocket> {
        match PacketSocket::open(&["lo".to_owned()]) {
            Ok(socket) => Some(socket),
            Err(OpenError::NotAllowed) => {
                not_tested(&this_test(), "this user may not open packet sockets");
                None
            }
            Err(OpenError::Other(failure)) => panic!("{failure}"),
        }
    }

    /// Sends datagrams to a port of loopback that nobody reads.
    fn send(count: usize) {
        let [from, to] = [0, 1].map(|_| net::UdpSocket::bind("127.0.0.1:0").unwrap());
        for _ in 0..count {
            let sent = from.send_to(&[7; 1000], to.local_addr().unwrap());
            assert_eq!(sent.unwrap(), 1000);
        }
    }

    #[tokio::test]
    async fn packets_that_the_kernel_drops_are_counted_once() {
        let Some(mut socket) = on_loopback() else {
            return;
        };
        set_buffer(&socket.socket, 1);
        send(200);
        within_limit(socket.next()).await.unwrap();
        // Other tests send on loopback, too.
        set_buffer(&socket.socket, BUFFER);
        assert!(socket.take_lost() > 0);
        assert_eq!(socket.take_lost(), 0);
    }

    #[tokio::test]
    async fn a_burst_waits_in_the_kernel_and_is_there_at_the_end() {
        let Some(mut socket) = on_loopback() else {
            return;
        };
        let size = getsockopt(&socket.socket, sockopt::RcvBuf).unwrap();
        let usual = std::fs::read_to_string("/proc/sys/net/core/rmem_default").unwrap();
        assert!(size > usual.trim().parse().unwrap());
        send(50);
        let ours = |packets: Vec<Packet>| {
            let ours = packets.iter().filter(|it| it.octets.ends_with(&[7; 1000]));
            ours.count()
        };
        assert!(ours(socket.rest().unwrap()) >= 50);
    }
}
