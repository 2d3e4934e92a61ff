//! Batched UDP system calls on Linux: generic segmentation and receive offload (GSO, GRO),
//! `sendmmsg` and `recvmmsg`.
//!
//! A system call costs far more than the octets of a datagram. So a large message is sent as one
//! batch of equal datagrams, which the kernel or the network card splits, and is received as one
//! batch, which this module splits. Small datagrams share a `sendmmsg` call, whatever their peers,
//! and one `recvmmsg` call fetches several.

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

use crate::link::Slab;
use crate::link::slab::LONGEST;
use crate::link::socket::Socket;

/// Limit of datagrams or batches per `recvmmsg` call. Each needs a slot of [`LONGEST`] octets.
const FETCHED: usize = 8;

/// Enables GRO: the kernel may deliver datagrams of one sender in batches.
pub(super) fn prepare(socket: &UdpSocket) {
    if let Err(error) = setsockopt(socket, sockopt::UdpGroSegment, &true) {
        // Linux before 5.0, which delivers them one by one.
        tracing::debug!(%error, "batched receive is unavailable");
    }
}

/// Sends a batch of datagrams of `segment` octets each; the last may be shorter. The kernel takes
/// all of the batch or nothing.
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

/// Sends batches of one datagram each with one call. Returns how many the kernel took, at least
/// one.
///
/// # Errors
/// The error of the first datagram. The kernel reports that of a later one in the next call.
pub(super) fn send_many<'a>(
    socket: &UdpSocket,
    datagrams: impl Iterator<Item = (SocketAddr, &'a Bytes)> + Clone,
) -> io::Result<usize> {
    let octets: Vec<_> = datagrams
        .clone()
        .map(|(_, octets)| [IoSlice::new(octets)])
        .collect();
    let peers: Vec<SocketAddrAny> = datagrams.map(|(peer, _)| peer.into()).collect();
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

/// The new limit of a batched datagram's length, in octets, if the kernel rejected the batch as
/// such; `None` for other errors.
pub(super) fn limit_after(error: &io::Error, segment: usize) -> Option<usize> {
    match Errno::from_raw(error.raw_os_error()?) {
        // A network card without checksum offload, or an old kernel.
        Errno::EIO | Errno::EOPNOTSUPP | Errno::ENOPROTOOPT => Some(0),
        // The datagrams do not fit one frame, and GSO does not fragment them.
        Errno::EINVAL | Errno::EMSGSIZE => Some(segment - 1),
        _ => None,
    }
}

/// Receives up to [`FETCHED`] datagrams or batches.
///
/// # Errors
/// `WouldBlock` if none has arrived.
pub(super) fn receive(
    socket: &Socket,
    slab: &mut Slab,
    arrived: &mut VecDeque<(SocketAddr, Bytes)>,
) -> io::Result<()> {
    let result = socket.try_read(|socket| {
        if fetch(socket, slab, arrived)? < FETCHED {
            // The socket is empty; this spares a call that would only confirm it.
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
    // Not reused: the kernel overwrites their lengths, which would have to be reset.
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

/// The length in octets of each datagram of a batch except the last.
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
