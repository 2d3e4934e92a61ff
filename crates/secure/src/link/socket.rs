//! The UDP socket of a secure link: several datagrams with one system call where the system can
//! (Linux: GSO, GRO and `recvmmsg`), and no IP fragments.

use std::io::{self, IoSliceMut};
use std::net::SocketAddr;
use std::task::{Context, Poll, ready};

use jaus::link::socket::Socket as Watched;
use quinn_udp::{BATCH_SIZE, RecvMeta, UdpSocketState};

use crate::transport::Datagrams;

/// Datagrams, or batches of them, to receive with one system call.
const SLOTS: usize = 8;
/// The longest datagram or batch, in octets.
const LONGEST: usize = 1 << 16;
/// The most datagrams to send with one system call. With the longest ones of QUIC (1452 octets) they
/// stay below [`LONGEST`].
const MOST: usize = 32;

/// The receive buffer to request, in octets. In a flood it holds what arrives while the node is busy; the
/// system may grant less.
const RECEIVE_BUFFER: usize = 4 << 20;

/// A bound socket. Must be used within a tokio runtime.
#[derive(Debug)]
pub(super) struct Socket {
    io: Watched,
    state: UdpSocketState,
    /// Untouched memory takes no pages.
    buffer: Box<[u8]>,
}

impl Socket {
    pub(super) fn bind(address: SocketAddr) -> io::Result<Self> {
        let socket = std::net::UdpSocket::bind(address)?;
        socket.set_nonblocking(true)?;
        let state = UdpSocketState::new((&socket).into())?;
        state.set_recv_buffer_size((&socket).into(), RECEIVE_BUFFER)?;
        Ok(Self {
            state,
            io: Watched::new(socket)?,
            buffer: vec![0; SLOTS * LONGEST].into(),
        })
    }

    pub(super) fn local_addr(&self) -> io::Result<SocketAddr> {
        self.io.get().local_addr()
    }

    /// The most datagrams that one call can send.
    pub(super) fn max_datagrams(&self) -> usize {
        self.state.max_gso_segments().min(MOST)
    }

    /// Sends datagrams to one peer; pending while the kernel has no room.
    pub(super) fn poll_send(
        &mut self,
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
            match self.state.try_send(self.io.get().into(), &transmit) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    ready!(self.io.poll_room(cx))?;
                }
                result => return Poll::Ready(result),
            }
        }
    }

    /// Call this when nothing is left to send.
    pub(super) fn rest(&mut self) {
        self.io.rest();
    }

    /// Receives with one system call, and passes each datagram to `each`; pending if none has arrived.
    pub(super) fn poll_receive(
        &mut self,
        cx: &mut Context<'_>,
        mut each: impl FnMut(SocketAddr, &[u8]),
    ) -> Poll<io::Result<()>> {
        let mut metas = [RecvMeta::default(); SLOTS];
        let received = loop {
            match self.receive(&mut metas) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    ready!(self.io.poll_read_ready(cx))?;
                }
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

    /// Receives with one system call; returns the number of filled slots.
    fn receive(&mut self, metas: &mut [RecvMeta; SLOTS]) -> io::Result<usize> {
        let mut slots = self.buffer.chunks_exact_mut(LONGEST);
        let mut slots: [_; SLOTS] =
            std::array::from_fn(|_| IoSliceMut::new(slots.next().unwrap_or_default()));
        let mut received = 0;
        let result = self.io.try_read(|socket| {
            received = self.state.recv(socket.into(), &mut slots, metas)?;
            if received < SLOTS.min(BATCH_SIZE) {
                // The socket is empty; this spares a call that would only confirm it.
                return Err(io::ErrorKind::WouldBlock.into());
            }
            Ok(())
        });
        match result {
            Err(error) if error.kind() != io::ErrorKind::WouldBlock || received == 0 => Err(error),
            _ => Ok(received),
        }
    }
}
