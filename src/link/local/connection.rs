//! The reading side of a connection: octets in, whole records out.

use std::cell::RefCell;
use std::task::{Context, Poll, ready};

use super::record::RecordError;
use super::stream::ReadHalf;
use super::{Assembler, Body, Error};

/// Octets read at once, unless a large record is on its way.
const CHUNK: usize = 16 << 10;

thread_local! {
    /// What is read into. All connections of a thread share it, so that one on which nothing
    /// happens has no buffer at all.
    static SHARED: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

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
        if let Some((buffer, missing)) = self.assembler.room() {
            let read = ready!(self.stream.poll_append(cx, buffer, missing));
            if read.map_err(failed)? == 0 {
                return Poll::Ready(Err(Error::Closed));
            }
            if let Some(body) = self.assembler.filled() {
                each(body)?;
            }
            return Poll::Ready(Ok(()));
        }
        let mut chunk = SHARED.take();
        chunk.resize(CHUNK, 0);
        let result = self.poll_chunk(cx, &mut chunk, each);
        SHARED.set(chunk);
        result
    }

    fn poll_chunk(
        &mut self,
        cx: &mut Context<'_>,
        chunk: &mut [u8],
        each: impl FnMut(Body<'_>) -> Result<(), RecordError>,
    ) -> Poll<Result<(), Error>> {
        let begun = self.assembler.begun().len();
        let (before, room) = chunk.split_at_mut(begun);
        let read = ready!(self.stream.poll_read(cx, room)).map_err(failed)?;
        if read == 0 {
            return Poll::Ready(Err(Error::Closed));
        }
        before.copy_from_slice(self.assembler.begun());
        let taken = self.assembler.take(&chunk[..begun + read], each);
        Poll::Ready(taken.map_err(Error::Record))
    }
}

fn failed(source: std::io::Error) -> Error {
    Error::io("reading from the local link")(source)
}
