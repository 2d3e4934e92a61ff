//! The send path of a UDP link: one priority queue, flushed with as few system calls as possible.
//!
//! Datagrams are queued, most urgent first, until the node flushes the link or [`BURST`] entries
//! wait. Then single datagrams share a `sendmmsg` call, whatever their peers. Several datagrams of
//! equal length to one peer leave as a batch that the kernel splits (GSO).

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll, ready};

use bytes::{Buf, Bytes};
use socket2::SockRef;

use super::{MAX_SEGMENTS, UdpLink};
use crate::endpoint::{MOST_OCTETS, Remote, To, Transmit};
use crate::link::socket::Socket;
use crate::wire::Priority;

/// Queue length at which the link flushes at once; also the most datagrams per `sendmmsg` call.
const BURST: usize = 64;

/// Datagrams to one peer of `segment` octets each; the last may be shorter. One system call sends
/// them, and the kernel splits them (GSO).
#[derive(Clone, Debug)]
pub(super) struct GsoBatch {
    pub(super) peer: SocketAddr,
    pub(super) octets: Bytes,
    pub(super) segment: usize,
}

impl GsoBatch {
    /// The datagrams to send with the next call, if those of up to `limit` octets may share one.
    fn part(&self, limit: usize) -> &[u8] {
        let datagrams = match self.segment {
            segment if segment <= limit => (MOST_OCTETS / segment).clamp(1, MAX_SEGMENTS),
            _ => 1,
        };
        let octets = self.octets.len().min(datagrams * self.segment);
        &self.octets[..octets]
    }
}

impl UdpLink {
    /// Queues a datagram or batch from the endpoint, for [`flush`](Self::flush).
    pub fn transmit(&mut self, transmit: &Transmit) {
        let (priority, octets) = (transmit.priority, &transmit.payload);
        match transmit.to {
            To::Peer(Remote::Socket(peer)) => {
                self.enqueue(peer, priority, octets, transmit.segment);
            }
            To::Group => self.enqueue_for_all(priority, octets, transmit.segment),
            // Not a peer of this link.
            To::Peer(Remote::Line | Remote::Session(_)) => {}
        }
    }

    /// Sends a datagram to one peer. While the kernel's send buffer is full, the datagram waits in
    /// the priority queue.
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

    /// Sends queued datagrams until the kernel's send buffer is full; returns whether the queue is
    /// empty.
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

    /// Sends queued datagrams; ready when none is left.
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

    /// Makes one system call to send the first batch, or the single datagrams at the front.
    fn send_once(&mut self) {
        self.counters.send_calls += 1;
        #[cfg(target_os = "linux")]
        if self.batch {
            let is_single = |batch: &&GsoBatch| batch.octets.len() <= batch.segment;
            let singles = self.leaving.iter().take_while(is_single);
            let singles = singles.map(|batch| (batch.peer, &batch.octets));
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

    /// Removes and counts datagrams of the first batch that the kernel has taken.
    fn complete_first(&mut self, datagrams: usize) {
        let octets = self.drop_first(datagrams);
        self.counters.sent += datagrams as u64;
        self.counters.sent_octets += octets as u64;
    }

    /// Handles a send error of datagrams of the first batch: waits for room if the buffer is full,
    /// lowers the limit for batching if the batch was rejected as such, or else drops them.
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

    /// Removes datagrams from the first batch; returns their octets.
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

/// Sends one datagram, or several of `segment` octets as a batch.
fn send(socket: &Socket, peer: SocketAddr, part: &[u8], segment: usize) -> io::Result<usize> {
    #[cfg(target_os = "linux")]
    if part.len() > segment {
        // `MOST_OCTETS` is below `u16::MAX`, so longer datagrams never share a batch.
        let segment = u16::try_from(segment).unwrap_or(u16::MAX);
        return super::batch::send(socket.get(), peer, part, segment);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = segment;
    SockRef::from(socket.get()).send_to(part, &peer.into())
}
