//! A cursor over a received message.

use alloc::vec::Vec;

use bytes::Bytes;

use super::blob::FormattedBlob;
use super::error::{DecodeError, DecodeErrorKind};
use super::fixed::{Count, Fixed};
use super::text::Text;

/// Octets that a list may allocate in advance for even the shortest input.
const LEAST_RESERVED: usize = 1024;

/// A cursor over a received message. It keeps a slice for reading fields, and the shared octets so
/// that strings and blobs need no copy.
///
/// ```
/// use jaus_codec::{Bytes, Reader};
///
/// let octets = Bytes::from_static(&[0x00, 0x2B, 0x02]);
/// let mut reader = Reader::new(&octets);
/// reader.code(0x2B00)?;
/// assert_eq!(reader.fixed::<u8>()?, 2);
/// assert_eq!(reader.remaining(), 0);
/// # Ok::<(), jaus_codec::DecodeError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Reader<'a> {
    shared: &'a Bytes,
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// Creates a reader at the first octet.
    #[inline]
    pub fn new(octets: &'a Bytes) -> Self {
        Self {
            shared: octets,
            rest: octets,
        }
    }

    /// Octets read so far.
    #[inline]
    pub fn offset(&self) -> usize {
        self.shared.len() - self.rest.len()
    }

    /// Octets left.
    #[inline]
    pub fn remaining(&self) -> usize {
        self.rest.len()
    }

    /// Reads the message code.
    ///
    /// # Errors
    /// If it differs from `expected`.
    #[inline]
    pub fn code(&mut self, expected: u16) -> Result<(), DecodeError> {
        match self.fixed::<u16>()? {
            found if found == expected => Ok(()),
            found => Err(DecodeError::new(
                DecodeErrorKind::Code { found, expected },
                0,
            )),
        }
    }

    /// The error for octets after the end of a message.
    #[cold]
    #[inline(never)]
    pub(super) fn trailing(&self) -> DecodeError {
        let kind = DecodeErrorKind::Trailing {
            octets: self.remaining(),
        };
        DecodeError::new(kind, self.offset())
    }

    /// Reads several fixed-size fields with one bounds check.
    ///
    /// # Errors
    /// Names the first of `fields` (name and size) that does not fit into the input.
    #[inline(always)]
    pub fn run<const N: usize>(
        &mut self,
        fields: &'static [(&'static str, usize)],
    ) -> Result<&'a [u8; N], DecodeError> {
        match self.rest.split_first_chunk() {
            Some((run, rest)) => {
                self.rest = rest;
                Ok(run)
            }
            None => Err(self.short_run(fields)),
        }
    }

    #[cold]
    #[inline(never)]
    fn short_run(&self, fields: &[(&'static str, usize)]) -> DecodeError {
        let mut at = 0;
        for &(name, size) in fields {
            if at + size > self.rest.len() {
                let kind = DecodeErrorKind::Short {
                    wanted: size as u64,
                    left: self.rest.len() - at,
                };
                return DecodeError::new(kind, self.offset() + at).within(name);
            }
            at += size;
        }
        self.short(at as u64)
    }

    #[cold]
    #[inline(never)]
    fn short(&self, wanted: u64) -> DecodeError {
        DecodeError::new(
            DecodeErrorKind::Short {
                wanted,
                left: self.remaining(),
            },
            self.offset(),
        )
    }

    /// Checks that at least so many octets are left, before memory is allocated for their content.
    ///
    /// # Errors
    /// If there are fewer.
    #[inline]
    pub fn require(&self, octets: usize) -> Result<(), DecodeError> {
        if octets > self.rest.len() {
            return Err(self.short(octets as u64));
        }
        Ok(())
    }

    /// Reads one fixed-size value.
    ///
    /// # Errors
    /// If the input ends inside it.
    #[inline]
    pub fn fixed<T: Fixed>(&mut self) -> Result<T, DecodeError> {
        match self.rest.split_at_checked(T::SIZE) {
            Some((run, rest)) => {
                self.rest = rest;
                Ok(T::get(run, 0))
            }
            None => Err(self.short(T::SIZE as u64)),
        }
    }

    /// Reads a member and adds its name to errors.
    ///
    /// # Errors
    /// Errors from `read`.
    #[inline(always)]
    pub fn member<T>(
        &mut self,
        name: &'static str,
        read: impl FnOnce(&mut Self) -> Result<T, DecodeError>,
    ) -> Result<T, DecodeError> {
        read(self).map_err(|error| error.within(name))
    }

    /// Reads an optional member and adds its name to errors.
    ///
    /// # Errors
    /// Errors from `read`.
    #[inline]
    pub fn optional<T>(
        &mut self,
        present: bool,
        name: &'static str,
        read: impl FnOnce(&mut Self) -> Result<T, DecodeError>,
    ) -> Result<Option<T>, DecodeError> {
        if present {
            self.member(name, read).map(Some)
        } else {
            Ok(None)
        }
    }

    /// Reads a presence vector.
    ///
    /// # Errors
    /// If it sets undefined bits.
    #[inline]
    pub fn presence<C: Count>(&mut self, defined: u64) -> Result<u64, DecodeError> {
        let offset = self.offset();
        let found = self.fixed::<C>()?.to_u64();
        if found & !defined != 0 {
            return Err(DecodeError::new(
                DecodeErrorKind::Presence { found, defined },
                offset,
            ));
        }
        Ok(found)
    }

    /// Reads the tag of a variant.
    ///
    /// # Errors
    /// If the tag selects no alternative.
    #[inline]
    pub fn tag<C: Count>(&mut self, alternatives: u64) -> Result<u64, DecodeError> {
        let offset = self.offset();
        let found = self.fixed::<C>()?.to_u64();
        // A variant without alternatives consists of its tag, 0.
        if found >= alternatives.max(1) {
            return Err(DecodeError::new(
                DecodeErrorKind::Tag {
                    found,
                    alternatives,
                },
                offset,
            ));
        }
        Ok(found)
    }

    /// The error for a `variable_field` whose index, just read, selects no type.
    #[cold]
    #[inline(never)]
    pub fn unknown_choice(&self, found: u8) -> DecodeError {
        DecodeError::new(DecodeErrorKind::Choice { found }, self.offset() - 1)
    }

    /// Reads a count and checks it against its limits and the remaining input. Each counted item
    /// takes at least `least` octets.
    #[inline(always)]
    fn count<C: Count>(&mut self, min: u64, max: u64, least: usize) -> Result<usize, DecodeError> {
        let offset = self.offset();
        let found = self.fixed::<C>()?.to_u64();
        if found < min || found > max {
            return Err(DecodeError::new(
                DecodeErrorKind::Count { found, min, max },
                offset,
            ));
        }
        match usize::try_from(found) {
            Ok(count)
                if count
                    .checked_mul(least)
                    .is_some_and(|all| all <= self.rest.len()) =>
            {
                Ok(count)
            }
            _ => Err(self.short(found.saturating_mul(least as u64))),
        }
    }

    /// Reads a list whose elements take at least `least` octets each.
    ///
    /// # Errors
    /// If the count exceeds its limits or the input. Errors from `element`, with the index added.
    #[inline]
    pub fn list<C: Count, T>(
        &mut self,
        min: u64,
        max: u64,
        least: usize,
        mut element: impl FnMut(&mut Self) -> Result<T, DecodeError>,
    ) -> Result<Vec<T>, DecodeError> {
        let count = self.count::<C>(min, max, least)?;
        // An element can take more memory than input: what is allocated before the first is read is
        // about the size of the input. The rest is allocated as elements arrive.
        let most = self.rest.len().max(LEAST_RESERVED) / size_of::<T>().max(1);
        let mut list = Vec::with_capacity(count.min(most));
        for index in 0..count {
            match element(self) {
                Ok(value) => list.push(value),
                Err(error) => return Err(error.element(index)),
            }
        }
        Ok(list)
    }

    /// Reads length-prefixed raw octets, sharing the memory of the message.
    ///
    /// # Errors
    /// If the length exceeds its limits or the input.
    #[inline(always)]
    pub fn blob<C: Count>(&mut self, min: u64, max: u64) -> Result<Bytes, DecodeError> {
        let length = self.count::<C>(min, max, 1)?;
        Ok(self.share(length))
    }

    /// Shares the next octets. The caller has checked that there are enough.
    #[inline(always)]
    fn share(&mut self, length: usize) -> Bytes {
        let start = self.offset();
        self.rest = &self.rest[length..];
        self.shared.slice(start..start + length)
    }

    /// Reads a format index and length-prefixed raw octets.
    ///
    /// # Errors
    /// As [`blob`](Self::blob).
    #[inline(always)]
    pub fn formatted<C: Count, F: Fixed>(
        &mut self,
        min: u64,
        max: u64,
    ) -> Result<FormattedBlob<F>, DecodeError> {
        Ok(FormattedBlob {
            format: self.fixed()?,
            data: self.blob::<C>(min, max)?,
        })
    }

    /// Reads a length-prefixed string.
    ///
    /// # Errors
    /// As [`blob`](Self::blob).
    #[inline(always)]
    pub fn text<C: Count>(&mut self, min: u64, max: u64) -> Result<Text, DecodeError> {
        self.blob::<C>(min, max).map(Text::from)
    }

    /// Reads a string of fixed length, without its zero padding.
    ///
    /// # Errors
    /// If the input ends inside it.
    #[inline]
    pub fn fixed_text(&mut self, length: usize) -> Result<Text, DecodeError> {
        if length > self.rest.len() {
            return Err(self.short(length as u64));
        }
        let mut text = self.share(length);
        let filled = text
            .iter()
            .rposition(|&octet| octet != 0)
            .map_or(0, |last| last + 1);
        text.truncate(filled);
        Ok(Text::from(text))
    }
}
