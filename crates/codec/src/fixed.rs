//! Values of constant size: numbers, newtypes over numbers, and arrays of them.

/// A value of constant size on the wire, little-endian.
///
/// `get` and `put` operate on a run of octets whose length the caller has checked once for several
/// values. Offsets are constants in generated code, so no bounds check remains per value.
pub trait Fixed: Sized {
    /// Size on the wire in octets.
    const SIZE: usize;

    /// Reads the value at offset `at` of a run.
    ///
    /// # Panics
    /// If the run is shorter than `at + SIZE`. That is a bug in the caller and never depends on
    /// input.
    fn get(run: &[u8], at: usize) -> Self;

    /// Writes the value at offset `at` of a run.
    ///
    /// # Panics
    /// As [`get`](Self::get).
    fn put(self, run: &mut [u8], at: usize);
}

/// An unsigned integer that precedes a list, a string or raw octets and holds their length.
pub trait Count: Fixed + Copy {
    /// The count as a number.
    fn to_u64(self) -> u64;

    /// Converts a number to a count, if it fits.
    fn from_u64(count: u64) -> Option<Self>;
}

macro_rules! number {
    ($($number:ty),*) => {$(
        impl Fixed for $number {
            const SIZE: usize = size_of::<Self>();

            #[inline(always)]
            fn get(run: &[u8], at: usize) -> Self {
                let mut octets = [0; size_of::<Self>()];
                octets.copy_from_slice(&run[at..at + size_of::<Self>()]);
                Self::from_le_bytes(octets)
            }

            #[inline(always)]
            fn put(self, run: &mut [u8], at: usize) {
                run[at..at + size_of::<Self>()].copy_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

macro_rules! count {
    ($($count:ty),*) => {$(
        impl Count for $count {
            #[inline(always)]
            fn to_u64(self) -> u64 {
                u64::from(self)
            }

            #[inline(always)]
            fn from_u64(count: u64) -> Option<Self> {
                Self::try_from(count).ok()
            }
        }
    )*};
}

number!(u8, u16, u32, u64, i8, i16, i32, i64, f32, f64);
count!(u8, u16, u32, u64);

/// Encodes a newtype as the value it wraps.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_fixed_newtype {
    ($name:ident($raw:ty)) => {
        impl $crate::Fixed for $name {
            const SIZE: usize = <$raw as $crate::Fixed>::SIZE;

            #[inline(always)]
            fn get(run: &[u8], at: usize) -> Self {
                Self($crate::Fixed::get(run, at))
            }

            #[inline(always)]
            fn put(self, run: &mut [u8], at: usize) {
                $crate::Fixed::put(self.0, run, at);
            }
        }
    };
}

impl<T: Fixed, const N: usize> Fixed for [T; N] {
    const SIZE: usize = N * T::SIZE;

    #[inline]
    fn get(run: &[u8], at: usize) -> Self {
        core::array::from_fn(|i| T::get(run, at + i * T::SIZE))
    }

    #[inline]
    fn put(self, run: &mut [u8], at: usize) {
        for (i, value) in self.into_iter().enumerate() {
            value.put(run, at + i * T::SIZE);
        }
    }
}
