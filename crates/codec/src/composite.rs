//! Values whose size depends on what is in them: records, sequences, variants, message bodies.

use super::{DecodeError, EncodeError, Reader, Writer};

/// A value whose size on the wire depends on its content.
pub trait Composite: Sized {
    /// The least number of octets that any value takes; what a list may count on.
    const MIN_LEN: usize;

    /// The octets that this value takes.
    fn encoded_len(&self) -> usize;

    /// Appends the value.
    ///
    /// # Errors
    /// If a count or a length is outside the limits of the definition.
    fn write(&self, output: &mut Writer<'_>) -> Result<(), EncodeError>;

    /// Reads a value.
    ///
    /// # Errors
    /// If the octets are not one.
    fn read(input: &mut Reader<'_>) -> Result<Self, DecodeError>;
}
