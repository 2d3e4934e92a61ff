//! The sending half of a UDP link.

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll, ready};

use bytes::Bytes;
use socket2::SockRef;
use tokio::net::UdpSocket;

use super::UdpLink;
use crate::wire::Priority;

impl UdpLink {
    /// Sends a datagram to one peer. If the network takes nothing just now, the urgent go first
    /// when it does again.
    pub fn send_to(&mut self, peer: SocketAddr, priority: Priority, datagram: &Bytes) {
        // Straight to the socket: the runtime learns that a new socket can send only later.
        let straight = |socket: &UdpSocket| SockRef::from(socket).send_to(datagram, &peer.into());
        if !self.outbox.is_empty() || !self.try_send(peer, straight) {
            let waiting = (peer, datagram.clone());
            self.counters.send_overflows += self.outbox.push(priority, datagram.len(), waiting);
        }
    }

    /// Sends a datagram to the group, and a copy to each peer of [`set_peers`](Self::set_peers).
    pub fn send_to_group(&mut self, priority: Priority, datagram: &Bytes) {
        for i in 0..self.groups.len() {
            self.send_to(self.groups[i], priority, datagram);
        }
        for i in 0..self.peers.len() {
            self.send_to(self.peers[i], priority, datagram);
        }
    }

    /// Sends what waits for the network; ready when nothing waits.
    pub fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        while let Some((peer, datagram)) = self.outbox.first().cloned() {
            if self.try_send(peer, |socket| socket.try_send_to(&datagram, peer)) {
                self.outbox.pop();
            } else if ready!(self.unicast().poll_send_ready(cx)).is_err() {
                // The runtime is shutting down.
                return Poll::Ready(());
            }
        }
        Poll::Ready(())
    }

    /// Whether the datagram is dealt with: sent, or refused for good. `false` is "not now".
    fn try_send(
        &mut self,
        peer: SocketAddr,
        send: impl Fn(&UdpSocket) -> io::Result<usize>,
    ) -> bool {
        loop {
            match send(self.unicast()) {
                Ok(octets) => {
                    self.counters.sent += 1;
                    self.counters.sent_octets += octets as u64;
                    return true;
                }
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => return false,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => {
                    self.counters.send_errors += 1;
                    self.report("sending", Some(peer), &e);
                    return true;
                }
            }
        }
    }
}
