//! Bit fields: several small numbers packed into one integer (JSIDL `bit_field`).

use super::scale::OutOfRange;

/// An unsigned integer divided into sub-fields. Bits outside the sub-fields are preserved.
pub trait Bits: Copy {
    /// Name, lowest bit and highest bit of every sub-field, in definition order.
    const FIELDS: &'static [(&'static str, u32, u32)];

    /// The integer on the wire.
    fn raw(self) -> u64;

    /// The named values of a sub-field.
    fn names(field: &str) -> &'static [(u64, &'static str)];
}

/// Extracts bits `from..=to` of an integer.
#[doc(hidden)]
pub const fn get(raw: u64, from: u32, to: u32) -> u64 {
    (raw >> from) & mask(from, to)
}

/// Replaces bits `from..=to` of an integer. The caller guarantees that the value fits.
#[doc(hidden)]
pub const fn set(raw: u64, from: u32, to: u32, value: u64) -> u64 {
    raw & !(mask(from, to) << from) | value << from
}

/// A mask with one set bit per bit of `from..=to`, starting at bit 0.
const fn mask(from: u32, to: u32) -> u64 {
    u64::MAX >> (63 - (to - from))
}

/// Replaces bits `from..=to` of an integer.
///
/// # Errors
/// If the value is outside the limits in the definition.
#[doc(hidden)]
pub const fn set_checked(
    raw: u64,
    (field, from, to): (&'static str, u32, u32),
    value: u64,
    (lower, upper): (u64, u64),
) -> Result<u64, OutOfRange> {
    if value < lower || value > upper {
        return Err(OutOfRange {
            field,
            value: value as f64,
            lower: lower as f64,
            upper: upper as f64,
            unit: "one",
        });
    }
    Ok(set(raw, from, to, value))
}

/// Implements the bit field traits for a newtype over an unsigned integer.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_bit_field {
    ($name:ident($raw:ty), [$(($field:literal, $from:literal, $to:literal $(, $values:ident)?)),* $(,)?]) => {
        impl $crate::Bits for $name {
            const FIELDS: &'static [(&'static str, u32, u32)] = &[$(($field, $from, $to)),*];

            fn raw(self) -> u64 {
                u64::from(self.0)
            }

            fn names(field: &str) -> &'static [(u64, &'static str)] {
                match field {
                    $($($field => <$values as $crate::Enumeration>::VALUES,)?)*
                    _ => &[],
                }
            }
        }

        $crate::fixed_newtype!($name($raw));

        impl ::core::fmt::Debug for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                $crate::bits::debug(*self, f)
            }
        }

        $crate::if_serde! {
            impl $crate::view::View for $name {
                fn view(&self) -> $crate::view::Value {
                    $crate::view::bits(*self)
                }

                fn from_view(
                    value: &$crate::view::Value,
                ) -> Result<Self, $crate::view::Error> {
                    $crate::view::raw_bits::<Self>(value).map(|raw| Self(raw as $raw))
                }
            }
        }

        $crate::arbitrary_integer!($name);
    };
}

/// Implements a getter and a replacement for sub-fields. `as` names the type of those with named values.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_sub_fields {
    ($name:ident($raw:ty) { $(
        $(#[$doc:meta])*
        $get:ident: $int:ty $(as $values:ident)?, $from:literal to $to:literal,
        $least:literal to $most:literal, $text:literal => $replace:ident;
    )* }) => {
        impl $name {
            $(
                $(#[$doc])*
                pub const fn $get(self) -> $crate::sub_field!(type $int $(, $values)?) {
                    let value = $crate::bits::get(self.0 as u64, $from, $to) as $int;
                    $crate::sub_field!(wrap value $(, $values)?)
                }

                #[doc = ::core::concat!("The same with another `", $text, "`.")]
                ///
                /// # Errors
                #[doc = ::core::concat!("If the value is not in ", $least, " to ", $most, ".")]
                pub const fn $replace(
                    self,
                    value: $crate::sub_field!(type $int $(, $values)?),
                ) -> ::core::result::Result<Self, $crate::OutOfRange> {
                    let value = $crate::sub_field!(unwrap value $(, $values)?) as u64;
                    let field = ($text, $from, $to);
                    match $crate::bits::set_checked(self.0 as u64, field, value, ($least, $most)) {
                        Ok(raw) => Ok(Self(raw as $raw)),
                        Err(error) => Err(error),
                    }
                }
            )*
        }
    };
}

/// The parts of an accessor that depend on whether the sub-field has named values.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_sub_field {
    (type $int:ty) => {
        $int
    };
    (type $int:ty, $values:ident) => {
        $values
    };
    (wrap $value:ident) => {
        $value
    };
    (wrap $value:ident, $values:ident) => {
        $values($value)
    };
    (unwrap $value:ident) => {
        $value
    };
    (unwrap $value:ident, $values:ident) => {
        $value.0
    };
}

/// Prints the sub-fields as a map from name to number.
#[doc(hidden)]
pub fn debug<B: Bits>(bits: B, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
    let fields = B::FIELDS
        .iter()
        .map(|&(name, from, to)| (name, get(bits.raw(), from, to)));
    f.debug_map().entries(fields).finish()
}

/// The bits outside all sub-fields of `B`.
#[cfg(feature = "serde")]
pub(super) fn reserved<B: Bits>() -> u64 {
    !B::FIELDS
        .iter()
        .fold(0, |owned, &(_, from, to)| owned | mask(from, to) << from)
}

#[cfg(test)]
mod tests {
    use alloc::format;
    use alloc::string::ToString;

    use super::*;

    #[test]
    fn a_sub_field_is_read_and_replaced_without_its_neighbours() {
        let raw = 0x8123_4567_89AB_CDEF;
        for (from, to, value, zeros) in [
            (0, 0, 1, 0x8123_4567_89AB_CDEE),
            (4, 11, 0xDE, 0x8123_4567_89AB_C00F),
            (32, 62, 0x0123_4567, 0x8000_0000_89AB_CDEF),
            (63, 63, 1, 0x0123_4567_89AB_CDEF),
            (0, 63, raw, 0),
        ] {
            assert_eq!(get(raw, from, to), value, "{from} to {to}");
            assert_eq!(set(raw, from, to, 0), zeros, "{from} to {to}");
            assert_eq!(set(zeros, from, to, value), raw, "{from} to {to}");
            assert_eq!(set(raw, from, to, value), raw, "{from} to {to}");
        }
    }

    #[test]
    fn a_sub_field_takes_no_value_outside_its_limits() {
        let set = |value| set_checked(0xF00F, ("Day", 4, 11), value, (2, 31));
        assert_eq!((set(2), set(31)), (Ok(0xF02F), Ok(0xF1FF)));
        for value in [0, 1, 32, 255] {
            let error = set(value).unwrap_err();
            assert_eq!(error.to_string(), format!("Day: {value} is not in 2 to 31"));
        }
    }
}
