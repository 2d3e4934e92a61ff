//! Both halves of a Unix stream, which wait [only for what they need](crate::link::watch).

use std::io::{self, ErrorKind, IoSlice, Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use crate::link::watch::watch;

/// The half that is read.
#[derive(Debug)]
pub(crate) struct UnixReadHalf(AsyncFd<Arc<UnixStream>>);

/// The half that is written.
#[derive(Debug)]
pub(crate) struct UnixWriteHalf {
    stream: Arc<UnixStream>,
    /// What is waited for while the socket is full.
    full: Option<AsyncFd<UnixStream>>,
}

pub(super) fn halves(stream: tokio::net::UnixStream) -> io::Result<(UnixReadHalf, UnixWriteHalf)> {
    let stream = Arc::new(stream.into_std()?);
    let read = watch(stream.clone(), Interest::READABLE)?;
    let full = None;
    Ok((UnixReadHalf(read), UnixWriteHalf { stream, full }))
}

impl UnixReadHalf {
    /// Reads once; 0 octets mean the end.
    pub(super) fn poll_read(
        &self,
        cx: &mut Context<'_>,
        buffer: &mut [u8],
    ) -> Poll<io::Result<usize>> {
        let room = buffer.len();
        self.poll_once(cx, room, |mut stream| stream.read(buffer))
    }

    /// Appends up to `most` octets to a buffer; 0 mean the end.
    pub(super) fn poll_append(
        &self,
        cx: &mut Context<'_>,
        buffer: &mut Vec<u8>,
        most: usize,
    ) -> Poll<io::Result<usize>> {
        let before = buffer.len();
        self.poll_once(cx, most, |stream| {
            match stream.take(most as u64).read_to_end(buffer) {
                Err(error) if buffer.len() == before => Err(error),
                // What is wrong is said again the next time.
                _ => Ok(buffer.len() - before),
            }
        })
    }

    fn poll_once(
        &self,
        cx: &mut Context<'_>,
        room: usize,
        mut read: impl FnMut(&UnixStream) -> io::Result<usize>,
    ) -> Poll<io::Result<usize>> {
        loop {
            let mut ready = ready!(self.0.poll_read_ready(cx))?;
            match ready.try_io(|stream| read(stream.get_ref())) {
                Ok(Err(error)) if error.kind() == ErrorKind::Interrupted => {}
                Ok(result) => {
                    if result.as_ref().is_ok_and(|&octets| octets < room) {
                        // It is empty now, and whatever comes is told. (So is the end, which may
                        // have come already.)
                        ready.clear_ready();
                    }
                    return Poll::Ready(result);
                }
                Err(_would_block) => {}
            }
        }
    }
}

impl UnixWriteHalf {
    /// Writes as much as can be written without waiting.
    pub(super) fn try_write(&self, pieces: &[IoSlice<'_>]) -> io::Result<usize> {
        (&*self.stream).write_vectored(pieces)
    }

    pub(super) fn poll_write(
        &mut self,
        cx: &mut Context<'_>,
        pieces: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        loop {
            let Some(full) = &self.full else {
                match self.try_write(pieces) {
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    Err(error) if error.kind() == ErrorKind::WouldBlock => {
                        let copy = self.stream.try_clone()?;
                        self.full = Some(watch(copy, Interest::WRITABLE)?);
                    }
                    result => return Poll::Ready(result),
                }
                continue;
            };
            let mut ready = ready!(full.poll_write_ready(cx))?;
            match ready.try_io(|stream| stream.get_ref().write_vectored(pieces)) {
                Ok(Err(error)) if error.kind() == ErrorKind::Interrupted => {}
                Ok(result) => return Poll::Ready(result),
                Err(_would_block) => {}
            }
        }
    }

    /// Nothing waits to be written any more.
    pub(super) fn rest(&mut self) {
        self.full = None;
    }
}

impl Drop for UnixWriteHalf {
    /// The other side shall see the end, even while the half that is read is still held.
    fn drop(&mut self) {
        // An error means that it is closed already.
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}
