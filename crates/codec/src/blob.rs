//! Raw octets tagged with a format (JSIDL `variable_format_field`).

use bytes::Bytes;

/// Raw octets with their format index. A received blob shares the memory of its message.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct FormattedBlob<F> {
    /// The format: a constant of type `F`, or an unknown value from a peer.
    pub format: F,
    /// The octets.
    pub data: Bytes,
}

impl<F> FormattedBlob<F> {
    /// Creates a blob from a format and octets.
    pub fn new(format: F, data: impl Into<Bytes>) -> Self {
        Self {
            format,
            data: data.into(),
        }
    }
}
