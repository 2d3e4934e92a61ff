//! The secure link of a node: a UDP socket around the [`Transport`].
#![expect(clippy::disallowed_types, reason = "this module owns the socket")]

mod audit;
mod beacons;
mod probe;
mod socket;

use std::io;
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::task::{Context, Poll};
use std::time::{Instant, SystemTime};

use jaus::counters::Count;
use jaus::endpoint::{Remote, To, Transmit};
use jaus::link;
use jaus::link::custom::{Arrival, CustomLink};
use jaus::node;
use jaus::rights::Table;
use jaus_audit::AuditLog;

use beacons::Beacons;
use socket::Socket;

use crate::beacon;
use crate::credentials::Credentials;
use crate::key::Key;
use crate::transport::{Counter, Datagrams, Transport};
use crate::trust::TrustFile;

pub use beacons::Announce;
pub use probe::Reached;

/// System calls to receive before the node's other links have their turn.
const BATCH: usize = 8;

/// The settings of a secure link.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Settings {
    /// The address to listen on and to dial from. Port 0 selects any free one, which suits a node
    /// that only dials.
    pub listen: SocketAddr,
    /// The peers to dial.
    pub connect: Vec<SocketAddr>,
    /// Whether to find peers by [beacons](crate::beacon) and be found by them.
    pub announce: Option<Announce>,
    /// The most UDP octets to send per second, on all sessions together; `None` for no limit.
    pub budget: Option<NonZeroU32>,
    /// What messages need, for the rules of the peers; `None` for the catalogue's.
    pub table: Option<Table>,
}

impl Settings {
    /// A link that listens on this address.
    #[must_use]
    pub const fn new(listen: SocketAddr) -> Self {
        Self {
            listen,
            connect: Vec::new(),
            announce: None,
            budget: None,
            table: None,
        }
    }

    /// Dials this peer too.
    #[must_use]
    pub fn connect(mut self, peer: SocketAddr) -> Self {
        self.connect.push(peer);
        self
    }

    /// Finds peers by beacons, and is found by them.
    #[must_use]
    pub fn announce(mut self, announce: Announce) -> Self {
        self.announce = Some(announce);
        self
    }

    /// Decides by this table what messages need.
    #[must_use]
    pub fn table(mut self, table: Table) -> Self {
        self.table = Some(table);
        self
    }

    /// Limits the UDP octets that are sent per second, on all sessions together.
    #[must_use]
    pub const fn budget(mut self, octets_per_second: NonZeroU32) -> Self {
        self.budget = Some(octets_per_second);
        self
    }
}

/// Why a secure link was not opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The address is not one of this host, or its port is taken.
    #[error("cannot listen for secure links on UDP {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The reason.
        source: io::Error,
    },
    /// The interfaces for beacons are not there.
    #[error("cannot announce the secure link: {0}")]
    Announce(#[from] link::Error),
}

/// The secure link of a node. Must be opened within a tokio runtime.
#[derive(Debug)]
pub struct SecureLink {
    socket: Socket,
    transport: Transport,
    credentials: Credentials,
    beacons: Option<Beacons>,
    /// The datagrams that the kernel had no room for.
    leaving: Option<Datagrams>,
    timeout: Option<Instant>,
    audit: Option<AuditLog>,
    /// Lost records that the audit log knows of.
    records_lost: u64,
}

impl SecureLink {
    /// Opens the link. Its first turn dials the peers.
    ///
    /// # Errors
    /// If the address is not one of this host, or its port is taken; or if an interface for beacons
    /// does not exist.
    pub fn open(key: &Key, trust: TrustFile, settings: Settings) -> Result<Self, OpenError> {
        Self::open_with(Credentials::pinned(key.clone(), trust), settings)
    }

    /// Opens the link with these credentials, and follows their files.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_with(credentials: Credentials, settings: Settings) -> Result<Self, OpenError> {
        let address = settings.listen;
        let failed = |source| OpenError::Listen { address, source };
        let socket = Socket::bind(address).map_err(failed)?;
        let local = socket.local_addr().map_err(failed)?;
        let announce = settings.announce;
        let beacons = announce.map(|it| Beacons::open(credentials.clone(), local, it));
        tracing::info!(listening = %local, key = %credentials.public(), "secure link opened");
        credentials.follow();
        let mut transport = Transport::with_credentials(credentials.clone(), settings.connect);
        if let Some(budget) = settings.budget {
            transport = transport.with_budget(budget);
        }
        if let Some(table) = settings.table {
            transport = transport.with_table(table);
        }
        Ok(Self {
            socket,
            transport,
            credentials,
            beacons: beacons.transpose()?,
            leaving: None,
            timeout: Some(node::now()),
            audit: None,
            records_lost: 0,
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
        let Some(log) = &self.audit else { return };
        let records = std::iter::from_fn(|| self.transport.poll_record());
        records.for_each(|(record, times)| log.write(audit::entry(record).times(times)));
        let lost = self.transport.counters().get(Counter::RecordsLost);
        if lost > self.records_lost {
            log.write(audit::loss(lost - self.records_lost));
            self.records_lost = lost;
        }
    }

    /// The counters of received beacons; `None` if it has no beacons.
    #[must_use]
    pub fn beacons(&self) -> Option<&beacon::Counters> {
        self.beacons.as_ref().map(Beacons::counters)
    }

    /// Reads the beacons that have arrived, and dials the nodes that they show; returns whether there
    /// may be more.
    fn read_beacons(&mut self, cx: &mut Context<'_>, now: Instant) -> bool {
        let Some(beacons) = &mut self.beacons else {
            return false;
        };
        let (sightings, may_be_more) = beacons.read(cx, now);
        for sighting in sightings {
            self.transport.handle_sighting(now, sighting);
        }
        may_be_more
    }

    fn next_timeout(&mut self, now: Instant) -> Option<Instant> {
        let beacons = self.beacons.as_ref().map(|it| it.due(now));
        self.transport
            .poll_timeout()
            .into_iter()
            .chain(beacons)
            .min()
    }

    /// Reads what the kernel has received; returns whether there may be more.
    fn read(&mut self, cx: &mut Context<'_>, now: Instant) -> bool {
        for _ in 0..BATCH {
            let transport = &mut self.transport;
            let received = self.socket.poll_receive(cx, |from, datagram| {
                transport.handle_datagram(now, from, datagram);
            });
            match received {
                Poll::Ready(Ok(())) => {}
                // On Linux the refusal of an earlier datagram, which says nothing of the others.
                Poll::Ready(Err(error)) => tracing::debug!(%error, "secure link: receiving"),
                Poll::Pending => return false,
            }
        }
        true
    }
}

impl CustomLink for SecureLink {
    fn name(&self) -> &str {
        "secure"
    }

    /// Those of its sessions, and those of beacons, which are zero without beacons.
    fn counters(&self) -> Vec<Count> {
        let none = beacon::Counters::default();
        let beacons = self.beacons().unwrap_or(&none).counts();
        self.transport.counters().counts().chain(beacons).collect()
    }

    fn transmit(&mut self, transmit: &Transmit) {
        let (priority, octets) = (transmit.priority, &transmit.payload);
        match transmit.to {
            To::Peer(Remote::Session(session)) => {
                self.transport.send(session, priority, octets);
            }
            To::Group => self.transport.send_to_all(priority, octets),
            // Not a peer of this link.
            To::Peer(_) => {}
        }
    }

    fn poll_flush(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<()> {
        if let Some(beacons) = &mut self.beacons {
            beacons.send(now, node::time_of_day());
        }
        loop {
            let most = self.socket.max_datagrams();
            let next = self.leaving.take();
            let next = next.or_else(|| self.transport.poll_transmit(now, most));
            let Some(datagrams) = next else {
                break;
            };
            match self.socket.poll_send(cx, &datagrams) {
                Poll::Ready(Ok(())) => {}
                // QUIC repeats what matters.
                Poll::Ready(Err(error)) => {
                    tracing::debug!(to = %datagrams.to, %error, "secure link: sending");
                }
                Poll::Pending => {
                    self.leaving = Some(datagrams);
                    self.write_records();
                    return Poll::Pending;
                }
            }
        }
        self.socket.rest();
        self.timeout = self.next_timeout(now);
        self.write_records();
        Poll::Ready(())
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<Arrival> {
        if let Some(arrival) = self.transport.poll_arrival() {
            return Poll::Ready(arrival);
        }
        self.credentials
            .set_clock(SystemTime::UNIX_EPOCH + node::time_of_day());
        let is_refusing = self.audit.as_ref().is_some_and(AuditLog::refuses_commands);
        self.transport.refuse_commands(is_refusing);
        self.transport.handle_timeout(now);
        let beacons_wait = self.read_beacons(cx, now);
        if self.read(cx, now) || beacons_wait {
            cx.waker().wake_by_ref();
        }
        self.timeout = self.next_timeout(now);
        self.transport
            .poll_arrival()
            .map_or(Poll::Pending, Poll::Ready)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.timeout
    }

    fn hang_up(&mut self) -> Poll<()> {
        let now = node::now();
        if self.transport.close(now) {
            // The next turn sends the farewells, and comes back here.
            self.timeout = Some(now);
            return Poll::Pending;
        }
        Poll::Ready(())
    }
}

#[cfg(test)]
mod tests;
