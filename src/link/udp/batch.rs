//! Several datagrams with one call into the kernel: Linux's generic segmentation and receive
//! offload (GSO, GRO), `sendmmsg` and `recvmmsg`.
//!
//! A call costs far more than a datagram's octets. So a large message leaves as one batch of equal
//! datagrams, which the kernel (or the network card) takes apart, and arrives as one, which we take
//! apart; small datagrams to several peers leave together; and several are fetched at a time.

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

use rustix::net::{MMsgHdr, SendAncillaryBuffer, SendFlags, SocketAddrAny, sendmmsg};

use super::gso_batch::GsoBatch;
use super::socket::Socket;
use crate::link::Slab;
use crate::link::slab::LONGEST;

/// Datagrams, or batches of them, that one call fetches. Each needs room for the longest.
const FETCHED: usize = 8;

/// Lets the kernel hand over datagrams of one sender in batches.
pub(super) fn prepare(socket: &UdpSocket) {
    if let Err(error) = setsockopt(socket, sockopt::UdpGroSegment, &true) {
        // Linux before 5.0. They come one by one then.
        tracing::debug!(%error, "batched receive is unavailable");
    }
}

/// Sends a batch of datagrams of `segment` octets each, of which the last may be shorter. All of
/// it goes or nothing.
pub(super) fn send(
    socket: &UdpSocket,
    peer: SocketAddr,
    batch: &[u8],
    segment: u16,
) -> io::Result<usize> {
    let peer = SockaddrStorage::from(peer);
    let segment = ControlMessage::UdpGsoSegments(&segment);
    let octets = [IoSlice::new(batch)];
    let flags = MsgFlags::MSG_DONTWAIT;
    Ok(sendmsg(
        socket.as_raw_fd(),
        &octets,
        &[segment],
        flags,
        Some(&peer),
    )?)
}

/// Sends batches of one datagram each with one call; how many were taken, which is at least one.
///
/// # Errors
/// Of the first; the kernel reports that of a later one with the next call.
pub(super) fn send_many<'a>(
    socket: &UdpSocket,
    datagrams: impl Iterator<Item = &'a GsoBatch> + Clone,
) -> io::Result<usize> {
    let octets: Vec<_> = datagrams
        .clone()
        .map(|d| [IoSlice::new(&d.octets)])
        .collect();
    let peers: Vec<SocketAddrAny> = datagrams.map(|d| d.peer.into()).collect();
    let mut controls: Vec<_> = peers
        .iter()
        .map(|_| SendAncillaryBuffer::default())
        .collect();
    let parts = peers.iter().zip(&octets).zip(&mut controls);
    let mut headers: Vec<_> = parts
        .map(|((peer, octets), control)| MMsgHdr::new_with_addr(peer, octets, control))
        .collect();
    Ok(sendmmsg(socket, &mut headers, SendFlags::DONTWAIT)?)
}

/// If the error means that a batch was refused because it is one: the most octets of each datagram
/// of batches that may yet be taken.
pub(super) fn limit_after(error: &io::Error, segment: usize) -> Option<usize> {
    match Errno::from_raw(error.raw_os_error()?) {
        // A network card without checksums; an old kernel.
        Errno::EIO | Errno::EOPNOTSUPP | Errno::ENOPROTOOPT => Some(0),
        // A datagram does not fit a frame, so that it would have to be fragmented.
        Errno::EINVAL | Errno::EMSGSIZE => Some(segment - 1),
        _ => None,
    }
}

/// Fetches what has arrived, up to [`FETCHED`] batches.
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
    for batch in fetched {
        count += 1;
        let Some(peer) = batch.address.as_ref().and_then(address) else {
            continue;
        };
        let segment = segment(&batch);
        let octets = batch.iovs().next().unwrap_or_default();
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

/// The octets of each datagram of a batch but the last.
fn segment(batch: &RecvMsg<'_, '_, SockaddrStorage>) -> usize {
    let segment = batch.cmsgs().ok().and_then(|mut messages| {
        messages.find_map(|message| match message {
            ControlMessageOwned::UdpGroSegments(octets) => usize::try_from(octets).ok(),
            _ => None,
        })
    });
    segment.filter(|&octets| octets > 0).unwrap_or(LONGEST)
}

fn address(storage: &SockaddrStorage) -> Option<SocketAddr> {
    let v4 = storage.as_sockaddr_in().map(|&sin| sin.into());
    v4.or_else(|| storage.as_sockaddr_in6().map(|&sin6| sin6.into()))
}
