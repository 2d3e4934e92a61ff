//! Takes a stream apart into records.

use bytes::{Buf, Bytes, BytesMut};

use super::record::{LENGTH, Record, RecordError};

/// Up to this length a record is copied out of what was read; a longer one gets a buffer of its own,
/// into which the rest of it is read.
const COPIED: usize = 4096;
/// That buffer grows with what arrives, whatever the record announces: to at most twice that, and by
/// so many octets at least.
const GROWTH: usize = 256 << 10;

/// Octets in, in any pieces; records out.
#[derive(Debug)]
pub struct Assembler {
    /// The longest record, in octets without its length.
    limit: usize,
    /// The octets that were not taken out yet.
    buffer: BytesMut,
    /// A long record that has begun, without its length.
    long: Vec<u8>,
    /// Octets that it will have; 0 if there is none.
    length: usize,
}

impl Assembler {
    /// For records of at most `limit` octets.
    #[must_use]
    pub fn new(limit: usize) -> Self {
        Self {
            limit,
            buffer: BytesMut::new(),
            long: Vec::new(),
            length: 0,
        }
    }

    /// From now on records may have that many octets.
    pub const fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// If a long record has begun, where the rest of it is to be appended, and how many octets may
    /// be at once.
    pub fn room(&mut self) -> Option<(&mut Vec<u8>, usize)> {
        let missing = self.length.saturating_sub(self.long.len());
        if missing == 0 {
            return None;
        }
        if self.long.capacity() == self.long.len() {
            let growth = missing.min(self.long.len().max(GROWTH));
            self.long.reserve_exact(growth);
        }
        let room = self.long.capacity() - self.long.len();
        Some((&mut self.long, missing.min(room)))
    }

    /// Takes in what has arrived, where no long record has begun.
    pub fn append(&mut self, octets: &[u8]) {
        self.buffer.extend_from_slice(octets);
    }

    /// The next record, or `None` if it has not arrived in full. An assembler that waits for a new
    /// record holds no memory.
    ///
    /// # Errors
    /// A record that is too long or cannot be read: nothing behind it can be trusted.
    pub fn next_record(&mut self) -> Result<Option<Record>, RecordError> {
        if self.length > 0 {
            if self.long.len() < self.length {
                return Ok(None);
            }
            self.length = 0;
            return Record::decode(std::mem::take(&mut self.long).into()).map(Some);
        }
        let Some(length) = self.buffer.first_chunk() else {
            if self.buffer.is_empty() {
                self.buffer = BytesMut::new();
            }
            return Ok(None);
        };
        let (length, limit) = (u32::from_le_bytes(*length) as usize, self.limit);
        if length > limit {
            return Err(RecordError::TooLong { length, limit });
        }
        match self.buffer.get(LENGTH..LENGTH + length) {
            Some(octets) => {
                let octets = Bytes::copy_from_slice(octets);
                self.buffer.advance(LENGTH + length);
                Record::decode(octets).map(Some)
            }
            None if length > COPIED => {
                let begun = &self.buffer[LENGTH..];
                self.long = Vec::with_capacity(length.min(GROWTH.max(2 * begun.len())));
                self.long.extend_from_slice(begun);
                self.length = length;
                self.buffer = BytesMut::new();
                Ok(None)
            }
            None => Ok(None),
        }
    }
}
