//! The two halves of a local connection: a reader and a writer of records. Both sides use them.

use std::collections::VecDeque;
use std::future::poll_fn;
use std::io::{self, IoSlice};
use std::task::{Context, Poll, Waker, ready};

use bytes::{Buf, Bytes};

use super::record::{Record, RecordError};
use super::stream::{ReadHalf, WriteHalf};
use super::{Assembler, Error};

/// Consecutive reads before other tasks have their turn.
const TURN: usize = 4;
/// Payloads of at least this many octets are written without a copy.
const LARGE: usize = 8192;
/// Limit of pieces in one write.
const PIECES: usize = 16;
/// Octets collected before a sender writes them itself.
const COLLECTED: usize = 16 << 10;
/// Octets of memory that an idle connection keeps.
const KEPT: usize = 1024;

/// The reading half.
#[derive(Debug)]
pub(crate) struct Reader {
    stream: ReadHalf,
    assembler: Assembler,
    /// Reads since other tasks had their turn.
    reads: usize,
}

impl Reader {
    /// Accepts records of at most `limit` octets.
    pub(crate) fn new(stream: ReadHalf, limit: usize) -> Self {
        Self {
            stream,
            assembler: Assembler::new(limit),
            reads: 0,
        }
    }

    pub(crate) const fn set_limit(&mut self, limit: usize) {
        self.assembler.set_limit(limit);
    }

    /// The next record among the octets read so far, if complete.
    pub(crate) fn next_record(&mut self) -> Result<Option<Record>, RecordError> {
        self.assembler.next_record()
    }

    /// Waits for the next record.
    pub(crate) async fn read(&mut self) -> Result<Record, Error> {
        loop {
            if let Some(record) = self.next_record()? {
                return Ok(record);
            }
            self.fill(|| true).await?;
        }
    }

    /// Waits until octets arrive, and reads them. `may_read` is called on each wake-up.
    pub(crate) async fn fill(&mut self, may_read: impl Fn() -> bool) -> Result<(), Error> {
        if self.reads == TURN {
            self.reads = 0;
            tokio::task::yield_now().await;
        }
        poll_fn(|cx| {
            let read = if may_read() {
                self.stream.poll_read(cx, &mut self.assembler)
            } else {
                Poll::Pending
            };
            let Poll::Ready(read) = read else {
                self.reads = 0;
                self.assembler.rest();
                return Poll::Pending;
            };
            self.reads += 1;
            Poll::Ready(match read {
                Ok(0) => Err(Error::Closed),
                Ok(_) => Ok(()),
                Err(error) => Err(failed("reading from", error)),
            })
        })
        .await
    }
}

/// The writing half. It collects small records, so that one call writes many, and does not copy
/// large payloads.
#[derive(Debug, Default)]
pub(crate) struct Writer {
    /// `None` once it is closed.
    stream: Option<WriteHalf>,
    /// Written first: finished collections and large payloads.
    pieces: VecDeque<Bytes>,
    /// The records collected after the last piece.
    collected: Vec<u8>,
    /// Octets of `collected` that are already written.
    taken: usize,
    /// Octets that wait.
    waiting: usize,
    /// Octets written since the connection was opened.
    written: u64,
    /// Whether a sender has written since the task's turn.
    had_turn: bool,
    /// Whether the socket is full.
    is_full: bool,
    task: Option<Waker>,
}

impl Writer {
    pub(crate) fn new(stream: WriteHalf) -> Self {
        Self {
            stream: Some(stream),
            ..Self::default()
        }
    }

    pub(crate) const fn is_open(&self) -> bool {
        self.stream.is_some()
    }

    pub(crate) const fn len(&self) -> usize {
        self.waiting
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.waiting == 0
    }

    pub(crate) const fn written(&self) -> u64 {
        self.written
    }

    /// Queues a record. On a closed connection it is dropped.
    pub(crate) fn queue(&mut self, record: &Record) {
        if !self.is_open() {
            return;
        }
        let before = self.collected.len();
        record.encode_head(&mut self.collected);
        self.waiting += self.collected.len() - before + record.payload.len();
        if record.payload.len() < LARGE {
            self.collected.extend_from_slice(&record.payload);
            return;
        }
        let mut collected = Bytes::from(std::mem::take(&mut self.collected));
        collected.advance(std::mem::take(&mut self.taken));
        self.pieces.extend([collected, record.payload.clone()]);
    }

    /// Queues a record from outside the writing task.
    pub(crate) fn send(&mut self, record: &Record) {
        self.queue(record);
        self.wake_task();
    }

    /// Like [`send`](Self::send), but may write at once. The first record after the task's turn
    /// does, later ones when enough is collected: so a burst takes a few calls instead of one per
    /// record.
    pub(crate) fn send_now(&mut self, record: &Record) {
        self.queue(record);
        if !self.had_turn || self.waiting >= COLLECTED {
            self.had_turn = true;
            self.flush_now();
        }
        self.wake_task();
    }

    /// Writes queued octets, as far as the socket takes them.
    pub(crate) fn flush_now(&mut self) {
        if !self.is_full {
            // The task gets the error too, and handles it.
            let _ = self.try_flush();
        }
    }

    fn wake_task(&mut self) {
        if let Some(task) = self.task.take() {
            task.wake();
        }
    }

    /// Writes as much as the socket takes; returns whether nothing is left.
    pub(crate) fn try_flush(&mut self) -> Result<bool, Error> {
        self.is_full = false;
        while !self.is_empty() && !self.is_full {
            match self.write() {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.is_full = true,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(failed("writing to", error)),
                Ok((octets, is_all)) => {
                    self.advance(octets);
                    self.is_full = !is_all;
                }
            }
        }
        Ok(self.is_empty())
    }

    /// Writes everything. For the task that [`send`](Self::send) also wakes.
    pub(crate) fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), Error>> {
        self.await_more(cx);
        loop {
            if let Some(stream) = self.stream.as_mut().filter(|_| self.is_full) {
                ready!(stream.poll_room(cx)).map_err(|error| failed("writing to", error))?;
            }
            if self.try_flush()? {
                self.had_turn = false;
                return Poll::Ready(Ok(()));
            }
        }
    }

    /// Writes everything queued. For the sole owner of the connection.
    pub(crate) async fn flush(&mut self) -> Result<(), Error> {
        poll_fn(|cx| self.poll_flush(cx)).await
    }

    /// Registers the task to be woken by the next [`send`](Self::send).
    pub(crate) fn await_more(&mut self, cx: &Context<'_>) {
        match &self.task {
            Some(task) if task.will_wake(cx.waker()) => {}
            _ => self.task = Some(cx.waker().clone()),
        }
    }

    /// Drops the queue and the connection.
    pub(crate) fn close(&mut self) {
        let task = self.task.take();
        *self = Self {
            task,
            ..Self::default()
        };
    }

    /// Writes once; returns the number of octets, and whether the socket took all of them.
    fn write(&self) -> io::Result<(usize, bool)> {
        let Some(stream) = &self.stream else {
            return Err(io::ErrorKind::NotConnected.into());
        };
        let mut slices = [IoSlice::new(&[]); PIECES];
        let collected = self.collected.get(self.taken..).unwrap_or_default();
        let waiting = self.pieces.iter().map(|piece| &piece[..]);
        let (mut count, mut given) = (0, 0);
        for (slice, piece) in slices.iter_mut().zip(waiting.chain([collected])) {
            *slice = IoSlice::new(piece);
            count += 1;
            given += piece.len();
        }
        let written = stream.try_write(&slices[..count])?;
        Ok((written, written == given))
    }

    fn advance(&mut self, mut octets: usize) {
        self.waiting -= octets;
        self.written += octets as u64;
        while let Some(piece) = self.pieces.front_mut() {
            if octets < piece.len() {
                return piece.advance(octets);
            }
            octets -= piece.len();
            self.pieces.pop_front();
        }
        self.taken += octets;
        if self.waiting == 0 {
            self.taken = 0;
            self.collected.clear();
            self.collected.shrink_to(KEPT);
            self.pieces.shrink_to(PIECES);
            if let Some(stream) = &mut self.stream {
                stream.rest();
            }
        }
    }
}

/// Maps an error. A connection that was reset counts as closed.
fn failed(doing: &str, error: io::Error) -> Error {
    use io::ErrorKind::{BrokenPipe, ConnectionReset};
    match error.kind() {
        BrokenPipe | ConnectionReset => Error::Closed,
        _ => Error::io(format!("{doing} the local link"))(error),
    }
}
