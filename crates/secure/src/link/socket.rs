//! The UDP socket of a secure link: several datagrams with one system call where the system can
//! (Linux: GSO, GRO and `recvmmsg`), and no IP fragments.

use std::io::{self, IoSliceMut};
use std::net::SocketAddr;
use std::task::{Context, Poll, ready};

use quinn_udp::{RecvMeta, UdpSocketState};
use tokio::io::Interest;
use tokio::net::UdpSocket;

use crate::transport::Datagrams;

/// Datagrams, or batches of them, to receive with one system call.
const SLOTS: usize = 8;
/// The longest datagram or batch, in octets.
const LONGEST: usize = 1 << 16;
/// The most datagrams to send with one system call. With the longest ones of QUIC (1452 octets) they
/// stay below [`LONGEST`].
const MOST: usize = 32;

/// A bound socket. Must be used within a tokio runtime.
#[derive(Debug)]
pub(super) struct Socket {
    io: UdpSocket,
    state: UdpSocketState,
    /// Untouched memory takes no pages.
    buffer: Box<[u8]>,
}

impl Socket {
    pub(super) fn bind(address: SocketAddr) -> io::Result<Self> {
        let socket = std::net::UdpSocket::bind(address)?;
        socket.set_nonblocking(true)?;
        let io = UdpSocket::from_std(socket)?;
        Ok(Self {
            state: UdpSocketState::new((&io).into())?,
            io,
            buffer: vec![0; SLOTS * LONGEST].into(),
        })
    }

    pub(super) fn local_addr(&self) -> io::Result<SocketAddr> {
        self.io.local_addr()
    }

    /// The most datagrams that one call can send.
    pub(super) fn max_datagrams(&self) -> usize {
        self.state.max_gso_segments().min(MOST)
    }

    /// Sends datagrams to one peer; pending while the kernel has no room.
    pub(super) fn poll_send(
        &self,
        cx: &mut Context<'_>,
        datagrams: &Datagrams,
    ) -> Poll<io::Result<()>> {
        let transmit = quinn_udp::Transmit {
            destination: datagrams.to,
            ecn: None,
            contents: &datagrams.octets,
            segment_size: datagrams.segment,
            src_ip: None,
        };
        loop {
            ready!(self.io.poll_send_ready(cx))?;
            let sent = self.io.try_io(Interest::WRITABLE, || {
                self.state.try_send((&self.io).into(), &transmit)
            });
            match sent {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                result => return Poll::Ready(result),
            }
        }
    }

    /// Receives with one system call, and passes each datagram to `each`.
    pub(super) fn poll_receive(
        &mut self,
        cx: &mut Context<'_>,
        mut each: impl FnMut(SocketAddr, &[u8]),
    ) -> Poll<io::Result<()>> {
        let mut metas = [RecvMeta::default(); SLOTS];
        let received = loop {
            ready!(self.io.poll_recv_ready(cx))?;
            let mut slots = self.buffer.chunks_exact_mut(LONGEST);
            let mut slots: [_; SLOTS] =
                std::array::from_fn(|_| IoSliceMut::new(slots.next().unwrap_or_default()));
            let received = self.io.try_io(Interest::READABLE, || {
                self.state.recv((&self.io).into(), &mut slots, &mut metas)
            });
            match received {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                result => break result?,
            }
        };
        for (slot, meta) in self.buffer.chunks_exact(LONGEST).zip(&metas).take(received) {
            let octets = slot.get(..meta.len).unwrap_or_default();
            for datagram in octets.chunks(meta.stride.max(1)) {
                each(meta.addr, datagram);
            }
        }
        Poll::Ready(Ok(()))
    }
}
