//! Takes a stream apart into records.

use std::cell::RefCell;
use std::mem::take;

use bytes::Bytes;

use super::record::{LENGTH, Record, RecordError};

/// Octets read at once, unless a long record is on its way.
const CHUNK: usize = 16 << 10;
/// Up to this length a record is copied out of what was read; a longer one gets a buffer of its own,
/// into which the rest of it is read.
const COPIED: usize = 4096;
/// That buffer grows with what arrives, whatever the record announces: to at most twice that, and by
/// so many octets at least. Until octets arrive it takes addresses and no memory.
const GROWTH: usize = 2 << 20;

thread_local! {
    /// A buffer for the assembler that reads next.
    static SPARE: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Octets in, in any pieces; records out. One that waits for a new record has no buffer.
#[derive(Debug)]
pub struct Assembler {
    /// The longest record, in octets without its length.
    limit: usize,
    /// What has arrived. A long record has it for itself, without its length.
    buffer: Vec<u8>,
    /// Octets of it that were taken out.
    taken: usize,
    /// Octets that the long record will have; 0 if there is none.
    long: usize,
}

impl Assembler {
    /// For records of at most `limit` octets.
    #[must_use]
    pub const fn new(limit: usize) -> Self {
        Self {
            limit,
            buffer: Vec::new(),
            taken: 0,
            long: 0,
        }
    }

    /// From now on records may have that many octets.
    pub const fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// The buffer to whose end the next octets are to be appended, with spare capacity for them.
    pub fn room(&mut self) -> &mut Vec<u8> {
        if self.buffer.capacity() == 0 {
            self.buffer = SPARE.take();
            self.buffer.clear();
        }
        self.buffer.drain(..take(&mut self.taken));
        let length = self.buffer.len();
        if self.long == 0 {
            let more = CHUNK.saturating_sub(length).max(1);
            self.buffer.reserve_exact(more);
        } else if length == self.buffer.capacity() {
            let more = (self.long - length).min(length.max(GROWTH));
            self.buffer.reserve_exact(more);
        }
        &mut self.buffer
    }

    /// Nothing has come for the [room](Self::room).
    pub fn rest(&mut self) {
        if self.taken == self.buffer.len() && self.long == 0 {
            self.taken = 0;
            SPARE.set(take(&mut self.buffer));
        }
    }

    /// The next record, or `None` if it has not arrived in full.
    ///
    /// # Errors
    /// A record that is too long or cannot be read: nothing behind it can be trusted.
    pub fn next_record(&mut self) -> Result<Option<Record>, RecordError> {
        if self.long > 0 {
            return self.next_long();
        }
        let Some((length, octets)) = self.buffer[self.taken..].split_first_chunk() else {
            self.rest();
            return Ok(None);
        };
        let (length, limit) = (u32::from_le_bytes(*length) as usize, self.limit);
        if length > limit {
            return Err(RecordError::TooLong { length, limit });
        }
        if let Some(octets) = octets.get(..length) {
            let octets = Bytes::copy_from_slice(octets);
            self.taken += LENGTH + length;
            return Record::decode(octets).map(Some);
        }
        if length > COPIED {
            let mut long = Vec::with_capacity(length.min(GROWTH.max(2 * octets.len())));
            long.extend_from_slice(octets);
            SPARE.set(std::mem::replace(&mut self.buffer, long));
            (self.long, self.taken) = (length, 0);
        }
        Ok(None)
    }

    fn next_long(&mut self) -> Result<Option<Record>, RecordError> {
        if self.buffer.len() < self.long {
            return Ok(None);
        }
        let mut octets = take(&mut self.buffer);
        // The buffer may have had room for more than its record.
        self.buffer.extend_from_slice(&octets[self.long..]);
        octets.truncate(take(&mut self.long));
        Record::decode(octets.into()).map(Some)
    }
}
