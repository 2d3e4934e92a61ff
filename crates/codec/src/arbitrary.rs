//! Random valid messages for tests: `arbitrary::Arbitrary` for every generated type.
//!
//! Counts are within their limits, strings fit their fields and no number is NaN, so every
//! generated message encodes and decodes to itself.

use alloc::vec::Vec;

pub use arbitrary::{Arbitrary, Result, Unstructured};

use arbitrary::Error;
use bytes::Bytes;

use super::blob::FormattedBlob;
use super::large_array::LargeArray;
use super::text::Text;

/// Random lists, blobs and strings exceed the minimum length by at most this much.
const USUAL_LENGTH: u64 = 12;

/// A count within `min..=max`, at most [`USUAL_LENGTH`] above `min`.
fn count(random: &mut Unstructured<'_>, min: u64, max: u64) -> Result<u64> {
    random.int_in_range(min..=max.min(min.saturating_add(USUAL_LENGTH)))
}

/// A function that makes a random value.
#[doc(hidden)]
pub type Maker<'a, T> = fn(&mut Unstructured<'a>) -> Result<T>;

/// The value that a function makes.
#[doc(hidden)]
pub fn made<'a, T>(
    random: &mut Unstructured<'a>,
    make: impl FnOnce(&mut Unstructured<'a>) -> Result<T>,
) -> Result<T> {
    make(random)
}

/// A list with a valid number of elements.
///
/// # Errors
/// Errors from `element`.
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
/// None in practice: an exhausted source yields zeros.
pub fn blob(random: &mut Unstructured<'_>, min: u64, max: u64) -> Result<Bytes> {
    list(random, min, max, u8::arbitrary).map(Bytes::from)
}

/// Raw octets of a valid length with a random format.
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

/// A string of valid length, made of arbitrary octets.
///
/// # Errors
/// As [`blob`].
pub fn text(random: &mut Unstructured<'_>, min: u64, max: u64) -> Result<Text> {
    blob(random, min, max).map(Text::from)
}

/// A string that fits a fixed length and has no trailing zeros, which would read as padding.
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

/// A single-precision number other than NaN, so that it equals itself.
///
/// # Errors
/// As [`blob`].
pub fn f32(random: &mut Unstructured<'_>) -> Result<f32> {
    f32::arbitrary(random).map(|value| if value.is_nan() { 0.0 } else { value })
}

/// A double-precision number other than NaN, so that it equals itself.
///
/// # Errors
/// As [`blob`].
pub fn f64(random: &mut Unstructured<'_>) -> Result<f64> {
    f64::arbitrary(random).map(|value| if value.is_nan() { 0.0 } else { value })
}

/// An optional value.
///
/// # Errors
/// Errors from `value`.
pub fn optional<'a, T>(
    random: &mut Unstructured<'a>,
    value: impl FnOnce(&mut Unstructured<'a>) -> Result<T>,
) -> Result<Option<T>> {
    bool::arbitrary(random)?.then(|| value(random)).transpose()
}

/// An array, filled in memory order.
///
/// # Errors
/// Errors from `element`.
pub fn array<'a, T, const N: usize>(
    random: &mut Unstructured<'a>,
    mut element: impl FnMut(&mut Unstructured<'a>) -> Result<T>,
) -> Result<[T; N]> {
    let elements: Vec<T> = (0..N).map(|_| element(random)).collect::<Result<_>>()?;
    let wrong_number = |_| Error::IncorrectFormat;
    elements.try_into().map_err(wrong_number)
}

/// A large array, filled in memory order.
///
/// # Errors
/// Errors from `element`.
pub fn large_array<'a, T, const N: usize>(
    random: &mut Unstructured<'a>,
    mut element: impl FnMut(&mut Unstructured<'a>) -> Result<T>,
) -> Result<LargeArray<T, N>> {
    LargeArray::try_from_fn(|_| element(random))
}
