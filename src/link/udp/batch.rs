//! Several datagrams with one call into the kernel: Linux's generic segmentation and receive
//! offload (GSO, GRO) and `recvmmsg`.
//!
//! A call costs far more than a datagram's octets. So a large message leaves as one train of equal
//! datagrams, which the kernel (or the network card) takes apart, and arrives as one, which we take
//! apart; and small datagrams are fetched several at a time.

use std::collections::VecDeque;
use std::io::{self, IoSlice, IoSliceMut};
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::AsRawFd;

use bytes::Bytes;
use nix::errno::Errno;
use nix::sys::socket::{
    ControlMessage, ControlMessageOwned, MsgFlags, MultiHeaders, RecvMsg, SockaddrStorage,
    recvmmsg, sendmsg, setsockopt, sockopt,
};

use super::socket::Socket;
use crate::link::Slab;
use crate::link::slab::LONGEST;

/// Datagrams, or trains of them, that one call fetches. Each needs room for the longest.
const FETCHED: usize = 8;

/// Lets the kernel hand over datagrams of one sender in trains.
pub(super) fn prepare(socket: &UdpSocket) {
    if let Err(error) = setsockopt(socket, sockopt::UdpGroSegment, &true) {
        // Linux before 5.0. They come one by one then.
        tracing::debug!(%error, "no trains of datagrams are received");
    }
}

/// Sends a train of datagrams of `segment` octets each, of which the last may be shorter. All of
/// it goes or nothing.
pub(super) fn send(
    socket: &UdpSocket,
    peer: SocketAddr,
    train: &[u8],
    segment: u16,
) -> io::Result<usize> {
    let peer = SockaddrStorage::from(peer);
    let segment = ControlMessage::UdpGsoSegments(&segment);
    let octets = [IoSlice::new(train)];
    let flags = MsgFlags::MSG_DONTWAIT;
    Ok(sendmsg(
        socket.as_raw_fd(),
        &octets,
        &[segment],
        flags,
        Some(&peer),
    )?)
}

/// If the error means that a train was refused because it is one: the most octets of each datagram
/// of trains that may yet be taken.
pub(super) fn limit_after(error: &io::Error, segment: usize) -> Option<usize> {
    match Errno::from_raw(error.raw_os_error()?) {
        // A network card without checksums; an old kernel.
        Errno::EIO | Errno::EOPNOTSUPP | Errno::ENOPROTOOPT => Some(0),
        // A datagram does not fit a frame, so that it would have to be fragmented.
        Errno::EINVAL | Errno::EMSGSIZE => Some(segment - 1),
        _ => None,
    }
}

/// Fetches what has arrived, up to [`FETCHED`] trains.
///
/// # Errors
/// `WouldBlock` if nothing has arrived.
pub(super) fn receive(
    socket: &Socket,
    slab: &mut Slab,
    arrived: &mut VecDeque<(SocketAddr, Bytes)>,
) -> io::Result<()> {
    let result = socket.try_read(|socket| {
        if fetch(socket, slab, arrived)? < FETCHED {
            // There is no more, and no need to ask once more to know it.
            return Err(io::ErrorKind::WouldBlock.into());
        }
        Ok(())
    });
    match result {
        Err(e) if e.kind() != io::ErrorKind::WouldBlock || arrived.is_empty() => Err(e),
        _ => Ok(()),
    }
}

fn fetch(
    socket: &UdpSocket,
    slab: &mut Slab,
    arrived: &mut VecDeque<(SocketAddr, Bytes)>,
) -> io::Result<usize> {
    let room = slab.room_for(FETCHED);
    let mut slots = slots(room);
    // Not kept: the kernel writes lengths into them that would have to be put right again.
    let mut headers = MultiHeaders::preallocate(FETCHED, Some(nix::cmsg_space!(i32)));
    let flags = MsgFlags::MSG_DONTWAIT;
    let fetched = recvmmsg(
        socket.as_raw_fd(),
        &mut headers,
        slots.iter_mut(),
        flags,
        None,
    )?;
    let mut count = 0;
    for train in fetched {
        count += 1;
        let Some(peer) = train.address.as_ref().and_then(address) else {
            continue;
        };
        let segment = segment(&train);
        let octets = train.iovs().next().unwrap_or_default();
        if octets.is_empty() {
            arrived.push_back((peer, Bytes::new()));
        }
        for datagram in octets.chunks(segment) {
            arrived.push_back((peer, Bytes::copy_from_slice(datagram)));
        }
    }
    Ok(count)
}

fn slots(room: &mut [u8]) -> [[IoSliceMut<'_>; 1]; FETCHED] {
    let mut parts = room.chunks_exact_mut(LONGEST);
    std::array::from_fn(|_| [IoSliceMut::new(parts.next().unwrap_or_default())])
}

/// The octets of each datagram of a train but the last.
fn segment(train: &RecvMsg<'_, '_, SockaddrStorage>) -> usize {
    let told = train.cmsgs().ok().and_then(|mut messages| {
        messages.find_map(|message| match message {
            ControlMessageOwned::UdpGroSegments(octets) => usize::try_from(octets).ok(),
            _ => None,
        })
    });
    told.filter(|&octets| octets > 0).unwrap_or(LONGEST)
}

fn address(storage: &SockaddrStorage) -> Option<SocketAddr> {
    let v4 = storage.as_sockaddr_in().map(|&sin| sin.into());
    v4.or_else(|| storage.as_sockaddr_in6().map(|&sin6| sin6.into()))
}
