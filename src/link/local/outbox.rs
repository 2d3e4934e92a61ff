//! Records on their way into a stream: small ones are collected, so that one write carries all that
//! waits; large payloads are not copied, they stand in line as they are.

use std::collections::VecDeque;
use std::io::{self, IoSlice};
use std::task::{Context, Poll};

use bytes::{Buf, Bytes};

use super::record::{Reply, Request};
use super::stream::WriteHalf;

/// Payloads from so many octets on are written from where they are.
const LARGE: usize = 8192;
/// The most pieces given to the kernel at once.
const PIECES: usize = 16;
/// Room for collected records that is kept when nothing waits.
const KEPT: usize = 1024;

/// What waits to be written.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    /// What goes first: finished collections and large payloads.
    pieces: VecDeque<Bytes>,
    /// The records collected after the last piece.
    last: Vec<u8>,
    /// Octets of `last` that are written already.
    written: usize,
    /// Octets that wait.
    waiting: usize,
    /// The most that `last` held since it was empty.
    most: usize,
}

impl Outbox {
    /// Octets that wait.
    pub(crate) const fn len(&self) -> usize {
        self.waiting
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.waiting == 0
    }

    pub(crate) fn request(&mut self, request: &Request) {
        let before = self.last.len();
        let payload = request.encode_head(&mut self.last);
        self.append(before, payload);
    }

    pub(crate) fn reply(&mut self, reply: &Reply) {
        let before = self.last.len();
        let payload = reply.encode_head(&mut self.last);
        self.append(before, payload);
    }

    fn append(&mut self, before: usize, payload: Option<&Bytes>) {
        self.waiting += self.last.len() - before;
        let Some(payload) = payload else { return };
        self.waiting += payload.len();
        if payload.len() < LARGE {
            self.last.extend_from_slice(payload);
            return;
        }
        let mut collected = Bytes::from(std::mem::take(&mut self.last));
        collected.advance(std::mem::take(&mut self.written));
        self.pieces.push_back(collected);
        self.pieces.push_back(payload.clone());
    }

    /// Writes as much as the stream takes without waiting.
    pub(crate) fn try_flush(&mut self, stream: &WriteHalf) -> io::Result<()> {
        while !self.is_empty() {
            match self.write(|pieces| stream.try_write(pieces)) {
                Ok(()) => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Writes all; pending while the stream takes no more.
    pub(crate) fn poll_flush(
        &mut self,
        stream: &mut WriteHalf,
        cx: &mut Context<'_>,
    ) -> Poll<io::Result<()>> {
        while !self.is_empty() {
            let mut blocked = false;
            let result = self.write(|pieces| match stream.poll_write(cx, pieces) {
                Poll::Ready(result) => result,
                Poll::Pending => {
                    blocked = true;
                    Ok(0)
                }
            });
            match result {
                _ if blocked => return Poll::Pending,
                Ok(()) => {}
                Err(error) => return Poll::Ready(Err(error)),
            }
        }
        stream.rest();
        Poll::Ready(Ok(()))
    }

    fn write(&mut self, write: impl FnOnce(&[IoSlice<'_>]) -> io::Result<usize>) -> io::Result<()> {
        let mut pieces = [IoSlice::new(&[]); PIECES];
        let last = self.last.get(self.written..).unwrap_or_default();
        let waiting = self.pieces.iter().map(|piece| &piece[..]).chain([last]);
        let mut count = 0;
        for (slot, piece) in pieces.iter_mut().zip(waiting) {
            *slot = IoSlice::new(piece);
            count += 1;
        }
        let written = write(&pieces[..count])?;
        self.advance(written);
        Ok(())
    }

    fn advance(&mut self, mut written: usize) {
        self.waiting -= written;
        while let Some(piece) = self.pieces.front_mut() {
            if written < piece.len() {
                piece.advance(written);
                return;
            }
            written -= piece.len();
            self.pieces.pop_front();
        }
        self.written += written;
        if self.waiting == 0 {
            self.rest();
        }
    }

    /// Nothing waits: keeps the room that was needed lately, and gives back the rest.
    fn rest(&mut self) {
        self.most = self.last.len().max(self.most / 2);
        self.last.clear();
        self.written = 0;
        if self.last.capacity() > KEPT.max(4 * self.most) {
            self.last.shrink_to(KEPT.max(self.most));
        }
        if self.pieces.capacity() > PIECES {
            self.pieces = VecDeque::new();
        }
    }
}
