//! Takes a stream apart into records.

use bytes::{Buf, Bytes, BytesMut};

use super::record::{LENGTH, Record, RecordError};

/// Up to this length a record is copied out of what was read, so that a small payload that is kept
/// does not hold on to a large buffer. A longer one gets a buffer of its own.
const COPIED: usize = 4096;

/// Octets in, in any pieces; records out.
#[derive(Debug)]
pub struct Assembler {
    /// The longest record, in octets without its length.
    limit: usize,
    /// The octets that were not taken out yet, and behind them room for the rest of a long record.
    buffer: BytesMut,
    /// How many octets have arrived.
    filled: usize,
}

impl Assembler {
    /// For records of at most `limit` octets.
    #[must_use]
    pub fn new(limit: usize) -> Self {
        Self {
            limit,
            buffer: BytesMut::new(),
            filled: 0,
        }
    }

    /// From now on records may have that many octets.
    pub const fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// Takes in what has arrived.
    pub fn append(&mut self, octets: &[u8]) {
        self.buffer.truncate(self.filled);
        self.buffer.extend_from_slice(octets);
        self.filled = self.buffer.len();
    }

    /// If a long record has begun, where the rest of it is best read to. Then call
    /// [`advance`](Self::advance).
    pub fn room(&mut self) -> Option<&mut [u8]> {
        let room = self.buffer.get_mut(self.filled..);
        room.filter(|room| !room.is_empty())
    }

    /// So many octets of the room were filled.
    pub fn advance(&mut self, octets: usize) {
        self.filled = self.buffer.len().min(self.filled + octets);
    }

    /// The next record, or `None` if it has not arrived in full. An assembler that waits for a new
    /// record holds no memory.
    ///
    /// # Errors
    /// A record that is too long or cannot be read: nothing behind it can be trusted.
    pub fn next_record(&mut self) -> Result<Option<Record>, RecordError> {
        let Some(length) = self.buffer[..self.filled].first_chunk() else {
            if self.filled == 0 {
                self.buffer = BytesMut::new();
            }
            return Ok(None);
        };
        let (length, limit) = (u32::from_le_bytes(*length) as usize, self.limit);
        if length > limit {
            return Err(RecordError::TooLong { length, limit });
        }
        let end = LENGTH + length;
        if self.filled < end {
            if length > COPIED && self.buffer.len() < end {
                // Zeros from the operating system, which takes memory only for what is written.
                let mut whole = BytesMut::zeroed(end);
                whole[..self.filled].copy_from_slice(&self.buffer[..self.filled]);
                self.buffer = whole;
            }
            return Ok(None);
        }
        self.filled -= end;
        let octets = if length > COPIED {
            self.buffer.split_to(end).freeze().slice(LENGTH..)
        } else {
            let octets = Bytes::copy_from_slice(&self.buffer[LENGTH..end]);
            self.buffer.advance(end);
            octets
        };
        Record::decode(octets).map(Some)
    }
}
