//! The link through Junior's node manager on the same host, with this node's components as its
//! clients.
//!
//! Junior's node manager (`JuniorRTE`; in the JAUS Tool Set `NodeManager`) holds UDP port 3794 of
//! all addresses, so another node on the host cannot receive the multicast group. Its own clients
//! reach the network through it, with Unix datagrams in one [folder](DEFAULT_FOLDER), and so does
//! this link:
//!
//! * `JuniorRTE` in the folder is the node manager's socket. One connected socket of the link sends
//!   for all components, because the node manager looks only at the source id of a message.
//! * It delivers to `<folder>/<id as a decimal number>`, so each component has a socket there
//!   (`Claim`). A message from the network with a wildcard arrives once for each component, with
//!   that component's id as its destination.
//! * `Registration` determines when to register each id (Connect, answered by Accept), and when to
//!   repeat that with a restarted node manager.
//!
//! Each datagram carries one message, because the node manager does not read a second one. It stops
//! all traffic of the host while a client's queue is full, so the sockets are read at once.
//! Messages that it does not read yet wait here in a bounded queue, most urgent first; the oldest
//! of the lowest priority is dropped and counted. While the node manager is away, outgoing messages
//! are dropped and counted.
//!
//! # Trust
//!
//! Junior authenticates nothing. Any user who may write to the folder can impersonate the node
//! manager, and any local process can send to a component's socket under any id. Its messages are
//! trusted no more than those of the network; see `docs/several-nodes-on-one-host.md`.

mod claim;
mod registration;

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::task::{Context, Poll, ready};
use std::time::Instant;

use bytes::Bytes;
use tokio::io::ReadBuf;
use tokio::net::UnixDatagram;

pub(crate) use claim::Claim;
pub use claim::{DEFAULT_FOLDER, Error, check};

use self::claim::{connect, manager_in};
use self::registration::{Registration, Step};
use super::Slab;
use super::backlog::{Backlog, Bounds};
use crate::address::JausId;
use crate::endpoint::Transmit;
use crate::wire::{Frame, Priority, Version, judp};

/// Limits of the queue to the node manager: at most 0.1 s of what it reads.
const OUTBOX: Bounds = Bounds {
    items: 1024,
    octets: 1 << 20,
};
/// Limit of datagrams from one socket before the others have their turn.
const BATCH: usize = 64;

/// Codes of the messages between the node manager (id 0) and its clients, which have an AS5669
/// header.
const CONNECT: u16 = 1;
const ACCEPT: u16 = 2;
const CANCEL: u16 = 3;
const MANAGER: JausId = JausId::from_u32(0);

/// Counts of a link through Junior since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counters {
    /// Datagrams received.
    pub received: u64,
    /// Datagrams that could not be received.
    pub receive_errors: u64,
    /// Datagrams passed to the node manager.
    pub sent: u64,
    /// Datagrams that the operating system rejected.
    pub send_errors: u64,
    /// Datagrams dropped because the node manager read too slowly.
    pub send_overflows: u64,
    /// Datagrams dropped because the node manager was away.
    pub manager_away: u64,
    /// How often the node manager went away.
    pub failures: u64,
    /// How often it has accepted a component.
    pub registrations: u64,
}

/// A link through Junior's node manager. Must be used within a tokio runtime.
#[derive(Debug)]
pub struct JuniorLink {
    folder: PathBuf,
    manager: Option<UnixDatagram>,
    clients: BTreeMap<JausId, Claim>,
    registration: Registration,
    outbox: Backlog<Bytes>,
    is_stuck: bool,
    last_error: Option<io::ErrorKind>,
    counters: Counters,
}

impl JuniorLink {
    /// Prepares a link through the node manager in this folder, which need not be running yet.
    ///
    /// # Errors
    /// [`Error::Folder`] if the folder cannot contain the sockets.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        claim::check_folder(folder)?;
        Ok(Self {
            folder: folder.to_owned(),
            manager: None,
            clients: BTreeMap::new(),
            registration: Registration::default(),
            outbox: Backlog::new(OUTBOX),
            is_stuck: false,
            last_error: None,
            counters: Counters::default(),
        })
    }

    /// The folder of the sockets.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether the node manager is present and has accepted all components.
    #[must_use]
    pub fn is_registered(&self) -> bool {
        self.registration.is_complete()
    }

    /// Its counters so far.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// Registers a component with the node manager, from the next [`receive`](Self::receive) on.
    pub(crate) fn admit(&mut self, claim: Claim) {
        self.registration.add(claim.id());
        self.clients.insert(claim.id(), claim);
    }

    /// Deregisters a component, and removes its socket at once, because the component may return.
    pub(crate) fn release(&mut self, id: JausId) {
        if self.clients.remove(&id).is_some() {
            self.registration.remove(id);
            self.tell_manager(id, CANCEL);
        }
    }

    /// Queues a datagram from the endpoint, for [`poll_flush`](Self::poll_flush).
    pub fn transmit(&mut self, transmit: &Transmit) {
        self.push(transmit.priority, transmit.payload.clone());
    }

    fn push(&mut self, priority: Priority, datagram: Bytes) {
        if self.manager.is_none() {
            self.counters.manager_away += 1;
            return;
        }
        let dropped = self.outbox.push(priority, datagram.len(), datagram);
        self.counters.send_overflows += dropped;
        if dropped > 0 && !std::mem::replace(&mut self.is_stuck, true) {
            tracing::warn!(folder = %self.folder.display(), "Junior's node manager is too slow: \
                messages to it are dropped");
        }
    }

    /// Sends queued datagrams, as fast as the node manager reads; ready when none is left.
    pub fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        while let (Some(manager), Some(datagram)) = (&self.manager, self.outbox.first()) {
            match ready!(manager.poll_send(cx, datagram)) {
                Ok(_) => self.counters.sent += 1,
                Err(error) if has_gone(&error) => {
                    self.lose(&error);
                    // For the next `receive`, which looks for the node manager.
                    cx.waker().wake_by_ref();
                }
                Err(error) => {
                    tracing::debug!(%error, "lost a datagram to Junior's node manager");
                    self.counters.send_errors += 1;
                }
            }
            self.outbox.pop();
        }
        self.is_stuck = false;
        Poll::Ready(())
    }

    /// When to call [`receive`](Self::receive) even if nothing arrives.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.registration.poll_timeout()
    }

    /// Sends due registrations, and receives datagrams. Returns whether there was more than the
    /// link's share.
    pub fn receive(
        &mut self,
        cx: &mut Context<'_>,
        now: Instant,
        slab: &mut Slab,
        mut arrived: impl FnMut(Bytes),
    ) -> bool {
        self.register(now);
        let mut more = false;
        for (&id, claim) in &mut self.clients {
            for taken in 1..=BATCH {
                let mut buffer = ReadBuf::new(slab.room_for(1));
                match claim.poll_recv(cx, &mut buffer) {
                    Poll::Pending => break,
                    Poll::Ready(Err(error)) => {
                        tracing::debug!(%id, %error, "cannot receive through Junior");
                        self.counters.receive_errors += 1;
                        more = true;
                        break;
                    }
                    Poll::Ready(Ok(())) => self.counters.received += 1,
                }
                let datagram = Bytes::copy_from_slice(buffer.filled());
                if !is_accept(&datagram) {
                    arrived(datagram);
                } else if self.registration.handle_accept(id) {
                    self.counters.registrations += 1;
                    tracing::info!(%id, "registered with Junior's node manager");
                }
                more |= taken == BATCH;
            }
        }
        more
    }

    fn register(&mut self, now: Instant) {
        while let Some(step) = self.registration.poll(now) {
            match step {
                Step::Connect => self.connect(),
                Step::Register(id) => self.tell_manager(id, CONNECT),
                Step::Probe => self.probe(),
            }
        }
    }

    fn connect(&mut self) {
        match connect(&self.folder).and_then(UnixDatagram::from_std) {
            Ok(manager) => {
                let folder = self.folder.display();
                tracing::info!(%folder, "connected to Junior's node manager");
                self.manager = Some(manager);
                self.last_error = None;
                let ids = self.clients.keys().copied();
                self.registration.handle_connected(ids);
            }
            Err(source) => {
                let is_news = self.last_error.replace(source.kind()) != Some(source.kind());
                let path = manager_in(&self.folder);
                let error = Error::Manager { path, source };
                if is_news {
                    tracing::warn!(%error, "cannot connect to Junior; retrying");
                } else {
                    tracing::debug!(%error, "still no node manager");
                }
            }
        }
    }

    /// Sends an empty datagram, which the node manager ignores. It fails if the node manager is
    /// gone.
    fn probe(&mut self) {
        let probed = self.manager.as_ref().map(|manager| manager.try_send(&[]));
        if let Some(Err(error)) = probed.filter(|it| it.as_ref().is_err_and(has_gone)) {
            self.lose(&error);
        }
    }

    fn tell_manager(&mut self, id: JausId, code: u16) {
        let payload = Bytes::copy_from_slice(&code.to_le_bytes());
        let message = Frame {
            version: Version::As5669,
            ..Frame::new(id, MANAGER, payload)
        };
        // A message without a body always fits.
        if let Ok(datagram) = judp::encode(&message) {
            self.push(Priority::SafetyCritical, datagram);
        }
    }

    fn lose(&mut self, error: &io::Error) {
        tracing::warn!(folder = %self.folder.display(), %error, "lost Junior's node manager");
        self.counters.failures += 1;
        self.counters.manager_away += self.outbox.len() as u64;
        self.outbox = Backlog::new(OUTBOX);
        self.manager = None;
        self.registration.handle_lost();
    }

    /// Deregisters all components.
    pub fn hang_up(&mut self) -> Poll<()> {
        while let Some((&id, _)) = self.clients.first_key_value() {
            self.release(id);
        }
        while let (Some(manager), Some(datagram)) = (&self.manager, self.outbox.pop()) {
            // If the node manager has not read it, it finds no socket at the component's path.
            if manager.try_send(&datagram).is_err() {
                break;
            }
        }
        Poll::Ready(())
    }
}

/// Whether the process that bound the socket at the other end has ended.
fn has_gone(error: &io::Error) -> bool {
    use io::ErrorKind::{BrokenPipe, ConnectionRefused, ConnectionReset, NotConnected};
    matches!(
        error.kind(),
        BrokenPipe | ConnectionRefused | ConnectionReset | NotConnected
    )
}

/// Whether this is the node manager's Accept.
fn is_accept(datagram: &Bytes) -> bool {
    let first = judp::frames(datagram.clone())
        .ok()
        .and_then(|mut frames| frames.next());
    matches!(first, Some(Ok(frame)) if frame.version == Version::As5669
        && frame.source == MANAGER && frame.code() == Some(ACCEPT))
}
