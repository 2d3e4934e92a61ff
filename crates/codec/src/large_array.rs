//! Fixed arrays that are too large for the stack.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::ops::{Deref, DerefMut};

/// An array of `N` elements on the heap: generated fields of more than about a kilobyte.
///
/// It is used like `[T; N]`: indexed, iterated, borrowed as a slice.
///
/// ```
/// use jaus_codec::LargeArray;
///
/// let mut heights = LargeArray::<f32, 10_000>::default();
/// heights[17] = 2.5;
/// assert_eq!(heights.len(), 10_000);
/// assert_eq!(heights.iter().sum::<f32>(), 2.5);
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct LargeArray<T, const N: usize>(Box<[T]>);

impl<T, const N: usize> LargeArray<T, N> {
    /// Creates the array from a function of the index.
    pub fn from_fn(element: impl FnMut(usize) -> T) -> Self {
        Self((0..N).map(element).collect())
    }

    /// Like [`from_fn`](Self::from_fn), with a function that can fail.
    ///
    /// # Errors
    /// The first error of `element`.
    pub fn try_from_fn<E>(element: impl FnMut(usize) -> Result<T, E>) -> Result<Self, E> {
        (0..N).map(element).collect::<Result<_, E>>().map(Self)
    }
}

impl<T: Default, const N: usize> Default for LargeArray<T, N> {
    fn default() -> Self {
        Self::from_fn(|_| T::default())
    }
}

impl<T, const N: usize> Deref for LargeArray<T, N> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T, const N: usize> DerefMut for LargeArray<T, N> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

/// Fails with the elements if their number is not `N`.
impl<T, const N: usize> TryFrom<Vec<T>> for LargeArray<T, N> {
    type Error = Vec<T>;

    fn try_from(elements: Vec<T>) -> Result<Self, Vec<T>> {
        match elements.len() == N {
            true => Ok(Self(elements.into())),
            false => Err(elements),
        }
    }
}

impl<T, const N: usize> From<[T; N]> for LargeArray<T, N> {
    fn from(elements: [T; N]) -> Self {
        Self(Box::new(elements))
    }
}

impl<'a, T, const N: usize> IntoIterator for &'a LargeArray<T, N> {
    type Item = &'a T;
    type IntoIter = core::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

impl<'a, T, const N: usize> IntoIterator for &'a mut LargeArray<T, N> {
    type Item = &'a mut T;
    type IntoIter = core::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter_mut()
    }
}
