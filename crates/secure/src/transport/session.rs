//! One QUIC connection: what waits for it, and how datagrams travel on it.
//!
//! A JUDP datagram travels as a QUIC datagram, unless it requests an acknowledgement, is a fragment,
//! or is too long. Those travel on streams, one for each priority and direction, so that a large
//! message does not hold up an urgent one. QUIC's congestion control sets the pace; what it does not
//! take yet waits in a backlog, most urgent first.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Instant;

use bytes::{Buf as _, Bytes};
use jaus::link::backlog::{Backlog, Bounds};
use jaus::wire::{Acknowledgement, DataControl, Priority, judp};
use quinn_proto::{Connection, ConnectionHandle, Dir, SendDatagramError, StreamId, VarInt};
use rustls::pki_types::{CertificateDer, UnixTime};

use super::inlet::{Inlet, framed};
use super::instances::{Asked, Instance, UsedIds};
use super::zone;
use crate::authority::Rejection;
use crate::credentials::Identified;
use crate::trust::Peer;

/// Limits of what waits for one session.
const WAITING: Bounds = Bounds {
    items: 8192,
    octets: 4 << 20,
};
/// Octets to read from a stream at once.
const CHUNK: usize = 64 << 10;
/// Streams that a peer may open: one for each priority.
pub(super) const STREAMS: u32 = Priority::ALL.len() as u32;

#[derive(Debug)]
pub(super) struct Session {
    pub(super) handle: ConnectionHandle,
    pub(super) connection: Connection,
    /// The dial that opened it; `None` if the peer did.
    pub(super) dial: Option<usize>,
    /// The peer, after the handshake.
    pub(super) peer: Option<Peer>,
    /// Which of the programs with its key it is, once it has told.
    pub(super) instance: Option<Instance>,
    /// The ids that it uses.
    pub(super) used: UsedIds,
    /// When the latest packet of the peer came.
    pub(super) heard_at: Option<Instant>,
    /// The frames of its packets so far.
    pub(super) frames: u64,
    /// The question for a sign of life, until that is settled.
    pub(super) asked: Option<Asked>,
    /// Until when its certificate is valid, if it has one.
    pub(super) valid_until: Option<UnixTime>,
    /// Whether it has ended and only waits for late packets of the peer.
    pub(super) ended: bool,
    /// When the peer was last told that a message of its was refused.
    pub(super) noticed: Option<Instant>,
    /// When the peer's notice about a refused message was last logged.
    pub(super) heard: Option<Instant>,
    backlog: Backlog<(Priority, Bytes)>,
    outlets: [Outlet; Priority::ALL.len()],
    inlets: BTreeMap<StreamId, Inlet>,
    pub(super) received: u64,
    pub(super) sent: u64,
    /// When it was served last within the budget, as a number that grows.
    pub(super) turn: u64,
}

/// The stream to the peer for one priority.
#[derive(Debug, Default)]
struct Outlet {
    stream: Option<StreamId>,
    /// The rest of the datagram that is being written.
    leaving: Bytes,
}

impl Session {
    pub(super) fn new(
        handle: ConnectionHandle,
        connection: Connection,
        dial: Option<usize>,
    ) -> Self {
        Self {
            handle,
            connection,
            dial,
            peer: None,
            instance: None,
            used: UsedIds::default(),
            heard_at: None,
            frames: 0,
            asked: None,
            valid_until: None,
            ended: false,
            noticed: None,
            heard: None,
            backlog: Backlog::new(WAITING),
            outlets: Default::default(),
            inlets: BTreeMap::new(),
            received: 0,
            sent: 0,
            turn: 0,
        }
    }

    /// The address that the peer sends from at present.
    pub(super) fn address(&self) -> SocketAddr {
        zone::extract(self.connection.remote_address())
    }

    /// Closes the connection from this side.
    pub(super) fn close(&mut self, now: Instant, code: u32, reason: &'static str) {
        let reason = Bytes::from_static(reason.as_bytes());
        self.connection.close(now, VarInt::from_u32(code), reason);
    }

    /// The peer, while messages can be exchanged with it.
    pub(super) fn established(&self) -> Option<&Peer> {
        self.peer.as_ref().filter(|_| !self.ended)
    }

    /// The peer that the key or certificate of the handshake belongs to, if it is accepted now.
    pub(super) fn identify(
        &self,
        accept: impl FnOnce(&CertificateDer<'_>) -> Result<Identified, Rejection>,
    ) -> Result<Identified, Rejection> {
        let identity = self.connection.crypto_session().peer_identity();
        let shown = identity.and_then(|it| it.downcast::<Vec<CertificateDer<'static>>>().ok());
        let first = shown.as_ref().and_then(|it| it.first());
        accept(first.ok_or(Rejection::NotEd25519)?)
    }

    /// Whether this side has dialled, and the peer has not accepted its key yet.
    pub(super) const fn is_awaiting_greeting(&self) -> bool {
        self.dial.is_some() && self.peer.is_none() && !self.ended
    }

    /// Datagrams that wait for the network.
    pub(super) fn waiting(&self) -> usize {
        self.backlog.len()
    }

    /// Queues a datagram; returns how many were dropped for it.
    pub(super) fn queue(&mut self, priority: Priority, datagram: Bytes) -> u64 {
        self.backlog
            .push(priority, datagram.len(), (priority, datagram))
    }

    /// Tells the peer which program this is; and before, if the peer has dialled, that it is trusted: by
    /// an empty datagram on a stream. TLS lets the dialling side finish its handshake before the other
    /// side has checked its key.
    pub(super) fn greet(&mut self, own: Instance) {
        let level = usize::from(Priority::Standard.bits());
        if self.dial.is_none() {
            self.write(level, &[]);
        }
        // The first octets of a stream are never held up.
        self.write(level, &own.hello());
    }

    /// The priority of the datagram that waits next.
    pub(super) fn next_priority(&self) -> Option<Priority> {
        self.backlog.first().map(|&(priority, _)| priority)
    }

    /// Passes the next waiting datagram to the connection; returns its octets, or `None` if there is
    /// none or the connection takes no more.
    pub(super) fn flush_one(&mut self) -> Option<usize> {
        let (priority, datagram) = self.backlog.first().cloned()?;
        let level = usize::from(priority.bits());
        let is_taken = if travels_on_stream(&datagram) {
            self.write(level, &datagram)
        } else {
            match self.connection.datagrams().send(datagram.clone(), false) {
                Ok(()) => true,
                Err(SendDatagramError::Blocked(_)) => false,
                Err(_) => self.write(level, &datagram),
            }
        };
        if !is_taken {
            return None;
        }
        self.sent += 1;
        drop(self.backlog.pop());
        Some(datagram.len())
    }

    /// Goes on writing the datagrams that streams have taken in part.
    pub(super) fn write_rests(&mut self) {
        for level in 0..self.outlets.len() {
            self.write_rest(level);
        }
    }

    /// Writes a datagram to the stream of its priority; returns whether it was taken.
    fn write(&mut self, level: usize, datagram: &[u8]) -> bool {
        if !self.write_rest(level) {
            return false;
        }
        // JUDP datagrams are shorter than the limit of the prefix.
        self.outlets[level].leaving = framed(datagram).unwrap_or_default();
        self.write_rest(level);
        true
    }

    /// Continues with the datagram that is being written; returns whether nothing of it is left.
    fn write_rest(&mut self, level: usize) -> bool {
        let outlet = &mut self.outlets[level];
        if outlet.leaving.is_empty() {
            return true;
        }
        if outlet.stream.is_none() {
            outlet.stream = self.connection.streams().open(Dir::Uni);
            if let Some(stream) = outlet.stream {
                // It exists, because it was opened just now.
                let _ = self
                    .connection
                    .send_stream(stream)
                    .set_priority(level as i32);
            }
        }
        let Some(stream) = outlet.stream else {
            return false;
        };
        while !outlet.leaving.is_empty() {
            // Blocked, or the connection has ended.
            let Ok(octets) = self.connection.send_stream(stream).write(&outlet.leaving) else {
                return false;
            };
            outlet.leaving.advance(octets);
        }
        true
    }

    /// Registers the streams that the peer has opened; returns them.
    pub(super) fn accept_streams(&mut self) -> Vec<StreamId> {
        let mut accepted = Vec::new();
        while let Some(stream) = self.connection.streams().accept(Dir::Uni) {
            self.inlets.insert(stream, Inlet::default());
            accepted.push(stream);
        }
        accepted
    }

    /// Reads a stream, and passes each datagram to `each`.
    pub(super) fn read(&mut self, stream: StreamId, mut each: impl FnMut(Bytes)) {
        let Some(inlet) = self.inlets.get_mut(&stream) else {
            return;
        };
        let mut incoming = self.connection.recv_stream(stream);
        let Ok(mut chunks) = incoming.read(true) else {
            self.inlets.remove(&stream);
            return;
        };
        let has_ended = loop {
            match chunks.next(CHUNK) {
                Ok(Some(chunk)) => {
                    inlet.push(&chunk.bytes);
                    std::iter::from_fn(|| inlet.next()).for_each(&mut each);
                }
                Err(quinn_proto::ReadError::Blocked) => break false,
                Ok(None) | Err(_) => break true,
            }
        };
        // The owner polls for packets after every call anyway.
        let _ = chunks.finalize();
        if has_ended {
            self.inlets.remove(&stream);
        }
    }
}

/// Whether a datagram has to arrive: its first message requests an acknowledgement or is a fragment.
fn travels_on_stream(datagram: &Bytes) -> bool {
    let first = judp::frames(datagram.clone())
        .ok()
        .and_then(|mut frames| frames.next());
    first.and_then(Result::ok).is_some_and(|frame| {
        frame.flags.data() != DataControl::Single
            || frame.flags.acknowledgement() == Acknowledgement::Request
    })
}
