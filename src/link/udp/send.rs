//! The sending half of a UDP link.

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll, ready};

use bytes::{Buf, Bytes};
use socket2::SockRef;

use super::socket::Socket;
use super::{LONGEST_TRAIN, UdpLink};
use crate::endpoint::{Remote, To, Transmit};
use crate::wire::Priority;

/// What the kernel takes at once, whatever the number of datagrams; a little less than it says,
/// for IPv6's longer headers.
const MOST_OCTETS: usize = 65_000;

/// Datagrams to one peer, of `segment` octets each, of which the last may be shorter.
#[derive(Clone, Debug)]
pub(super) struct Train {
    peer: SocketAddr,
    octets: Bytes,
    segment: usize,
}

impl UdpLink {
    /// Sends what the endpoint gives out.
    pub fn transmit(&mut self, transmit: &Transmit) {
        let (priority, octets) = (transmit.priority, &transmit.payload);
        match transmit.to {
            To::Peer(Remote::Socket(peer)) => {
                self.send_train(peer, priority, octets, transmit.segment);
            }
            To::Group => self.send_to_all(priority, octets, transmit.segment),
            // No peer of this link.
            To::Peer(Remote::Line) => {}
        }
    }

    /// Sends a datagram to one peer. If the network takes nothing just now, the urgent go first
    /// when it does again.
    pub fn send_to(&mut self, peer: SocketAddr, priority: Priority, datagram: &Bytes) {
        self.send_train(peer, priority, datagram, None);
    }

    /// Sends a datagram to the group, and a copy to each peer of [`set_peers`](Self::set_peers).
    pub fn send_to_group(&mut self, priority: Priority, datagram: &Bytes) {
        self.send_to_all(priority, datagram, None);
    }

    fn send_to_all(&mut self, priority: Priority, octets: &Bytes, segment: Option<usize>) {
        for i in 0..self.groups.len() {
            self.send_train(self.groups[i], priority, octets, segment);
        }
        for i in 0..self.peers.len() {
            self.send_train(self.peers[i], priority, octets, segment);
        }
    }

    fn send_train(
        &mut self,
        peer: SocketAddr,
        priority: Priority,
        octets: &Bytes,
        segment: Option<usize>,
    ) {
        let mut train = Train {
            peer,
            octets: octets.clone(),
            segment: segment.unwrap_or(octets.len()).max(1),
        };
        if !self.outbox.is_empty() || !self.try_send(&mut train) {
            let octets = train.octets.len();
            self.counters.send_overflows += self.outbox.push(priority, octets, train);
        }
    }

    /// Sends what waits for the network; ready when nothing waits.
    pub fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        while let Some(mut train) = self.outbox.first().cloned() {
            if self.try_send(&mut train) {
                self.outbox.pop();
                continue;
            }
            if let Some(first) = self.outbox.first_mut() {
                *first = train;
            }
            if ready!(self.unicast().poll_room(cx)).is_err() {
                // The runtime is shutting down.
                return Poll::Ready(());
            }
        }
        self.unicast().rest();
        Poll::Ready(())
    }

    /// Whether all of the train is dealt with: sent, or refused for good. `false` is "not now",
    /// and then what is left of it is what was not sent.
    fn try_send(&mut self, train: &mut Train) -> bool {
        loop {
            let part = train.part(self.train_limit);
            let datagrams = part.len().div_ceil(train.segment) as u64;
            match send(self.unicast(), train.peer, part, train.segment) {
                Ok(octets) => {
                    self.counters.sent += datagrams;
                    self.counters.sent_octets += octets as u64;
                }
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => return false,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                Err(e) => {
                    let limit = limit_after(&e, train.segment).filter(|_| datagrams > 1);
                    if let Some(limit) = limit {
                        self.shorten_trains(limit, &e);
                        continue;
                    }
                    self.counters.send_errors += datagrams;
                    self.report("sending", Some(train.peer), &e);
                }
            }
            let done = part.len();
            train.octets.advance(done);
            if train.octets.is_empty() {
                return true;
            }
        }
    }

    /// Longer datagrams leave one by one from now on.
    fn shorten_trains(&mut self, limit: usize, error: &io::Error) {
        self.train_limit = limit;
        let interface = &self.interface.name;
        tracing::info!(interface, limit, %error, "datagrams above the limit leave one by one");
    }
}

/// If the error means that trains of such datagrams cannot be sent: the most octets of those that
/// can, perhaps.
fn limit_after(error: &io::Error, segment: usize) -> Option<usize> {
    #[cfg(all(feature = "udp-batch", target_os = "linux"))]
    return super::batch::limit_after(error, segment);
    #[cfg(not(all(feature = "udp-batch", target_os = "linux")))]
    {
        let _ = (error, segment);
        None
    }
}

impl Train {
    /// What leaves with one call, if datagrams of up to `limit` octets may leave together.
    fn part(&self, limit: usize) -> &[u8] {
        let datagrams = if self.segment <= limit {
            (MOST_OCTETS / self.segment).clamp(1, LONGEST_TRAIN)
        } else {
            1
        };
        let octets = self.octets.len().min(datagrams * self.segment);
        &self.octets[..octets]
    }
}

/// Sends what leaves with one call.
fn send(socket: &Socket, peer: SocketAddr, part: &[u8], segment: usize) -> io::Result<usize> {
    #[cfg(all(feature = "udp-batch", target_os = "linux"))]
    if part.len() > segment {
        // Longer ones make no trains: see `MOST_OCTETS`.
        let segment = u16::try_from(segment).unwrap_or(u16::MAX);
        return super::batch::send(socket.get(), peer, part, segment);
    }
    #[cfg(not(all(feature = "udp-batch", target_os = "linux")))]
    let _ = segment;
    SockRef::from(socket.get()).send_to(part, &peer.into())
}
