//! The TCP link of a node: accepted connections, and connections to configured peers. They carry
//! JTCP.
//!
//! Any number of JAUS ids may be reached over a connection. Messages for an id go to the
//! *connection*, named by its remote address, on which the id was last heard, whichever side opened
//! it. So when two nodes have connected to each other, both connections stay, and each direction
//! settles on one. Junior opens a connection per id and version and replies on the connection of
//! the query, which is compatible.
//!
//! # Slow peers
//!
//! Each connection has its own bounded backlog, most urgent first. If a peer does not read, the
//! oldest of its own least urgent messages are dropped. If it has taken nothing for [`STUCK`] since
//! the first loss, its connection is closed. Messages are collected until the node has nothing more
//! to send at the moment, and then written with one call.
//!
//! All backlogs together have a limit too, at which the largest one drops messages.
//!
//! # Connecting
//!
//! An attempt takes at most [`CONNECT_TIMEOUT`]. The pause after it is [`FIRST_PAUSE`] and doubles
//! with each failure up to [`LONGEST_PAUSE`], ± 25 % at random. A connection on which a valid
//! message arrived resets the pause. Messages sent during an attempt, to the peer or to everyone,
//! wait for it, and are dropped if it fails. Messages sent in the pauses are dropped at once. Both
//! are counted.
//!
//! # Accepting
//!
//! [`Settings::access`] is checked first. The places for accepted connections are shared among
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
use tokio::net::{TcpListener, TcpStream};

pub use connection::Closed;
pub use settings::{CONNECT_TIMEOUT, FIRST_PAUSE, HANDSHAKE, LONGEST_PAUSE, STUCK, Settings};

use super::Error;
use crate::endpoint::{Remote, To, Transmit};
use crate::wire::{Frame, Priority};
use admission::Admission;
use connection::{Connection, prepare};
use dial::Dial;
use settings::MAX_WAITING;

/// Frames from one connection, and connections accepted, before the others have their turn.
const BATCH: usize = 32;
/// The pause after the operating system failed to accept a connection, for instance without free
/// file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_secs(1);
/// For a backlog up to this size the total of all backlogs is not computed.
const SMALL: usize = 64 * 1024;
/// The shortest interval between warnings about scarce places.
const WARNING_PAUSE: Duration = Duration::from_secs(60);

/// Counts of a TCP link since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// Accepted connections.
    pub accepted: u64,
    /// Incoming connections refused because a limit was reached.
    pub refused: u64,
    /// Incoming connections refused because access denies their network address.
    pub denied: u64,
    /// Connections closed to make room for others.
    pub displaced: u64,
    /// Connections opened to configured peers.
    pub connected: u64,
    /// Failed attempts to connect.
    pub connect_failures: u64,
    /// Connections closed for any reason.
    pub closed: u64,
    /// Of those: because of malformed input.
    pub malformed: u64,
    /// Of those: because the other side took nothing.
    pub stuck: u64,
    /// Messages received.
    pub received: u64,
    /// Messages passed to a connection; each copy counts.
    pub sent: u64,
    /// Messages dropped because the other side was too slow.
    pub send_overflows: u64,
    /// Messages dropped because there was no connection for them.
    pub not_connected: u64,
    /// Messages dropped because the connection carries another version of the transport, or is
    /// being shut down.
    pub other_version: u64,
}

/// The current state of one connection.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ConnectionReport {
    /// The address of the other end.
    pub remote: SocketAddr,
    /// The address of this end, unless the connection is failing.
    pub local: Option<SocketAddr>,
    /// Whether this side opened it.
    pub dialed: bool,
    /// Messages received on it.
    pub received: u64,
    /// Messages that wait for the other side.
    pub waiting: usize,
    /// Messages dropped because the other side was too slow.
    pub overflows: u64,
}

/// An event on a link.
#[derive(Debug)]
pub enum Arrival {
    /// A message was received from this remote address.
    Frame {
        /// The remote address.
        remote: SocketAddr,
        /// The message.
        frame: Frame,
        /// Whether a version octet preceded it that was not the stream's first octet.
        version_again: bool,
    },
    /// The connection with this remote address is gone.
    Closed(SocketAddr, Closed),
}

/// The connections of a node. Must be opened within a tokio runtime.
#[derive(Debug)]
pub struct TcpLink {
    listener: Option<TcpListener>,
    settings: Settings,
    /// When the last warning about scarce places was logged.
    warned: Option<Instant>,
    accept_after: Option<Instant>,
    dials: BTreeMap<SocketAddr, Dial>,
    connections: BTreeMap<SocketAddr, Connection>,
    closed: VecDeque<(SocketAddr, Closed)>,
    counters: Counters,
}

impl TcpLink {
    /// Opens the listener, if configured. The first [`receive`](Self::receive) starts to connect.
    ///
    /// # Errors
    /// [`Error::ListenerTaken`], [`Error::Permission`], [`Error::AddressGone`] or [`Error::Io`].
    pub fn open(settings: &Settings) -> Result<Self, Error> {
        let listener = settings.listen.map(listen).transpose()?;
        let dials = settings.connect.iter().map(|&peer| (peer, Dial::new()));
        let link = Self {
            listener,
            settings: settings.clone(),
            warned: None,
            accept_after: None,
            dials: dials.collect(),
            connections: BTreeMap::new(),
            closed: VecDeque::new(),
            counters: Counters::default(),
        };
        tracing::info!(listening = ?link.local(), peers = ?settings.connect, "TCP link opened");
        Ok(link)
    }

    /// The address that accepts connections, if any.
    #[must_use]
    pub fn local(&self) -> Option<SocketAddr> {
        self.listener.as_ref()?.local_addr().ok()
    }

    /// Its counters so far.
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
                local: connection.local(),
                dialed: connection.dialed,
                received: connection.received,
                waiting: connection.backlog.len(),
                overflows: connection.overflows,
            })
    }

    /// When to call [`receive`](Self::receive) even if nothing arrives.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let dials = self.dials.values();
        let dials = dials.filter_map(|dial| dial.redial.deadline());
        let stuck = self.connections.values().filter_map(Connection::stuck_at);
        dials.chain(stuck).chain(self.accept_after).min()
    }

    /// Queues a message from the endpoint, until [`poll_flush`](Self::poll_flush) or until there is
    /// enough for one call.
    pub fn transmit(&mut self, transmit: &Transmit) {
        match transmit.to {
            To::Peer(Remote::Socket(peer)) => self.send_to(peer, transmit),
            // Not a peer of this link.
            To::Peer(Remote::Line | Remote::Session(_)) => {}
            To::Group => self.send_to_all(transmit.priority, &transmit.payload),
        }
    }

    fn send_to(&mut self, peer: SocketAddr, transmit: &Transmit) {
        let (priority, payload) = (transmit.priority, &transmit.payload);
        if let Some(connection) = self.connections.get_mut(&peer) {
            self.counters.count(connection.send(priority, payload));
            if connection.backlog.octets() > SMALL {
                self.bound_waiting();
            }
        } else {
            let dial = self.dials.get_mut(&peer);
            let kept = dial.and_then(|dial| dial.keep(priority, payload));
            self.counters.count_kept(kept);
        }
    }

    /// Sends on every connection, including those that are being opened.
    fn send_to_all(&mut self, priority: Priority, payload: &Bytes) {
        for connection in self.connections.values_mut() {
            self.counters.count(connection.send(priority, payload));
        }
        for dial in self.dials.values_mut().filter(|dial| !dial.redial.is_up()) {
            self.counters.count_kept(dial.keep(priority, payload));
        }
        self.bound_waiting();
    }

    /// Keeps the backlogs of all connections within [`MAX_WAITING`].
    fn bound_waiting(&mut self) {
        let octets = |connection: &Connection| connection.backlog.octets();
        while self.connections.values().map(octets).sum::<usize>() > MAX_WAITING
            && let Some(most) = self.connections.values_mut().max_by_key(|c| octets(c))
        {
            most.drop_least();
        }
    }

    /// Writes queued messages; ready when none is left.
    pub fn poll_flush(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<()> {
        let mut flushed = Poll::Ready(());
        for connection in self.connections.values_mut() {
            if connection.poll_flush(cx, now).is_pending() {
                flushed = Poll::Pending;
            }
        }
        flushed
    }

    /// Shuts down the sending direction of each connection, and opens no new ones. Ready when the
    /// other sides have closed theirs too, which [`receive`](Self::receive) detects.
    ///
    /// A connection that is closed while data is in flight to this side is reset. A peer that then
    /// writes gets a signal that terminates it unless handled. Junior's run-time engine does not
    /// handle it.
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

    /// Opens connections and receives messages. Returns whether some connection had more than its
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
            for taken in 1..=BATCH {
                match connection.poll_recv(cx, now) {
                    Poll::Pending => break,
                    Poll::Ready(Ok(frame)) => {
                        self.counters.received += 1;
                        arrived(Arrival::Frame {
                            remote,
                            frame,
                            version_again: connection.repeats_version(),
                        });
                    }
                    Poll::Ready(Err(closed)) => {
                        self.closed.push_back((remote, closed));
                        break;
                    }
                }
                more |= taken == BATCH;
            }
        }
        while let Some((remote, why)) = self.closed.pop_front() {
            more |= self.close(now, remote, &why);
            arrived(Arrival::Closed(remote, why));
        }
        more
    }

    /// Drops a connection. Returns whether it must be dialled again, which the caller must arrange.
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
        if dialed && let Some(dial) = self.dials.get_mut(&remote) {
            dial.redial.lost(now, connection.received > 0);
        }
        dialed
    }

    /// Accepts connections; returns whether there may be more than one turn's share.
    fn accept(&mut self, cx: &mut Context<'_>, now: Instant) -> bool {
        use io::ErrorKind::{ConnectionAborted, ConnectionReset, Interrupted};
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
                Poll::Ready(Err(error)) => match error.kind() {
                    // Only that connection has failed; the next may succeed.
                    ConnectionAborted | ConnectionReset | Interrupted => {}
                    _ => {
                        tracing::warn!(%error, "cannot accept connections");
                        self.accept_after = Some(now + ACCEPT_PAUSE);
                        return false;
                    }
                },
            }
        }
        true
    }

    /// Admits or refuses an incoming connection.
    fn admit(&mut self, stream: TcpStream, remote: SocketAddr, now: Instant) {
        if !self.settings.access.allows_address(remote.ip()) {
            self.counters.denied += 1;
            tracing::debug!(%remote, "connection denied");
            return;
        }
        let accepted = self.connections.values().filter(|c| !c.dialed);
        let places: Vec<_> = accepted.map(|connection| connection.place).collect();
        match self.settings.admit(remote, &places, now) {
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
        match prepare(stream) {
            Ok(stream) => {
                let connection = Connection::new(stream, remote, false, now);
                self.connections.insert(remote, connection);
            }
            Err(error) => tracing::warn!(%remote, %error, "cannot set up a connection"),
        }
    }

    /// Closes a connection whose place is needed.
    fn displace(&mut self, remote: SocketAddr, why: Closed, now: Instant) {
        self.warn_of_scarcity(now, "a connection was closed to make room", remote);
        self.close(now, remote, &why);
        // For the endpoint, which must forget the path.
        self.closed.push_back((remote, why));
    }

    /// Warns once per [`WARNING_PAUSE`], so that incoming connections cannot fill the log.
    fn warn_of_scarcity(&mut self, now: Instant, what: &str, remote: SocketAddr) {
        let limit = self.settings.max_accepted;
        let is_due = |warned: Instant| now.saturating_duration_since(warned) >= WARNING_PAUSE;
        if self.warned.is_none_or(is_due) {
            self.warned = Some(now);
            tracing::warn!(%remote, limit, "TCP connections are scarce: {what}");
        } else {
            tracing::debug!(%remote, limit, "TCP connections are scarce: {what}");
        }
    }

    fn connect(&mut self, cx: &mut Context<'_>, now: Instant) {
        for (&remote, dial) in &mut self.dials {
            let attempted = dial.redial.poll(cx, now, |attempt| {
                attempt.spawn(async move { TcpStream::connect(remote).await.and_then(prepare) });
            });
            match attempted {
                Poll::Pending => {}
                Poll::Ready(Ok(stream)) => {
                    self.counters.connected += 1;
                    let mut connection = Connection::new(stream, remote, true, now);
                    while let Some((priority, payload)) = dial.waiting.pop() {
                        self.counters.count(connection.send(priority, &payload));
                    }
                    self.connections.insert(remote, connection);
                }
                Poll::Ready(Err(error)) => {
                    self.counters.connect_failures += 1;
                    self.counters.not_connected += dial.waiting.len() as u64;
                    while dial.waiting.pop().is_some() {}
                    tracing::debug!(address = %remote, %error, "no connection");
                }
            }
        }
    }
}

impl Counters {
    /// Counts a message for a peer without a connection; see [`Dial::keep`].
    const fn count_kept(&mut self, lost: Option<u64>) {
        match lost {
            Some(lost) => self.send_overflows += lost,
            None => self.not_connected += 1,
        }
    }

    /// Counts a message that a connection has taken or rejected.
    fn count(&mut self, taken: bool) {
        self.sent += u64::from(taken);
        self.other_version += u64::from(!taken);
    }
}

/// Listens at an address. On Unix, connections of a predecessor in TIME_WAIT are no obstacle.
pub(in crate::link) fn listen(address: SocketAddr) -> Result<TcpListener, Error> {
    let open = || {
        let listener = std::net::TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        TcpListener::from_std(listener)
    };
    open().map_err(|source| match source.kind() {
        io::ErrorKind::AddrInUse => Error::ListenerTaken(address),
        _ => Error::socket(format!("listening on TCP {address}"), address, source),
    })
}
