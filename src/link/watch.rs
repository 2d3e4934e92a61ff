//! Sockets that the runtime watches for one thing only.
//!
//! Whoever waits for a socket to become writable is woken each time that the kernel has got rid of
//! something, although there was room all along: a Unix socket's sender when the other side reads,
//! a UDP socket's when a datagram has been taken in. With sockets that always wait for both (as
//! tokio's do), each message wakes its sender once more, for nothing: that is half of all wake-ups
//! of a round trip. So a socket is watched for reading alone, and a copy of it for writing only
//! while it is full.

use std::io;
use std::os::fd::AsRawFd;

use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

/// Has the runtime watch a socket that does not block.
#[allow(
    deprecated,
    reason = "the successor must be promised that the descriptor stays open as long as it is \
              watched, by an unsafe call; an owned standard socket, which is what is watched here, \
              keeps that promise by itself"
)]
pub(super) fn watch<S: AsRawFd>(socket: S, interest: Interest) -> io::Result<AsyncFd<S>> {
    AsyncFd::with_interest(socket, interest)
}
