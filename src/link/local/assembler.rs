//! Whole records out of a stream of octets: they may come in any pieces.
//!
//! What arrives is looked at where it is; only the beginning of a record whose end is not there yet
//! is kept. A large record gets a buffer of its own, into which the rest can be read directly and
//! of which its payload then is a slice, so that a large message is copied by the kernel alone.
//! Such a buffer grows with what arrives, whatever the record's head announces.

use bytes::Bytes;

use super::record::{LENGTH, RecordError};

/// Records above so many octets get a buffer of their own.
const LARGE: usize = 4096;
/// A buffer grows by so many octets at least, and at most to twice what has arrived.
const GROWTH: usize = 256 << 10;

/// The octets of one record, without its length.
#[derive(Clone, Debug)]
pub enum Body<'a> {
    /// Somewhere in what was read; payloads are copied out.
    Small(&'a [u8]),
    /// In a buffer of its own; payloads are slices of it.
    Large(Bytes),
}

impl Body<'_> {
    /// All octets, beginning with the kind.
    #[must_use]
    pub fn octets(&self) -> &[u8] {
        match self {
            Self::Small(octets) => octets,
            Self::Large(octets) => octets,
        }
    }

    /// The octets from `at` on, to be kept.
    pub(super) fn payload(&self, at: usize) -> Bytes {
        match self {
            Self::Small(octets) => Bytes::copy_from_slice(octets.get(at..).unwrap_or_default()),
            Self::Large(octets) => octets.slice(at.min(octets.len())..),
        }
    }
}

/// Takes in pieces of a stream.
#[derive(Debug)]
pub struct Assembler {
    /// The longest record, in octets without its length.
    limit: usize,
    /// The beginning of a small record, with its length.
    begun: Vec<u8>,
    large: Option<Large>,
}

/// The beginning of a large record, without its length.
#[derive(Debug)]
struct Large {
    length: usize,
    octets: Vec<u8>,
}

impl Assembler {
    /// One that takes records of at most `limit` octets.
    #[must_use]
    pub const fn new(limit: usize) -> Self {
        Self {
            limit,
            begun: Vec::new(),
            large: None,
        }
    }

    /// From now on records may be that long.
    pub const fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// The beginning of a record, after which the octets that come next must stand when all goes to
    /// [`take`](Self::take). It is at most 4 KiB.
    #[must_use]
    pub fn begun(&self) -> &[u8] {
        &self.begun
    }

    /// A buffer to which the next octets are best appended, if a large record has begun: so many
    /// and not more. Then call [`filled`](Self::filled).
    pub fn room(&mut self) -> Option<(&mut Vec<u8>, usize)> {
        let large = self.large.as_mut()?;
        let missing = large.length - large.octets.len();
        let growth = missing.min(large.octets.len().max(GROWTH));
        if large.octets.capacity() == large.octets.len() {
            large.octets.reserve_exact(growth);
        }
        let room = large.octets.capacity() - large.octets.len();
        Some((&mut large.octets, missing.min(room)))
    }

    /// The large record, if all of it has come.
    pub fn filled(&mut self) -> Option<Body<'static>> {
        let whole = |large: &mut Large| large.octets.len() == large.length;
        let large = self.large.take_if(whole)?;
        Some(Body::Large(large.octets.into()))
    }

    /// Takes octets in, and gives each whole record to `each`. What is left of a record that has
    /// only begun is kept.
    ///
    /// # Errors
    /// A record that is too long, or what `each` says; then the stream cannot be read any further.
    pub fn take<E: From<RecordError>>(
        &mut self,
        mut octets: &[u8],
        mut each: impl FnMut(Body<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        while let Some((buffer, room)) = self.room() {
            let now = octets.len().min(room);
            buffer.extend_from_slice(&octets[..now]);
            octets = &octets[now..];
            match self.filled() {
                Some(body) => each(body)?,
                None if octets.is_empty() => return Ok(()),
                None => {}
            }
        }
        while let Some((head, rest)) = octets.split_first_chunk::<LENGTH>() {
            let length = u32::from_le_bytes(*head) as usize;
            if length > self.limit {
                let limit = self.limit;
                return Err(RecordError::TooLong { length, limit }.into());
            }
            match rest.split_at_checked(length) {
                Some((body, next)) => {
                    each(Body::Small(body))?;
                    octets = next;
                }
                None if length > LARGE => {
                    self.begin_large(length, rest);
                    return Ok(());
                }
                None => break,
            }
        }
        self.begun.clear();
        self.begun.extend_from_slice(octets);
        Ok(())
    }

    fn begin_large(&mut self, length: usize, beginning: &[u8]) {
        let mut octets = Vec::with_capacity(length.min(GROWTH.max(2 * beginning.len())));
        octets.extend_from_slice(beginning);
        self.begun.clear();
        self.large = Some(Large { length, octets });
    }
}
