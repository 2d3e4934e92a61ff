//! One TCP connection: decodes received frames, and queues messages for a slow receiver.

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};

use bytes::{Buf, BufMut, Bytes, BytesMut};
use socket2::{SockRef, TcpKeepalive};
use tokio::net::TcpStream;

use super::admission::Place;
use super::settings::{BACKLOG, STUCK};
use crate::link::backlog::Backlog;
use crate::wire::jtcp::Decoder;
use crate::wire::{self, Frame, Priority};

/// Octets read or written with one call. Many small messages share a call: one call each would take
/// most of the time.
const CHUNK: usize = 64 * 1024;

/// Growth of the backlog, in octets, at which it is written at once instead of in the node's next
/// turn: a component may send much before that.
const WRITE_AT_ONCE: usize = 32 * 1024;

/// Why a connection was closed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Closed {
    /// The other side closed it, between two messages.
    #[error("the other side closed it")]
    Ended,
    /// The other side closed it within a message.
    #[error("the other side closed it within a message")]
    CutShort,
    /// The input is not JAUS, or out of step. Nothing after it can be trusted.
    #[error("{0}")]
    Malformed(wire::Error),
    /// The other side has taken nothing for [`STUCK`] while messages for it were dropped.
    #[error("the other side read nothing for {} s, and messages to it were lost", STUCK.as_secs())]
    Stuck,
    /// It had sent nothing valid, and its place was needed.
    #[error("it had sent nothing valid and its slot was needed")]
    Silent,
    /// It was idle the longest at the network address with the most connections, and its place was
    /// needed.
    #[error("it was idle, its address held the most slots, and a slot was needed")]
    Idle,
    /// An error of the operating system.
    #[error("{0}")]
    Io(io::Error),
}

#[derive(Debug)]
pub(super) struct Connection {
    stream: TcpStream,
    pub(super) dialed: bool,
    /// Its remote end and its use, for admission.
    pub(super) place: Place,
    decoder: Decoder,
    /// Frames received.
    pub(super) received: u64,
    /// The version octet with which our direction began.
    spoken: Option<u8>,
    /// The messages that wait for the other side.
    pub(super) backlog: Backlog<Bytes>,
    /// Octets being passed to the kernel; nothing overtakes them.
    leaving: BytesMut,
    /// The backlog is written at once when it reaches this many octets.
    write_at: usize,
    /// Messages dropped because the other side was too slow.
    pub(super) overflows: u64,
    /// Set when messages are dropped, until the kernel takes an octet. The inner value is the time,
    /// once it is known.
    stuck: Option<Option<Instant>>,
    failed: Option<io::Error>,
    /// Whether the sending direction is shut down.
    hung_up: bool,
}

/// Sets the options of a stream: messages leave at once, and a dead peer is detected.
pub(super) fn prepare(stream: TcpStream) -> io::Result<TcpStream> {
    stream.set_nodelay(true)?;
    let keepalive = TcpKeepalive::new()
        .with_time(Duration::from_secs(10))
        .with_interval(Duration::from_secs(5));
    SockRef::from(&stream).set_tcp_keepalive(&keepalive)?;
    Ok(stream)
}

impl Connection {
    /// With a [prepared](prepare) stream.
    pub(super) fn new(stream: TcpStream, remote: SocketAddr, dialed: bool, now: Instant) -> Self {
        tracing::info!(%remote, dialed, "connection opened");
        Self {
            stream,
            dialed,
            place: Place {
                remote,
                opened: now,
                heard: None,
            },
            decoder: Decoder::new(),
            received: 0,
            spoken: None,
            backlog: Backlog::new(BACKLOG),
            leaving: BytesMut::new(),
            write_at: WRITE_AT_ONCE,
            overflows: 0,
            stuck: None,
            failed: None,
            hung_up: false,
        }
    }

    /// The address of this end, unless the connection is failing.
    pub(super) fn local(&self) -> Option<SocketAddr> {
        self.stream.local_addr().ok()
    }

    /// Drops the oldest waiting message of the lowest priority.
    pub(super) fn drop_least(&mut self) {
        let lost = self.backlog.drop_least();
        self.count_lost(lost.into());
    }

    /// Queues the output of [`jtcp::encode`](crate::wire::jtcp::encode). Returns whether it was
    /// accepted: a connection carries only one version, and nothing after the shutdown.
    pub(super) fn send(&mut self, priority: Priority, encoded: &Bytes) -> bool {
        let mut message = encoded.clone();
        let Ok(version) = message.try_get_u8() else {
            return false;
        };
        // A peer that sends the version octet before each message may need it there, too (JAUS++).
        if self.spoken.is_some() && self.decoder.repeats_version() {
            message = encoded.clone();
        }
        let spoken = *self.spoken.get_or_insert_with(|| {
            self.leaving.put_u8(version);
            version
        });
        if spoken != version || self.hung_up {
            return false;
        }
        let octets = message.len();
        let lost = self.backlog.push(priority, octets, message);
        self.count_lost(lost);
        if self.backlog.octets() >= self.write_at {
            self.write_straight();
        }
        true
    }

    fn count_lost(&mut self, messages: u64) {
        self.overflows += messages;
        if messages > 0 {
            self.stuck.get_or_insert(None);
        }
    }

    /// Writes what the kernel takes without asking the runtime, which notices free room only
    /// between tasks.
    fn write_straight(&mut self) {
        while self.fill() {
            match SockRef::from(&self.stream).send(&self.leaving) {
                Ok(octets) => self.written(octets),
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => break,
                Err(e) => return self.fail(e),
            }
        }
        self.write_at = self.backlog.octets() + WRITE_AT_ONCE;
    }

    /// Writes queued messages; ready when none is left, or writing has failed.
    pub(super) fn poll_flush(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<()> {
        while self.failed.is_none() && self.fill() {
            if let Some(since @ None) = &mut self.stuck {
                *since = Some(now);
            }
            if ready!(self.stream.poll_write_ready(cx)).is_err() {
                // The runtime is shutting down.
                return Poll::Ready(());
            }
            match self.stream.try_write(&self.leaving) {
                Ok(octets) => self.written(octets),
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {}
                Err(e) => self.fail(e),
            }
        }
        Poll::Ready(())
    }

    /// Collects octets for one call, most urgent first; returns whether there are any.
    fn fill(&mut self) -> bool {
        while self.leaving.len() < CHUNK
            && let Some(message) = self.backlog.pop()
        {
            self.leaving.extend_from_slice(&message);
        }
        !self.leaving.is_empty()
    }

    fn written(&mut self, octets: usize) {
        self.stuck = None;
        self.write_at = WRITE_AT_ONCE;
        self.leaving.advance(octets);
        if self.leaving.is_empty() {
            // An idle connection holds no memory.
            self.leaving = BytesMut::new();
        }
    }

    /// Shuts down the sending direction when nothing is left to send. The other side's data must
    /// still be read: closing at once would signal a loss to it.
    pub(super) fn hang_up(&mut self) {
        if !self.hung_up && self.leaving.is_empty() && self.backlog.is_empty() {
            self.hung_up = true;
            // If that fails, the other side is gone.
            let _ = SockRef::from(&self.stream).shutdown(std::net::Shutdown::Write);
        }
    }

    fn fail(&mut self, error: io::Error) {
        self.failed.get_or_insert(error);
    }

    /// When [`Closed::Stuck`] is due, unless the other side takes something before.
    pub(super) fn stuck_at(&self) -> Option<Instant> {
        self.stuck.flatten().map(|since| since + STUCK)
    }

    /// The next frame, or the reason why there are no more.
    pub(super) fn poll_recv(
        &mut self,
        cx: &mut Context<'_>,
        now: Instant,
    ) -> Poll<Result<Frame, Closed>> {
        loop {
            match self.decoder.next_frame() {
                Ok(Some(frame)) => {
                    self.received += 1;
                    self.place.heard = Some(now);
                    return Poll::Ready(Ok(frame));
                }
                Ok(None) => {}
                Err(error) => return Poll::Ready(Err(Closed::Malformed(error))),
            }
            if let Some(error) = self.failed.take() {
                return Poll::Ready(Err(Closed::Io(error)));
            }
            if let Err(closed) = ready!(self.poll_read(cx)) {
                return Poll::Ready(Err(closed));
            }
        }
    }

    /// Whether a version octet preceded the last frame that was not the stream's first octet.
    pub(super) const fn repeats_version(&self) -> bool {
        self.decoder.repeats_version()
    }

    fn poll_read(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), Closed>> {
        loop {
            if let Err(e) = ready!(self.stream.poll_read_ready(cx)) {
                return Poll::Ready(Err(Closed::Io(e)));
            }
            let input = self.decoder.input();
            input.reserve(CHUNK);
            match self.stream.try_read_buf(input) {
                Ok(0) if self.decoder.buffered() > 0 => {
                    return Poll::Ready(Err(Closed::CutShort));
                }
                Ok(0) => return Poll::Ready(Err(Closed::Ended)),
                Ok(_) => return Poll::Ready(Ok(())),
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => self.decoder.release(),
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Poll::Ready(Err(Closed::Io(e))),
            }
        }
    }
}
