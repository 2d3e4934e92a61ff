//! The receiving half of a UDP link.

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll, ready};

use bytes::Bytes;

use super::UdpLink;
use crate::link::Slab;

impl UdpLink {
    /// The next datagram and who sent it. Our own, heard again, are left out.
    pub fn poll_recv(
        &mut self,
        cx: &mut Context<'_>,
        slab: &mut Slab,
    ) -> Poll<(SocketAddr, Bytes)> {
        // Turn about, so that a flood on one socket does not silence the others.
        self.turn = (self.turn + 1) % self.sockets.len();
        for i in 0..self.sockets.len() {
            let socket = (self.turn + i) % self.sockets.len();
            if let Poll::Ready(datagram) = self.poll_recv_from(socket, cx, slab) {
                return Poll::Ready(datagram);
            }
        }
        Poll::Pending
    }

    fn poll_recv_from(
        &mut self,
        socket: usize,
        cx: &mut Context<'_>,
        slab: &mut Slab,
    ) -> Poll<(SocketAddr, Bytes)> {
        loop {
            let socket = &self.sockets[socket];
            match slab.receive(|free| socket.try_recv_buf_from(free)) {
                Ok(((_, peer), _)) if peer == self.local => self.counters.own_echo += 1,
                Ok(((_, peer), datagram)) => {
                    self.counters.received += 1;
                    self.counters.received_octets += datagram.len() as u64;
                    return Poll::Ready((peer, datagram));
                }
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    if ready!(socket.poll_recv_ready(cx)).is_err() {
                        return Poll::Pending;
                    }
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => {
                    self.counters.receive_errors += 1;
                    self.report("receiving", None, &e);
                    // Again soon, but not at the cost of everybody else.
                    cx.waker().wake_by_ref();
                    return Poll::Pending;
                }
            }
        }
    }
}
