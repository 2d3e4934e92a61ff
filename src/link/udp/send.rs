//! The sending half of a UDP link: one queue, emptied with as few calls into the kernel as it takes.
//!
//! Datagrams wait, the urgent first, until the node has nothing more to send just now, or until
//! enough have come together. Then those to different peers leave with one call (`sendmmsg`), and
//! several of equal length to one peer as one batch that the kernel segments (GSO).

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll, ready};

use bytes::{Buf, Bytes};
use socket2::SockRef;

use super::UdpLink;
use super::gso_batch::GsoBatch;
use super::socket::Socket;
use crate::endpoint::{Remote, To, Transmit};
use crate::wire::Priority;

/// How many messages leave at once, and with one call if they are datagrams to different peers.
const BURST: usize = 64;

impl UdpLink {
    /// Queues what the endpoint gives out, for [`flush`](Self::flush).
    pub fn transmit(&mut self, transmit: &Transmit) {
        let (priority, octets) = (transmit.priority, &transmit.payload);
        match transmit.to {
            To::Peer(Remote::Socket(peer)) => {
                self.enqueue(peer, priority, octets, transmit.segment);
            }
            To::Group => self.enqueue_for_all(priority, octets, transmit.segment),
            // No peer of this link.
            To::Peer(Remote::Line) => {}
        }
    }

    /// Sends a datagram to one peer. If the network takes nothing just now, the urgent go first
    /// when it does again.
    pub fn send_to(&mut self, peer: SocketAddr, priority: Priority, datagram: &Bytes) {
        self.enqueue(peer, priority, datagram, None);
        self.flush();
    }

    /// Sends a datagram to the group, and a copy to each peer of [`set_peers`](Self::set_peers).
    pub fn send_to_group(&mut self, priority: Priority, datagram: &Bytes) {
        self.enqueue_for_all(priority, datagram, None);
        self.flush();
    }

    fn enqueue_for_all(&mut self, priority: Priority, octets: &Bytes, segment: Option<usize>) {
        for i in 0..self.groups.len() {
            self.enqueue(self.groups[i], priority, octets, segment);
        }
        for i in 0..self.peers.len() {
            self.enqueue(self.peers[i], priority, octets, segment);
        }
    }

    fn enqueue(
        &mut self,
        peer: SocketAddr,
        priority: Priority,
        octets: &Bytes,
        segment: Option<usize>,
    ) {
        let batch = GsoBatch {
            peer,
            octets: octets.clone(),
            segment: segment.unwrap_or(octets.len()).max(1),
        };
        self.counters.send_overflows += self.outbox.push(priority, octets.len(), batch);
        if self.outbox.len() >= BURST {
            self.flush();
        }
    }

    /// Sends what waits, unless the kernel has no room; whether nothing waits any more.
    pub fn flush(&mut self) -> bool {
        while !self.full {
            if self.leaving.is_empty() {
                let next = std::iter::from_fn(|| self.outbox.pop());
                self.leaving.extend(next.take(BURST));
            }
            if self.leaving.is_empty() {
                return true;
            }
            self.send_once();
        }
        false
    }

    /// Sends what waits for the network; ready when nothing waits.
    pub fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        while !self.flush() {
            if ready!(self.sockets[0].poll_room(cx)).is_err() {
                // The runtime is shutting down.
                return Poll::Ready(());
            }
            self.full = false;
        }
        self.sockets[0].rest();
        Poll::Ready(())
    }

    /// Gives the kernel what it takes with one call.
    fn send_once(&mut self) {
        self.counters.send_calls += 1;
        #[cfg(target_os = "linux")]
        if self.batch {
            let is_single = |batch: &&GsoBatch| batch.octets.len() <= batch.segment;
            let singles = self.leaving.iter().take_while(is_single);
            if singles.clone().nth(1).is_some() {
                return match super::batch::send_many(self.sockets[0].get(), singles) {
                    Ok(sent) => (0..sent).for_each(|_| self.complete_first(1)),
                    Err(error) => self.handle_refusal(1, &error),
                };
            }
        }
        let Some(first) = self.leaving.front() else {
            return;
        };
        let part = first.part(self.gso_limit);
        let datagrams = part.len().div_ceil(first.segment).max(1);
        match send(&self.sockets[0], first.peer, part, first.segment) {
            Ok(_) => self.complete_first(datagrams),
            Err(error) => self.handle_refusal(datagrams, &error),
        }
    }

    /// The kernel has taken so many datagrams of the first batch.
    fn complete_first(&mut self, datagrams: usize) {
        let octets = self.drop_first(datagrams);
        self.counters.sent += datagrams as u64;
        self.counters.sent_octets += octets as u64;
    }

    /// The kernel has not taken so many datagrams of the first batch: not now, not together, or not
    /// at all.
    fn handle_refusal(&mut self, datagrams: usize, error: &io::Error) {
        let Some(first) = self.leaving.front() else {
            return;
        };
        let peer = first.peer;
        match error.kind() {
            io::ErrorKind::WouldBlock => self.full = true,
            io::ErrorKind::Interrupted => {}
            _ => {
                #[cfg(target_os = "linux")]
                if datagrams > 1
                    && let Some(limit) = super::batch::limit_after(error, first.segment)
                {
                    self.gso_limit = limit;
                    let interface = &self.interface.name;
                    tracing::info!(interface, limit, %error, "batched send is unavailable; datagrams are sent one by one");
                    return;
                }
                self.counters.send_errors += datagrams as u64;
                self.report("sending", Some(peer), error);
                self.drop_first(datagrams);
            }
        }
    }

    /// Removes so many datagrams from the first batch; how many octets that were.
    fn drop_first(&mut self, datagrams: usize) -> usize {
        let Some(first) = self.leaving.front_mut() else {
            return 0;
        };
        let octets = first.octets.len().min(datagrams * first.segment);
        first.octets.advance(octets);
        if first.octets.is_empty() {
            self.leaving.pop_front();
        }
        octets
    }
}

/// Sends what leaves with one call.
fn send(socket: &Socket, peer: SocketAddr, part: &[u8], segment: usize) -> io::Result<usize> {
    #[cfg(target_os = "linux")]
    if part.len() > segment {
        // Longer ones are not segmented: see `MOST_OCTETS`.
        let segment = u16::try_from(segment).unwrap_or(u16::MAX);
        return super::batch::send(socket.get(), peer, part, segment);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = segment;
    SockRef::from(socket.get()).send_to(part, &peer.into())
}
