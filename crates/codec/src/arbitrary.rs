//! Random messages for tests: `arbitrary::Arbitrary` for every generated type.
//!
//! The messages are valid: counts are within their limits, strings fit their fields, numbers are
//! numbers. So each of them encodes, and decodes to itself.

pub use arbitrary::{Arbitrary, Result, Unstructured};
use bytes::Bytes;

use super::{FormattedBlob, Text};

/// A random list, blob or string is rarely longer than this, whatever its definition allows.
const USUAL_LENGTH: u64 = 12;

/// A count within limits; small, mostly.
fn count(random: &mut Unstructured<'_>, min: u64, max: u64) -> Result<u64> {
    random.int_in_range(min..=max.min(min.saturating_add(USUAL_LENGTH)))
}

/// A list with a valid number of elements.
///
/// # Errors
/// Those of `element`.
pub fn list<'a, T>(
    random: &mut Unstructured<'a>,
    min: u64,
    max: u64,
    mut element: impl FnMut(&mut Unstructured<'a>) -> Result<T>,
) -> Result<Vec<T>> {
    let count = count(random, min, max)?;
    (0..count).map(|_| element(random)).collect()
}

/// Raw octets of a valid length.
///
/// # Errors
/// None in practice: a source that has run dry gives zeros.
pub fn blob(random: &mut Unstructured<'_>, min: u64, max: u64) -> Result<Bytes> {
    list(random, min, max, u8::arbitrary).map(Bytes::from)
}

/// Raw octets of a valid length in some format.
///
/// # Errors
/// As [`blob`].
pub fn formatted<'a, F: Arbitrary<'a>>(
    random: &mut Unstructured<'a>,
    min: u64,
    max: u64,
) -> Result<FormattedBlob<F>> {
    Ok(FormattedBlob {
        format: F::arbitrary(random)?,
        data: blob(random, min, max)?,
    })
}

/// A string of a valid length, of any octets.
///
/// # Errors
/// As [`blob`].
pub fn text(random: &mut Unstructured<'_>, min: u64, max: u64) -> Result<Text> {
    blob(random, min, max).map(Text::from)
}

/// A string that fits a fixed length and does not end with the zeros that fill it up.
///
/// # Errors
/// As [`blob`].
pub fn fixed_text(random: &mut Unstructured<'_>, length: u64) -> Result<Text> {
    let mut octets = Vec::from(blob(random, 0, length)?);
    while octets.last() == Some(&0) {
        octets.pop();
    }
    Ok(Text::from(Bytes::from(octets)))
}

/// A single-precision number that equals itself.
///
/// # Errors
/// As [`blob`].
pub fn f32(random: &mut Unstructured<'_>) -> Result<f32> {
    f32::arbitrary(random).map(|value| if value.is_nan() { 0.0 } else { value })
}

/// A double-precision number that equals itself.
///
/// # Errors
/// As [`blob`].
pub fn f64(random: &mut Unstructured<'_>) -> Result<f64> {
    f64::arbitrary(random).map(|value| if value.is_nan() { 0.0 } else { value })
}

/// Something that may be absent.
///
/// # Errors
/// Those of `value`.
pub fn optional<'a, T>(
    random: &mut Unstructured<'a>,
    value: impl FnOnce(&mut Unstructured<'a>) -> Result<T>,
) -> Result<Option<T>> {
    bool::arbitrary(random)?.then(|| value(random)).transpose()
}

/// An array, filled in the order of its memory.
///
/// # Errors
/// Those of `element`.
pub fn array<'a, T: Default, const N: usize>(
    random: &mut Unstructured<'a>,
    mut element: impl FnMut(&mut Unstructured<'a>) -> Result<T>,
) -> Result<[T; N]> {
    let mut array = std::array::from_fn(|_| T::default());
    for slot in &mut array {
        *slot = element(random)?;
    }
    Ok(array)
}
