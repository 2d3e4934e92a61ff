//! Values of variable size: records, sequences, variants and message bodies.

use super::error::{DecodeError, EncodeError};
use super::reader::Reader;
use super::writer::Writer;

/// A value whose size on the wire depends on its content.
pub trait Composite: Sized {
    /// Least number of octets of any value. List decoding bounds its allocation with it.
    const MIN_LEN: usize;

    /// Number of octets of this value.
    fn encoded_len(&self) -> usize;

    /// Appends the value.
    ///
    /// # Errors
    /// If a count or a length is outside the limits of the definition.
    fn write(&self, output: &mut Writer<'_>) -> Result<(), EncodeError>;

    /// Reads a value.
    ///
    /// # Errors
    /// If the octets do not encode a valid value.
    fn read(input: &mut Reader<'_>) -> Result<Self, DecodeError>;
}
