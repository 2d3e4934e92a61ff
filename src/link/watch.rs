//! Sockets that the runtime watches for reading or writing only.
//!
//! A task that waits for a socket to become writable is woken each time the kernel frees buffer
//! space, even if there was room all along: for a Unix socket when the other side reads, for a UDP
//! socket when the kernel has sent a datagram. With sockets that are always registered for both (as
//! tokio's are), each message wakes its sender once more, for nothing: half of all wake-ups of a
//! round trip. So a socket is watched only for reading, and a duplicate of it for writing only
//! while it is full.

use std::io;
use std::os::fd::AsRawFd;

use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

/// Registers a non-blocking socket with the runtime.
#[allow(
    deprecated,
    reason = "its successor needs an unsafe call that promises an open descriptor; the owned \
        standard socket watched here guarantees that"
)]
pub(super) fn watch<S: AsRawFd>(socket: S, interest: Interest) -> io::Result<AsyncFd<S>> {
    AsyncFd::with_interest(socket, interest)
}
