//! The receive path of a UDP link: polls all its sockets in turn, and drops our own echoes.

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll, ready};

use bytes::Bytes;

use super::UdpLink;
use crate::link::Slab;

impl UdpLink {
    /// Receives the next datagram, with its sender's address. Skips echoes of our own datagrams.
    pub fn poll_recv(
        &mut self,
        cx: &mut Context<'_>,
        slab: &mut Slab,
    ) -> Poll<(SocketAddr, Bytes)> {
        loop {
            if let Some((peer, datagram)) = self.arrived.pop_front() {
                if peer == self.local {
                    self.counters.own_echo += 1;
                    continue;
                }
                self.counters.received += 1;
                self.counters.received_octets += datagram.len() as u64;
                return Poll::Ready((peer, datagram));
            }
            ready!(self.poll_fetch(cx, slab));
        }
    }

    /// Whether the latest received datagram was sent to the group or broadcast address.
    #[must_use]
    pub const fn went_to_all(&self) -> bool {
        // The first socket is the unicast socket. On Windows the others may receive unicast too.
        self.fetched_from > 0 && !cfg!(windows)
    }

    /// Fetches datagrams from the first socket that has any.
    fn poll_fetch(&mut self, cx: &mut Context<'_>, slab: &mut Slab) -> Poll<()> {
        // Rotate the order, so that a flood on one socket does not starve the others.
        self.turn = (self.turn + 1) % self.sockets.len();
        for i in 0..self.sockets.len() {
            let socket = (self.turn + i) % self.sockets.len();
            if self.poll_fetch_from(socket, cx, slab).is_ready() {
                self.fetched_from = socket;
                return Poll::Ready(());
            }
        }
        Poll::Pending
    }

    fn poll_fetch_from(
        &mut self,
        socket: usize,
        cx: &mut Context<'_>,
        slab: &mut Slab,
    ) -> Poll<()> {
        loop {
            match self.fetch(socket, slab) {
                Ok(()) => return Poll::Ready(()),
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    if ready!(self.sockets[socket].poll_read_ready(cx)).is_err() {
                        // The runtime is shutting down.
                        return Poll::Pending;
                    }
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => {
                    self.counters.receive_errors += 1;
                    self.report("receiving", None, &e);
                    // Retry soon, but let other tasks run first.
                    cx.waker().wake_by_ref();
                    return Poll::Pending;
                }
            }
        }
    }

    fn fetch(&mut self, socket: usize, slab: &mut Slab) -> io::Result<()> {
        let socket = &self.sockets[socket];
        #[cfg(target_os = "linux")]
        if self.batch {
            return super::batch::receive(socket, slab, &mut self.arrived);
        }
        let room = slab.room_for(1);
        let (octets, peer) = socket.try_recv(room)?;
        let datagram = Bytes::copy_from_slice(room.get(..octets).unwrap_or_default());
        self.arrived.push_back((peer, datagram));
        Ok(())
    }
}
