//! Appends a message to a buffer.

use alloc::vec::Vec;

use super::blob::FormattedBlob;
use super::error::{EncodeError, EncodeErrorKind};
use super::fixed::{Count, Fixed};
use super::text::Text;

/// Appends a message to a buffer. The buffer keeps its capacity between messages.
///
/// ```
/// use jaus_codec::Writer;
///
/// let mut buffer = Vec::new();
/// let mut writer = Writer::new(&mut buffer);
/// writer.fixed(0x2B00_u16);
/// writer.fixed(2_u8);
/// assert_eq!(buffer, [0x00, 0x2B, 0x02]);
/// ```
#[derive(Debug)]
pub struct Writer<'a> {
    buffer: &'a mut Vec<u8>,
    start: usize,
}

impl<'a> Writer<'a> {
    /// Creates a writer that appends to the buffer's content.
    #[inline]
    pub fn new(buffer: &'a mut Vec<u8>) -> Self {
        Self {
            start: buffer.len(),
            buffer,
        }
    }

    /// Octets written so far.
    #[inline]
    pub fn offset(&self) -> usize {
        self.buffer.len() - self.start
    }

    /// Reserves space for several fixed-size values with one check.
    #[inline(always)]
    pub fn run<const N: usize>(&mut self) -> &mut [u8; N] {
        self.buffer.extend_from_slice(&[0; N]);
        match self.buffer.last_chunk_mut() {
            Some(run) => run,
            None => unreachable!("so many octets have just been appended"),
        }
    }

    /// Writes one fixed-size value.
    #[inline]
    pub fn fixed<T: Fixed>(&mut self, value: T) {
        // The size is constant, so a number costs one check and one store.
        if T::SIZE <= 16 {
            let mut octets = [0; 16];
            value.put(&mut octets, 0);
            self.buffer.extend_from_slice(&octets[..T::SIZE]);
        } else {
            let start = self.buffer.len();
            self.buffer.resize(start + T::SIZE, 0);
            value.put(&mut self.buffer[start..], 0);
        }
    }

    /// Writes an optional fixed-size value.
    #[inline]
    pub fn optional<T: Fixed>(&mut self, value: Option<T>) {
        if let Some(value) = value {
            self.fixed(value);
        }
    }

    /// Writes a member and adds its name to errors.
    ///
    /// # Errors
    /// Errors from `write`.
    #[inline]
    pub fn member(
        &mut self,
        name: &'static str,
        write: impl FnOnce(&mut Self) -> Result<(), EncodeError>,
    ) -> Result<(), EncodeError> {
        write(self).map_err(|error| error.within(name))
    }

    #[inline]
    fn count<C: Count>(&mut self, count: usize, min: u64, max: u64) -> Result<(), EncodeError> {
        let found = count as u64;
        match C::from_u64(found) {
            Some(count) if (min..=max).contains(&found) => {
                self.fixed(count);
                Ok(())
            }
            _ => Err(self.miscounted(found, min, max)),
        }
    }

    #[cold]
    #[inline(never)]
    fn miscounted(&self, found: u64, min: u64, max: u64) -> EncodeError {
        EncodeError::new(EncodeErrorKind::Count { found, min, max }, self.offset())
    }

    /// Writes a list.
    ///
    /// # Errors
    /// If the number of elements is outside the limits. Errors from `element`, with the index
    /// added.
    #[inline]
    pub fn list<C: Count, T>(
        &mut self,
        list: &[T],
        min: u64,
        max: u64,
        mut element: impl FnMut(&T, &mut Self) -> Result<(), EncodeError>,
    ) -> Result<(), EncodeError> {
        self.count::<C>(list.len(), min, max)?;
        for (index, value) in list.iter().enumerate() {
            if let Err(error) = element(value, self) {
                return Err(error.element(index));
            }
        }
        Ok(())
    }

    /// Writes length-prefixed raw octets.
    ///
    /// # Errors
    /// If the length is outside the limits.
    #[inline]
    pub fn blob<C: Count>(&mut self, octets: &[u8], min: u64, max: u64) -> Result<(), EncodeError> {
        self.count::<C>(octets.len(), min, max)?;
        self.buffer.extend_from_slice(octets);
        Ok(())
    }

    /// Writes a format index and length-prefixed raw octets.
    ///
    /// # Errors
    /// As [`blob`](Self::blob).
    #[inline]
    pub fn formatted<C: Count, F: Fixed + Copy>(
        &mut self,
        blob: &FormattedBlob<F>,
        min: u64,
        max: u64,
    ) -> Result<(), EncodeError> {
        self.fixed(blob.format);
        self.blob::<C>(&blob.data, min, max)
    }

    /// Writes a length-prefixed string.
    ///
    /// # Errors
    /// As [`blob`](Self::blob).
    #[inline]
    pub fn text<C: Count>(&mut self, text: &Text, min: u64, max: u64) -> Result<(), EncodeError> {
        self.blob::<C>(text.as_bytes(), min, max)
    }

    /// Writes a string of fixed length, padded with zeros.
    ///
    /// # Errors
    /// If the text is longer.
    #[inline]
    pub fn fixed_text(&mut self, text: &Text, length: usize) -> Result<(), EncodeError> {
        let octets = text.as_bytes();
        if octets.len() > length {
            return Err(self.miscounted(octets.len() as u64, 0, length as u64));
        }
        let end = self.buffer.len() + length;
        self.buffer.extend_from_slice(octets);
        self.buffer.resize(end, 0);
        Ok(())
    }
}
