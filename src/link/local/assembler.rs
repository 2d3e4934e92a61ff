//! Extracts records from a stream.

use std::cell::RefCell;
use std::mem::take;

use bytes::Bytes;

use super::record::{LENGTH, Record, RecordError};

/// Octets per read, except while a long record is arriving.
const CHUNK: usize = 16 << 10;
/// A record up to this length is copied out of the read buffer. A longer one gets its own buffer,
/// into which the rest of it is read.
const COPIED: usize = 4096;
/// That buffer grows as octets arrive, whatever length the record announces: to at most twice its
/// content, in steps of at least this size. Until octets arrive it takes address space but no
/// memory.
const GROWTH: usize = 2 << 20;

/// The smallest capacity of a buffer in the pool. The allocator reuses smaller ones by itself. For
/// larger ones it asks the kernel, which takes as long to provide the pages as to copy a message.
const POOLED: usize = 128 << 10;
/// Limit of the octets of buffers in a thread's pool.
const POOL_OCTETS: usize = 8 << 20;

thread_local! {
    /// The read buffer for the next assembler that reads.
    static SPARE: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    /// Buffers of long records, with their capacities. Those with no other reference are free.
    static POOL: RefCell<Vec<(usize, Bytes)>> = const { RefCell::new(Vec::new()) };
}

/// Assembles records from octets in any pieces. An assembler between records holds no buffer. Each
/// thread keeps a pool of buffers for long records, at most 8 MiB.
#[derive(Debug)]
pub struct Assembler {
    /// Limit of a record's length in octets, without the length field.
    limit: usize,
    /// The received octets. A long record has its own buffer, without the length field.
    buffer: Vec<u8>,
    /// Octets of it that were already extracted.
    taken: usize,
    /// The length of the long record in octets; 0 if there is none.
    long: usize,
}

impl Assembler {
    /// Accepts records of at most `limit` octets.
    #[must_use]
    pub const fn new(limit: usize) -> Self {
        Self {
            limit,
            buffer: Vec::new(),
            taken: 0,
            long: 0,
        }
    }

    /// Sets the limit of a record's length.
    pub const fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// The buffer to append the next octets to, with spare capacity for them.
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

    /// Call this when no octets have arrived for the [room](Self::room); releases an empty buffer.
    pub fn rest(&mut self) {
        if self.taken == self.buffer.len() && self.long == 0 {
            self.taken = 0;
            SPARE.set(take(&mut self.buffer));
        }
    }

    /// The next record, or `None` if it has not arrived in full.
    ///
    /// # Errors
    /// If a record is too long or does not decode. Nothing after it can be trusted.
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
            let record = Bytes::copy_from_slice(octets);
            self.taken += LENGTH + length;
            return Record::decode(record).map(Some);
        }
        if length > COPIED {
            let new = || Vec::with_capacity(length.min(GROWTH.max(2 * octets.len())));
            let mut long = reuse(length).unwrap_or_else(new);
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
        Record::decode(freeze(octets)).map(Some)
    }
}

/// A free buffer of the pool with at least that capacity, and at most twice as much.
fn reuse(length: usize) -> Option<Vec<u8>> {
    POOL.with_borrow_mut(|pool| {
        let fits = |capacity| (length..=length.saturating_mul(2)).contains(&capacity);
        let is_free = |(capacity, octets): &(usize, Bytes)| fits(*capacity) && octets.is_unique();
        let (_, octets) = pool.remove(pool.iter().position(is_free)?);
        let mut octets = octets.try_into_mut().ok()?;
        octets.clear();
        Some(octets.into())
    })
}

/// The octets of a buffer, which joins the pool in place of the oldest buffers.
fn freeze(buffer: Vec<u8>) -> Bytes {
    let capacity = buffer.capacity();
    let octets = Bytes::from(buffer);
    if (POOLED..=POOL_OCTETS).contains(&capacity) {
        POOL.with_borrow_mut(|pool| {
            while pool.iter().map(|(kept, _)| kept).sum::<usize>() + capacity > POOL_OCTETS {
                pool.remove(0);
            }
            pool.push((capacity, octets.clone()));
        });
    }
    octets
}

#[cfg(test)]
mod tests {
    use super::super::record::Head;
    use super::*;
    use crate::address::JausId;
    use crate::wire::Flags;

    #[test]
    fn one_that_waits_for_a_new_record_has_no_buffer() {
        let leave = Record::from(Head::Leave);
        let mut assembler = Assembler::new(100);
        leave.encode_head(assembler.room());
        assert_eq!(assembler.next_record(), Ok(Some(leave)));
        assert_eq!(assembler.next_record(), Ok(None));
        assert_eq!(assembler.buffer.capacity(), 0, "after a record");
        assembler.room();
        assembler.rest();
        assert_eq!(assembler.buffer.capacity(), 0, "after nothing has come");
    }

    #[test]
    fn the_buffer_of_a_long_record_is_used_again_once_nothing_refers_to_it() {
        let head = Head::Deliver {
            flags: Flags::default(),
            source: JausId::new(1, 1, 1),
            destination: JausId::new(1, 1, 2),
            sequence: 7,
            path: None,
        };
        let payload = Bytes::from(vec![7; 1 << 20]);
        let record = Record { head, payload };
        let mut assembler = Assembler::new(usize::MAX);
        let mut read = || {
            record.encode_head(assembler.room());
            assert_eq!(assembler.next_record(), Ok(None));
            assembler.room().extend_from_slice(&record.payload);
            assembler.next_record().unwrap().unwrap()
        };
        let (first, second) = (read(), read());
        assert_ne!(first.payload.as_ptr(), second.payload.as_ptr());
        assert_eq!((&first, &second), (&record, &record));
        let places = [first, second].map(|record| record.payload.as_ptr());
        let again = [read(), read()].map(|record| record.payload.as_ptr());
        assert_eq!(places, again);
    }

    #[test]
    fn the_pool_is_bounded() {
        let held: Vec<_> = (0..100).map(|_| freeze(vec![0; 1 << 20])).collect();
        assert_eq!(POOL.with_borrow(Vec::len), 8);
        drop(held);
        assert_eq!(reuse(400_000), None, "far too large");
        let large = freeze(vec![0; POOL_OCTETS + 1]);
        assert!(large.is_unique(), "not kept");
    }
}
