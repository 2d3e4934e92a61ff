//! The TCP link of a node: connections that others open to it, and those that it opens to
//! configured peers. They carry JTCP.
//!
//! Any number of JAUS ids may live behind a connection. Messages are sent to the *connection*, named
//! by its remote address, that an id was heard on last, whoever opened it; so when two nodes have
//! connected to each other, both connections live, and each direction settles on one. Junior
//! opens a connection for each id and version and answers on the connection that it was asked on,
//! which comes to the same.
//!
//! # Nobody waits for a slow peer
//!
//! Each connection has a backlog of its own, bounded, the urgent first. A peer that does not read
//! loses the oldest of its own least urgent messages; when it has taken nothing for
//! [`STUCK`] since the first loss, its connection is closed. Messages
//! are collected until the node has nothing more to send just now, and written with one call.
//!
//! All backlogs together have a bound too, at which the largest gives way.
//!
//! # Connecting
//!
//! An attempt may take [`CONNECT_TIMEOUT`]. The pause after it is [`FIRST_PAUSE`] and doubles with
//! each failure up to [`LONGEST_PAUSE`], a quarter more or less by chance; a connection on
//! which something valid came begins anew. What is sent while an attempt is under way, to the peer or
//! to everyone, waits for it, and is lost when it fails; what is sent in the pauses is lost at once.
//! Both is counted.
//!
//! # Accepting
//!
//! [`Settings::access`] is asked first. The places for accepted connections are shared between
//! network addresses: see [`Settings::max_accepted`] and [`Settings::max_per_address`].

mod admission;
mod connection;
mod dial;
mod settings;

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use bytes::Bytes;
use socket2::{Domain, Protocol, Socket, Type};
use tokio::net::{TcpListener, TcpStream};

pub use connection::Closed;
pub use settings::{CONNECT_TIMEOUT, FIRST_PAUSE, HANDSHAKE, LONGEST_PAUSE, STUCK, Settings};

use super::Error;
use crate::endpoint::{Access, Remote, To, Transmit};
use crate::wire::{Frame, Priority};
use admission::{Admission, Place, Quota};
use connection::Connection;
use dial::Dial;
use settings::MAX_WAITING;

/// Frames taken from one connection, and connections accepted, before the others have their turn.
const BATCH: usize = 32;
/// The pause after the operating system refused to accept a connection, such as for want of file
/// descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_secs(1);
/// A backlog up to so many octets is not worth adding up all of them.
const SMALL: usize = 64 * 1024;
/// The time between two warnings that places are scarce.
const WARNING_PAUSE: Duration = Duration::from_secs(60);

/// What a TCP link has done since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// Connections that others have opened.
    pub accepted: u64,
    /// Connections that others wanted to open, refused because there were enough.
    pub refused: u64,
    /// Connections that others wanted to open, refused because their network address may not.
    pub denied: u64,
    /// Connections closed to make room for others.
    pub displaced: u64,
    /// Connections opened to configured peers.
    pub connected: u64,
    /// Attempts that failed.
    pub connect_failures: u64,
    /// Connections closed, whatever the reason.
    pub closed: u64,
    /// Of those: because of what came on them.
    pub malformed: u64,
    /// Of those: because the other side took nothing.
    pub stuck: u64,
    /// Messages received.
    pub received: u64,
    /// Messages given to a connection, each copy counted.
    pub sent: u64,
    /// Messages lost because the other side was slower for too long.
    pub send_overflows: u64,
    /// Messages lost because there was no connection to send them on.
    pub not_connected: u64,
    /// Messages lost because the connection carries another version of the transport.
    pub other_version: u64,
}

/// One connection, as it is now.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ConnectionReport {
    /// The address of the other end.
    pub remote: SocketAddr,
    /// The address of this end, unless the connection is just breaking.
    pub local: Option<SocketAddr>,
    /// Whether this side opened it.
    pub dialed: bool,
    /// Messages that came on it.
    pub received: u64,
    /// Messages that wait for the other side.
    pub waiting: usize,
    /// Messages lost because the other side was slower for too long.
    pub overflows: u64,
}

/// What has happened on a link.
#[derive(Debug)]
pub enum Arrival {
    /// A message came from this remote address.
    Frame {
        /// The remote address.
        remote: SocketAddr,
        /// The message.
        frame: Frame,
        /// Whether a version octet stood before it that was not the stream's first octet.
        version_again: bool,
    },
    /// The connection with this remote address is gone.
    Closed(SocketAddr, Closed),
}

/// The connections of a node. Must be opened within a tokio runtime.
#[derive(Debug)]
pub struct TcpLink {
    listener: Option<TcpListener>,
    local: Option<SocketAddr>,
    quota: Quota,
    access: Access,
    /// When the latest warning about scarce places was written.
    warned: Option<Instant>,
    accept_after: Option<Instant>,
    dials: Vec<Dial>,
    connections: BTreeMap<SocketAddr, Connection>,
    closed: VecDeque<(SocketAddr, Closed)>,
    counters: Counters,
}

impl TcpLink {
    /// Opens the listener, if one is wanted. Connecting begins with the first
    /// [`receive`](Self::receive).
    ///
    /// # Errors
    /// [`Error::ListenerTaken`], [`Error::Permission`], [`Error::AddressGone`] or [`Error::Io`].
    pub fn open(settings: &Settings) -> Result<Self, Error> {
        let listener = settings.listen.map(listen).transpose()?;
        let local = listener.as_ref().and_then(|l| l.local_addr().ok());
        let mut dials: Vec<Dial> = Vec::new();
        for &address in &settings.connect {
            if !dials.iter().any(|dial| dial.address == address) {
                dials.push(Dial::new(address));
            }
        }
        tracing::info!(listening = ?local, peers = ?settings.connect, "TCP link opened");
        Ok(Self {
            listener,
            local,
            quota: Quota {
                total: settings.max_accepted,
                per_address: settings.max_per_address,
            },
            access: settings.access.clone(),
            warned: None,
            accept_after: None,
            dials,
            connections: BTreeMap::new(),
            closed: VecDeque::new(),
            counters: Counters::default(),
        })
    }

    /// Where others may connect to.
    #[must_use]
    pub const fn local(&self) -> Option<SocketAddr> {
        self.local
    }

    /// What it has done so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        let open: u64 = self.connections.values().map(|c| c.overflows).sum();
        Counters {
            send_overflows: self.counters.send_overflows + open,
            ..self.counters
        }
    }

    /// The open connections, in order of their remote addresses.
    pub fn connections(&self) -> impl Iterator<Item = ConnectionReport> + '_ {
        self.connections
            .iter()
            .map(|(&remote, connection)| ConnectionReport {
                remote,
                local: connection.local,
                dialed: connection.dialed,
                received: connection.received,
                waiting: connection.waiting(),
                overflows: connection.overflows,
            })
    }

    /// When to call [`receive`](Self::receive) even if nothing arrives.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let dials = self.dials.iter().filter_map(Dial::deadline);
        let stuck = self.connections.values().filter_map(Connection::stuck_at);
        dials.chain(stuck).chain(self.accept_after).min()
    }

    /// Sends what the endpoint gives out: queues it, until [`poll_flush`](Self::poll_flush) or until
    /// there is enough for one call.
    pub fn transmit(&mut self, transmit: &Transmit) {
        match transmit.to {
            To::Peer(Remote::Socket(peer)) => self.send_to(peer, transmit),
            // No peer of this link.
            To::Peer(Remote::Line) => {}
            To::Group => self.send_to_all(transmit.priority, &transmit.payload),
        }
    }

    fn send_to(&mut self, peer: SocketAddr, transmit: &Transmit) {
        let (priority, payload) = (transmit.priority, &transmit.payload);
        if let Some(connection) = self.connections.get_mut(&peer) {
            self.counters.count(connection.send(priority, payload));
            if connection.waiting_octets() > SMALL {
                self.bound_waiting();
            }
        } else if let Some(dial) = self.dial(peer) {
            let kept = dial.keep(priority, payload);
            self.counters.count_kept(kept);
        } else {
            self.counters.not_connected += 1;
        }
    }

    /// Sends on every connection, also on those that are just being opened.
    fn send_to_all(&mut self, priority: Priority, payload: &Bytes) {
        for connection in self.connections.values_mut() {
            self.counters.count(connection.send(priority, payload));
        }
        for dial in self.dials.iter_mut().filter(|dial| !dial.is_connected()) {
            self.counters.count_kept(dial.keep(priority, payload));
        }
        self.bound_waiting();
    }

    /// Keeps what waits for all connections within [`MAX_WAITING`].
    fn bound_waiting(&mut self) {
        let octets = |connection: &Connection| connection.waiting_octets();
        while self.connections.values().map(octets).sum::<usize>() > MAX_WAITING
            && let Some(most) = self.connections.values_mut().max_by_key(|c| octets(c))
        {
            most.drop_least();
        }
    }

    fn dial(&mut self, address: SocketAddr) -> Option<&mut Dial> {
        self.dials.iter_mut().find(|dial| dial.address == address)
    }

    /// Writes what waits; ready when nothing waits any more.
    pub fn poll_flush(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<()> {
        let mut flushed = Poll::Ready(());
        for connection in self.connections.values_mut() {
            if connection.poll_flush(cx, now).is_pending() {
                flushed = Poll::Pending;
            }
        }
        flushed
    }

    /// Says on each connection that nothing more comes, and opens no new ones. Ready when the other
    /// sides have closed theirs too, which [`receive`](Self::receive) finds out.
    ///
    /// A connection that is closed while something is on its way to us is reset, and whoever writes
    /// then gets a signal that ends it, unless it has thought of that. Junior's run-time engine has
    /// not.
    pub fn hang_up(&mut self) -> Poll<()> {
        self.listener = None;
        self.dials.clear();
        self.connections.values_mut().for_each(Connection::hang_up);
        if self.connections.is_empty() {
            Poll::Ready(())
        } else {
            Poll::Pending
        }
    }

    /// Opens connections and takes in what has arrived on them; whether some had more than their
    /// share.
    pub fn receive(
        &mut self,
        cx: &mut Context<'_>,
        now: Instant,
        mut arrived: impl FnMut(Arrival),
    ) -> bool {
        let mut more = self.accept(cx, now);
        self.connect(cx, now);
        for (&remote, connection) in &mut self.connections {
            if connection.stuck_at().is_some_and(|at| at <= now) {
                self.closed.push_back((remote, Closed::Stuck));
                continue;
            }
            let mut batch = 0;
            while let Poll::Ready(result) = connection.poll_recv(cx, now) {
                match result {
                    Ok(frame) => arrived(Arrival::Frame {
                        remote,
                        frame,
                        version_again: connection.repeats_version(),
                    }),
                    Err(closed) => {
                        self.closed.push_back((remote, closed));
                        break;
                    }
                }
                batch += 1;
                if batch == BATCH {
                    more = true;
                    break;
                }
            }
            self.counters.received += batch as u64;
        }
        while let Some((remote, why)) = self.closed.pop_front() {
            more |= self.close(now, remote, &why);
            arrived(Arrival::Closed(remote, why));
        }
        more
    }

    /// Drops a connection; whether it is to be dialled again, which has to be asked for.
    fn close(&mut self, now: Instant, remote: SocketAddr, why: &Closed) -> bool {
        let Some(connection) = self.connections.remove(&remote) else {
            return false;
        };
        tracing::info!(%remote, %why, "connection closed");
        self.counters.closed += 1;
        self.counters.malformed += u64::from(matches!(why, Closed::Malformed(_)));
        self.counters.stuck += u64::from(matches!(why, Closed::Stuck));
        self.counters.displaced += u64::from(matches!(why, Closed::Silent | Closed::Idle));
        self.counters.send_overflows += connection.overflows;
        let dialed = connection.dialed;
        if dialed && let Some(dial) = self.dial(remote) {
            dial.lost(now, connection.received > 0);
        }
        dialed
    }

    /// Takes in connections; whether there may be more than one turn's share.
    fn accept(&mut self, cx: &mut Context<'_>, now: Instant) -> bool {
        if self.accept_after.is_some_and(|after| now < after) {
            return false;
        }
        self.accept_after = None;
        for _ in 0..BATCH {
            let Some(listener) = &self.listener else {
                return false;
            };
            match listener.poll_accept(cx) {
                Poll::Pending => return false,
                Poll::Ready(Ok((stream, remote))) => self.admit(stream, remote, now),
                Poll::Ready(Err(error)) if is_of_the_peer(&error) => {}
                Poll::Ready(Err(error)) => {
                    tracing::warn!(%error, "connections cannot be accepted just now");
                    self.accept_after = Some(now + ACCEPT_PAUSE);
                    return false;
                }
            }
        }
        true
    }

    /// Takes in a connection that somebody has opened, or refuses it.
    fn admit(&mut self, stream: TcpStream, remote: SocketAddr, now: Instant) {
        if !self.access.allows_address(remote.ip()) {
            self.counters.denied += 1;
            tracing::debug!(%remote, "connection denied");
            return;
        }
        let accepted = self
            .connections
            .iter()
            .filter(|(_, connection)| !connection.dialed);
        let places: Vec<_> = accepted
            .map(|(&remote, connection)| Place {
                remote,
                opened: connection.opened,
                heard: connection.heard,
            })
            .collect();
        match self.quota.admit(remote, &places, now) {
            Admission::Admit => {}
            Admission::ReplaceSilent(other) => self.displace(other, Closed::Silent, now),
            Admission::ReplaceIdle(other) => self.displace(other, Closed::Idle, now),
            Admission::Refuse => {
                self.counters.refused += 1;
                self.warn_of_scarcity(now, "a connection was refused", remote);
                return;
            }
        }
        self.counters.accepted += 1;
        self.open_connection(stream, remote, false, now);
    }

    /// Closes a connection whose place is needed.
    fn displace(&mut self, remote: SocketAddr, why: Closed, now: Instant) {
        self.warn_of_scarcity(now, "a connection was closed to make room", remote);
        self.close(now, remote, &why);
        // For the endpoint, which has to forget the path.
        self.closed.push_back((remote, why));
    }

    /// Warns once in a while: whoever opens connections shall not fill the log.
    fn warn_of_scarcity(&mut self, now: Instant, what: &str, remote: SocketAddr) {
        let limit = self.quota.total;
        let is_due = |warned: Instant| now.saturating_duration_since(warned) >= WARNING_PAUSE;
        if self.warned.is_none_or(is_due) {
            self.warned = Some(now);
            tracing::warn!(%remote, limit, "TCP connections are scarce: {what}");
        } else {
            tracing::debug!(%remote, limit, "TCP connections are scarce: {what}");
        }
    }

    fn connect(&mut self, cx: &mut Context<'_>, now: Instant) {
        for index in 0..self.dials.len() {
            let address = self.dials[index].address;
            match self.dials[index].poll(cx, now) {
                Poll::Pending => {}
                Poll::Ready(Ok(stream)) => {
                    self.counters.connected += 1;
                    self.open_connection(stream, address, true, now);
                    let dial = &mut self.dials[index];
                    while let Some((priority, payload)) = dial.waiting.pop() {
                        if let Some(connection) = self.connections.get_mut(&address) {
                            self.counters.count(connection.send(priority, &payload));
                        }
                    }
                }
                Poll::Ready(Err(error)) => {
                    self.counters.connect_failures += 1;
                    let dial = &mut self.dials[index];
                    self.counters.not_connected += dial.waiting.len() as u64;
                    while dial.waiting.pop().is_some() {}
                    tracing::debug!(%address, %error, "no connection");
                }
            }
        }
    }

    fn open_connection(
        &mut self,
        stream: TcpStream,
        remote: SocketAddr,
        dialed: bool,
        now: Instant,
    ) {
        match Connection::new(stream, dialed, now) {
            Ok(connection) => {
                tracing::info!(%remote, dialed, "connection opened");
                self.connections.insert(remote, connection);
            }
            Err(error) => {
                tracing::warn!(%remote, %error, "a connection cannot be set up");
                if dialed && let Some(dial) = self.dial(remote) {
                    dial.lost(now, false);
                }
            }
        }
    }
}

impl Counters {
    /// Counts a message for a peer to which there is no connection; see [`Dial::keep`].
    const fn count_kept(&mut self, lost: Option<u64>) {
        match lost {
            Some(lost) => self.send_overflows += lost,
            None => self.not_connected += 1,
        }
    }

    /// Counts a message that a connection has taken, or has not.
    const fn count(&mut self, taken: bool) {
        if taken {
            self.sent += 1;
        } else {
            self.other_version += 1;
        }
    }
}

/// Whether a failure to accept is about that one connection, so that the next may succeed.
fn is_of_the_peer(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionReset, Interrupted};
    matches!(
        error.kind(),
        ConnectionAborted | ConnectionReset | Interrupted
    )
}

fn listen(address: SocketAddr) -> Result<TcpListener, Error> {
    let open = || {
        let socket = Socket::new(
            Domain::for_address(address),
            Type::STREAM,
            Some(Protocol::TCP),
        )?;
        // A node that is started again finds connections of its predecessor in their last minute.
        // (Windows takes this for leave to share the port.)
        #[cfg(not(windows))]
        socket.set_reuse_address(true)?;
        socket.bind(&address.into())?;
        socket.listen(128)?;
        socket.set_nonblocking(true)?;
        TcpListener::from_std(socket.into())
    };
    open().map_err(|source: io::Error| match source.kind() {
        io::ErrorKind::AddrInUse => Error::ListenerTaken { address },
        io::ErrorKind::AddrNotAvailable => Error::AddressGone(address.ip()),
        io::ErrorKind::PermissionDenied => Error::Permission {
            doing: format!("listening on TCP {address}"),
            port: address.port(),
            source,
        },
        _ => Error::Io {
            doing: format!("listening on TCP {address}"),
            source,
        },
    })
}
