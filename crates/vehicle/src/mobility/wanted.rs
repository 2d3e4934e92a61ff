//! Selection of report fields by the presence vector of a query.

use jaus::codec::OutOfRange;

/// The presence vector of a query, identical to that of its report.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted(pub(super) u32);

impl Wanted {
    /// The value, if the query requests the field with this bit.
    pub(super) fn field<T>(self, bit: u32, value: Option<T>) -> Option<T> {
        value.filter(|_| self.0 >> bit & 1 == 1)
    }

    /// A real number as a field, if the query requests it. A number outside the range of the field
    /// is omitted, since any other value would be wrong.
    pub(super) fn real<T>(
        self,
        bit: u32,
        value: f64,
        field: fn(f64) -> Result<T, OutOfRange>,
    ) -> Option<T> {
        self.field(bit, field(value).ok())
    }

    /// Like [`real`](Self::real), for an optional number.
    pub(super) fn optional<T>(
        self,
        bit: u32,
        value: Option<f64>,
        field: fn(f64) -> Result<T, OutOfRange>,
    ) -> Option<T> {
        self.real(bit, value?, field)
    }
}
