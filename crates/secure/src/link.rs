//! The secure link of a node: a UDP socket around the [`Transport`].
#![expect(clippy::disallowed_types, reason = "this module owns the socket")]

mod audit;
mod probe;

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};
use std::time::{Instant, SystemTime};

use bytes::Bytes;
use jaus::endpoint::{Remote, To, Transmit};
use jaus::link::custom::{Arrival, CustomLink};
use jaus::node;
use jaus_audit::AuditLog;
use tokio::io::ReadBuf;
use tokio::net::UdpSocket;

use crate::credentials::Credentials;
use crate::key::Key;
use crate::transport::Transport;
use crate::trust::TrustFile;

pub use probe::Reached;

/// UDP datagrams to read before the node's other links have their turn.
const BATCH: usize = 64;
/// The longest UDP datagram.
const LONGEST: usize = 65_535;

/// The settings of a secure link.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Settings {
    /// The address to listen on and to dial from. Port 0 selects any free one, which suits a node
    /// that only dials.
    pub listen: SocketAddr,
    /// The peers to dial.
    pub connect: Vec<SocketAddr>,
}

impl Settings {
    /// A link that listens on this address.
    #[must_use]
    pub const fn new(listen: SocketAddr) -> Self {
        Self {
            listen,
            connect: Vec::new(),
        }
    }

    /// Dials this peer too.
    #[must_use]
    pub fn connect(mut self, peer: SocketAddr) -> Self {
        self.connect.push(peer);
        self
    }
}

/// Why a secure link was not opened.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen for secure links on UDP {address}: {source}")]
pub struct OpenError {
    /// The address.
    address: SocketAddr,
    /// The reason.
    source: io::Error,
}

/// The secure link of a node. Must be opened within a tokio runtime.
#[derive(Debug)]
pub struct SecureLink {
    socket: UdpSocket,
    transport: Transport,
    credentials: Credentials,
    /// The datagram that the kernel had no room for.
    leaving: Option<(SocketAddr, Bytes)>,
    buffer: Box<[u8]>,
    timeout: Option<Instant>,
    audit: Option<AuditLog>,
}

impl SecureLink {
    /// Opens the link. Its first turn dials the peers.
    ///
    /// # Errors
    /// If the address is not one of this host, or its port is taken.
    pub fn open(key: &Key, trust: TrustFile, settings: Settings) -> Result<Self, OpenError> {
        Self::open_with(Credentials::pinned(key.clone(), trust), settings)
    }

    /// Opens the link with these credentials, and follows their files.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_with(credentials: Credentials, settings: Settings) -> Result<Self, OpenError> {
        let address = settings.listen;
        let socket = bind(address).map_err(|source| OpenError { address, source })?;
        let (listening, key) = (socket.local_addr().ok(), credentials.public());
        tracing::info!(?listening, %key, "secure link opened");
        credentials.follow();
        Ok(Self {
            socket,
            transport: Transport::with_credentials(credentials.clone(), settings.connect),
            credentials,
            leaving: None,
            buffer: vec![0; LONGEST].into(),
            timeout: Some(node::now()),
            audit: None,
        })
    }

    /// Writes sessions, refused messages, and what concerns control, emergencies and configuration
    /// to this log.
    #[must_use]
    pub fn audited(mut self, log: AuditLog) -> Self {
        self.audit = Some(log);
        self
    }

    /// The address that it listens on.
    ///
    /// # Errors
    /// If the operating system does not tell.
    pub fn local(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Its sessions and counters.
    #[must_use]
    pub const fn transport(&self) -> &Transport {
        &self.transport
    }

    fn write_records(&mut self) {
        if let Some(log) = &self.audit {
            let records = std::iter::from_fn(|| self.transport.poll_record());
            records.for_each(|record| log.write(audit::entry(record)));
        }
    }

    /// Reads what the kernel has received; returns whether there may be more.
    fn read(&mut self, cx: &mut Context<'_>, now: Instant) -> bool {
        for _ in 0..BATCH {
            let mut buffer = ReadBuf::new(&mut self.buffer);
            match self.socket.poll_recv_from(cx, &mut buffer) {
                Poll::Ready(Ok(from)) => {
                    self.transport.handle_datagram(now, from, buffer.filled());
                }
                // On Linux the refusal of an earlier datagram, which says nothing of the others.
                Poll::Ready(Err(error)) => tracing::debug!(%error, "secure link: receiving"),
                Poll::Pending => return false,
            }
        }
        true
    }
}

/// The time at which certificates are checked.
#[expect(
    clippy::disallowed_methods,
    reason = "this module owns the link's clocks"
)]
fn wall_clock() -> SystemTime {
    SystemTime::now()
}

fn bind(address: SocketAddr) -> io::Result<UdpSocket> {
    let socket = std::net::UdpSocket::bind(address)?;
    socket.set_nonblocking(true)?;
    UdpSocket::from_std(socket)
}

impl CustomLink for SecureLink {
    fn name(&self) -> &str {
        "secure"
    }

    fn transmit(&mut self, transmit: &Transmit) {
        let (priority, octets) = (transmit.priority, &transmit.payload);
        match transmit.to {
            To::Peer(Remote::Session(session)) => {
                self.transport.send(session, priority, octets.clone());
            }
            To::Group => self.transport.send_to_all(priority, octets),
            // Not a peer of this link.
            To::Peer(_) => {}
        }
    }

    fn poll_flush(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<()> {
        loop {
            let next = self.leaving.take();
            let Some((to, datagram)) = next.or_else(|| self.transport.poll_transmit(now)) else {
                break;
            };
            match self.socket.poll_send_to(cx, &datagram, to) {
                Poll::Ready(Ok(_)) => {}
                // QUIC repeats what matters.
                Poll::Ready(Err(error)) => tracing::debug!(%to, %error, "secure link: sending"),
                Poll::Pending => {
                    self.leaving = Some((to, datagram));
                    return Poll::Pending;
                }
            }
        }
        self.timeout = self.transport.poll_timeout();
        self.write_records();
        Poll::Ready(())
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<Arrival> {
        if let Some(arrival) = self.transport.poll_arrival() {
            return Poll::Ready(arrival);
        }
        self.credentials.set_clock(wall_clock());
        self.transport.handle_timeout(now);
        if self.read(cx, now) {
            cx.waker().wake_by_ref();
        }
        self.timeout = self.transport.poll_timeout();
        self.transport
            .poll_arrival()
            .map_or(Poll::Pending, Poll::Ready)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.timeout
    }

    fn hang_up(&mut self) -> Poll<()> {
        self.transport.close(node::now());
        if self.transport.is_closing() {
            Poll::Pending
        } else {
            Poll::Ready(())
        }
    }
}

#[cfg(test)]
mod tests;
