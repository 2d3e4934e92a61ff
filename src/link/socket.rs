//! A UDP socket for links: on Unix it is registered with the runtime for reading only, and for writing only
//! while its send buffer is full. This halves the wake-ups of a round trip.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::task::{Context, Poll};

use tokio::io::Interest;

/// The socket that system calls take.
#[cfg(unix)]
pub type Inner = UdpSocket;
/// The socket that system calls take.
#[cfg(not(unix))]
pub type Inner = tokio::net::UdpSocket;

#[cfg(unix)]
type Watched = tokio::io::unix::AsyncFd<Inner>;
#[cfg(not(unix))]
type Watched = Inner;

/// A non-blocking UDP socket. Must be made within a tokio runtime.
#[derive(Debug)]
pub struct Socket {
    watched: Watched,
    /// A duplicate that is watched for writing while the socket is full.
    #[cfg(unix)]
    full: Option<Watched>,
}

impl Socket {
    /// Registers a socket, which must be non-blocking.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn new(socket: UdpSocket) -> io::Result<Self> {
        #[cfg(unix)]
        let watched = super::watch::watch(socket, Interest::READABLE)?;
        #[cfg(not(unix))]
        let watched = Watched::from_std(socket)?;
        Ok(Self {
            watched,
            #[cfg(unix)]
            full: None,
        })
    }

    /// The underlying socket.
    #[must_use]
    pub fn get(&self) -> &Inner {
        #[cfg(unix)]
        let inner = self.watched.get_ref();
        #[cfg(not(unix))]
        let inner = &self.watched;
        inner
    }

    /// Calls `read` if the socket is readable. If `read` returns `WouldBlock`, the socket counts as
    /// empty until more arrives: so a `read` that has received fewer datagrams than it had room for
    /// returns that, which spares a call that would only confirm it.
    ///
    /// # Errors
    /// Those of `read`; `WouldBlock` if the socket is not readable.
    pub fn try_read<R>(&self, read: impl FnOnce(&Inner) -> io::Result<R>) -> io::Result<R> {
        #[cfg(not(unix))]
        let read = || read(&self.watched);
        self.watched.try_io(Interest::READABLE, read)
    }

    pub(super) fn try_recv(&self, room: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        #[cfg(unix)]
        let received = self.try_read(|socket| socket.recv_from(room));
        #[cfg(not(unix))]
        let received = self.watched.try_recv_from(room);
        received
    }

    /// Waits until something may have arrived.
    ///
    /// # Errors
    /// If the runtime shuts down.
    pub fn poll_read_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        #[cfg(unix)]
        let ready = self.watched.poll_read_ready(cx).map_ok(drop);
        #[cfg(not(unix))]
        let ready = self.watched.poll_recv_ready(cx);
        ready
    }

    /// Waits until a full socket may have room again.
    ///
    /// # Errors
    /// If the runtime shuts down.
    #[cfg(unix)]
    pub fn poll_room(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let full = match &mut self.full {
            Some(full) => full,
            none => {
                let copy = self.watched.get_ref().try_clone()?;
                none.insert(super::watch::watch(copy, Interest::WRITABLE)?)
            }
        };
        full.poll_write_ready(cx)
            .map_ok(|mut ready| ready.clear_ready())
    }

    /// Waits until a full socket may have room again.
    ///
    /// # Errors
    /// If the runtime shuts down.
    #[cfg(not(unix))]
    pub fn poll_room(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        // The socket was full; the runtime does not know it yet.
        let full = || Err::<(), _>(io::ErrorKind::WouldBlock.into());
        let _ = self.watched.try_io(Interest::WRITABLE, full);
        self.watched.poll_send_ready(cx)
    }

    /// Call this when nothing is left to send.
    pub fn rest(&mut self) {
        #[cfg(unix)]
        let _ = self.full.take();
    }
}
