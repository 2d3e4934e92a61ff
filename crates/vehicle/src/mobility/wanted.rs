//! The fields that a query asks for.

use jaus::codec::OutOfRange;

/// The presence vector of a query, which is that of its report.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted(pub(super) u32);

impl Wanted {
    /// A value, if the field with this bit is wanted.
    pub(super) fn field<T>(self, bit: u32, value: Option<T>) -> Option<T> {
        value.filter(|_| self.0 >> bit & 1 == 1)
    }

    /// A real number as a field, if that is wanted. A number that the field cannot hold is not
    /// reported, because any other would be wrong.
    pub(super) fn real<T>(
        self,
        bit: u32,
        value: f64,
        field: fn(f64) -> Result<T, OutOfRange>,
    ) -> Option<T> {
        self.field(bit, field(value).ok())
    }

    /// The same for a number that may be missing.
    pub(super) fn optional<T>(
        self,
        bit: u32,
        value: Option<f64>,
        field: fn(f64) -> Result<T, OutOfRange>,
    ) -> Option<T> {
        self.real(bit, value?, field)
    }
}
