//! A UDP socket registered with the runtime: on Unix [for reading only](crate::link::watch), and
//! for writing only while its send buffer is full.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::task::{Context, Poll};

use tokio::io::Interest;

#[cfg(unix)]
type Watched = tokio::io::unix::AsyncFd<UdpSocket>;
#[cfg(not(unix))]
type Watched = tokio::net::UdpSocket;

/// A non-blocking UDP socket.
#[derive(Debug)]
pub(super) struct Socket {
    watched: Watched,
    /// A duplicate that is watched for writing while the socket is full.
    #[cfg(unix)]
    full: Option<Watched>,
}

#[cfg(unix)]
impl Socket {
    pub(super) fn new(socket: UdpSocket) -> io::Result<Self> {
        Ok(Self {
            watched: crate::link::watch::watch(socket, Interest::READABLE)?,
            full: None,
        })
    }

    /// The underlying socket.
    pub(super) fn get(&self) -> &UdpSocket {
        self.watched.get_ref()
    }

    /// Calls `read` if the socket is readable. If `read` returns `WouldBlock`, the socket counts as
    /// empty until more arrives.
    pub(super) fn try_read<R>(
        &self,
        read: impl FnOnce(&UdpSocket) -> io::Result<R>,
    ) -> io::Result<R> {
        self.watched.try_io(Interest::READABLE, read)
    }

    pub(super) fn try_recv(&self, room: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        self.try_read(|socket| socket.recv_from(room))
    }

    pub(super) fn poll_read_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.watched.poll_read_ready(cx).map_ok(drop)
    }

    /// Waits until a full socket may have room again.
    pub(super) fn poll_room(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let full = match &mut self.full {
            Some(full) => full,
            none => {
                let copy = self.watched.get_ref().try_clone()?;
                none.insert(crate::link::watch::watch(copy, Interest::WRITABLE)?)
            }
        };
        full.poll_write_ready(cx)
            .map_ok(|mut ready| ready.clear_ready())
    }

    /// Call this when nothing is left to send.
    pub(super) fn rest(&mut self) {
        self.full = None;
    }
}

#[cfg(not(unix))]
impl Socket {
    pub(super) fn new(socket: UdpSocket) -> io::Result<Self> {
        Ok(Self {
            watched: Watched::from_std(socket)?,
        })
    }

    pub(super) fn get(&self) -> &Watched {
        &self.watched
    }

    pub(super) fn try_recv(&self, room: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        self.watched.try_recv_from(room)
    }

    pub(super) fn poll_read_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.watched.poll_recv_ready(cx)
    }

    pub(super) fn poll_room(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        // The socket was full; the runtime does not know it yet.
        let full = || Err::<(), _>(io::ErrorKind::WouldBlock.into());
        let _ = self.watched.try_io(Interest::WRITABLE, full);
        self.watched.poll_send_ready(cx)
    }

    pub(super) fn rest(&mut self) {}
}
