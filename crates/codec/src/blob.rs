//! Raw octets that say what they are: `variable_format_field`.

use bytes::Bytes;

/// Raw octets with the index of their format. A received blob shares the memory of its message.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct FormattedBlob<F> {
    /// The format, one of the constants of its type or what a peer sent.
    pub format: F,
    /// The octets.
    pub data: Bytes,
}

impl<F> FormattedBlob<F> {
    /// Octets in a format.
    pub fn new(format: F, data: impl Into<Bytes>) -> Self {
        Self {
            format,
            data: data.into(),
        }
    }
}
