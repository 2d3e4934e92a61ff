//! The reading side of a connection: octets in, whole records out.

use std::mem::MaybeUninit;
use std::pin::{Pin, pin};
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead, AsyncReadExt, ReadBuf};

use super::record::RecordError;
use super::stream::ReadHalf;
use super::{Assembler, Body, Error};

/// Octets read at once, unless a large record is on its way. They stand on the stack, so that a
/// connection on which nothing happens has no buffer at all.
const CHUNK: usize = 16 << 10;

/// What is read from the other side.
#[derive(Debug)]
pub(crate) struct Connection {
    stream: ReadHalf,
    assembler: Assembler,
}

impl Connection {
    /// A connection whose other side may say records of at most `limit` octets.
    pub(crate) const fn new(stream: ReadHalf, limit: usize) -> Self {
        Self {
            stream,
            assembler: Assembler::new(limit),
        }
    }

    /// From now on records may be that long.
    pub(crate) const fn set_limit(&mut self, limit: usize) {
        self.assembler.set_limit(limit);
    }

    /// Reads once, and gives whole records to `each`. Pending if nothing has arrived.
    pub(crate) fn poll_read(
        &mut self,
        cx: &mut Context<'_>,
        mut each: impl FnMut(Body<'_>) -> Result<(), RecordError>,
    ) -> Poll<Result<(), Error>> {
        let failed = |source| Error::io("reading from the local link")(source);
        if let Some(mut room) = self.assembler.room() {
            let read = ready!(pin!(self.stream.read_buf(&mut room)).poll(cx));
            if read.map_err(failed)? == 0 {
                return Poll::Ready(Err(Error::Closed));
            }
            if let Some(body) = self.assembler.filled() {
                each(body)?;
            }
            return Poll::Ready(Ok(()));
        }
        let mut chunk = [const { MaybeUninit::uninit() }; CHUNK];
        let mut chunk = ReadBuf::uninit(&mut chunk);
        let begun = self.assembler.begun();
        chunk.put_slice(begun);
        let before = begun.len();
        ready!(Pin::new(&mut self.stream).poll_read(cx, &mut chunk)).map_err(failed)?;
        if chunk.filled().len() == before {
            return Poll::Ready(Err(Error::Closed));
        }
        Poll::Ready(
            self.assembler
                .take(chunk.filled(), each)
                .map_err(Error::Record),
        )
    }
}
