//! Real numbers encoded as scaled integers (JSIDL `scale_range`).

use alloc::format;
use alloc::string::String;
use core::cmp::Ordering;
use core::fmt;

use super::exact::Expansion;

/// A range of real numbers spread evenly over all values of an integer, counted from its least
/// value.
///
/// `value = raw * (upper - lower) / (2^n - 1) + lower`, both limits inclusive.
///
/// ```
/// use jaus_codec::{Rounding, Scale};
///
/// let metres = Scale::new(-10_000.0, 35_000.0, u64::from(u16::MAX), Rounding::Round);
/// let raw = metres.raw(100.0).unwrap();
/// assert!((metres.value(raw) - 100.0).abs() <= metres.step() / 2.0);
/// assert_eq!(metres.raw(40_000.0), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    lower: f64,
    upper: f64,
    /// Number of steps from the lower limit to the upper limit.
    max: u64,
    /// Number of additional integer steps below the lower limit.
    below: u64,
    step: f64,
    rounding: Rounding,
}

/// Rounding of a real number between two steps (JSIDL `integer_function`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rounding {
    /// To nearest, halves up. Published definitions use no other mode.
    Round,
    /// Down.
    Floor,
    /// Up.
    Ceiling,
}

impl Scale {
    /// Creates the scale for an integer whose greatest value is `max`.
    pub const fn new(lower: f64, upper: f64, max: u64, rounding: Rounding) -> Self {
        let step = (upper - lower) / max as f64;
        Self {
            lower,
            upper,
            max,
            below: 0,
            step,
            rounding,
        }
    }

    /// Creates the scale for an integer type with limits `least` and `greatest`.
    ///
    /// A signed type has 0 at the centre of the range, as the Reference Architecture specifies: its
    /// least integer is one step below the range.
    pub const fn of_integer(
        lower: f64,
        upper: f64,
        least: i64,
        greatest: i64,
        rounding: Rounding,
    ) -> Self {
        let below = (least < 0) as u64;
        let scale = Self::new(lower, upper, greatest.abs_diff(least) - below, rounding);
        Self { below, ..scale }
    }

    /// The least real number.
    pub const fn lower(&self) -> f64 {
        self.lower
    }

    /// The greatest real number.
    pub const fn upper(&self) -> f64 {
        self.upper
    }

    /// The distance between adjacent values.
    pub const fn step(&self) -> f64 {
        self.step
    }

    /// Converts an integer to the real number it represents.
    #[inline]
    pub fn value(&self, raw: u64) -> f64 {
        self.unbounded(raw).min(self.upper)
    }

    #[inline]
    fn unbounded(&self, raw: u64) -> f64 {
        (raw as f64 - self.below as f64) * self.step + self.lower
    }

    /// Converts a real number to an integer with exact rounding. `None` if the number is NaN or
    /// outside the range. The one integer below the range is reachable by its own value.
    pub fn raw(&self, value: f64) -> Option<u64> {
        if self.below > 0 && value < self.lower && value >= self.lower - 1.5 * self.step {
            return Some(u64::from(self.reaches(value, 0)));
        }
        if !(self.lower <= value && value <= self.upper) {
            return None;
        }
        let steps = (value - self.lower) / self.step;
        let shifted = match self.rounding {
            Rounding::Round => steps + 0.5,
            Rounding::Floor => steps,
            Rounding::Ceiling => steps + 1.0,
        };
        // A few rounding errors affect `steps`. They matter only this close to an integer.
        let doubt = (steps + 1.0) * (8.0 * f64::EPSILON);
        let below = shifted as u64;
        let fraction = shifted - below as f64;
        if fraction > doubt && fraction < 1.0 - doubt {
            Some(below.min(self.max) + self.below)
        } else {
            Some(self.raw_exactly(value) + self.below)
        }
    }

    /// Steps from the lower limit to a number in the range, found by bisection with exact
    /// comparisons.
    #[cold]
    #[inline(never)]
    fn raw_exactly(&self, value: f64) -> u64 {
        let (mut least, mut greatest) = (0, self.max);
        while least < greatest {
            let middle = greatest - (greatest - least) / 2;
            if self.reaches(value, middle) {
                least = middle;
            } else {
                greatest = middle - 1;
            }
        }
        least
    }

    /// Whether a number rounds to `raw` steps above the lower limit or more.
    fn reaches(&self, value: f64, raw: u64) -> bool {
        let twice = 2 * i128::from(raw);
        let boundary = match self.rounding {
            Rounding::Round => twice - 1,
            Rounding::Floor => twice,
            Rounding::Ceiling => twice - 2,
        };
        let mut excess = Expansion::default();
        excess.add_product_of_difference(value, self.lower, 2 * i128::from(self.max));
        excess.add_product_of_difference(self.upper, self.lower, -boundary);
        match excess.sign() {
            Ordering::Greater => true,
            Ordering::Equal => self.rounding != Rounding::Ceiling,
            Ordering::Less => false,
        }
    }

    /// The decimal with the fewest significant digits that converts to `raw`, used for display.
    /// Zero counts as having no digits. Of two decimals with equally many digits, the nearer one
    /// wins.
    pub fn shortest(&self, raw: u64) -> f64 {
        let stands_for_raw = |&candidate: &f64| self.raw(candidate) == Some(raw);
        if stands_for_raw(&0.0) {
            return 0.0;
        }
        let value = self.unbounded(raw);
        // Halfway to the next integer, far from rounding boundaries. The greatest has none above
        // it: rounded down, only the upper limit stands for it.
        let inside = match self.rounding {
            Rounding::Round => value,
            Rounding::Floor => (value + self.step / 2.0).min(self.upper),
            Rounding::Ceiling => value - self.step / 2.0,
        };
        [value, inside]
            .into_iter()
            .flat_map(|value| (1..=17).flat_map(move |digits| decimals(value, digits)))
            .find(stands_for_raw)
            .unwrap_or(value)
    }
}

/// Decimals with `digits` significant digits around a nonzero number, nearest first.
fn decimals(value: f64, digits: usize) -> impl Iterator<Item = f64> {
    let text = format!("{:.*e}", digits - 1, value.abs()).replace('.', "");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let mantissa: u64 = mantissa.parse().unwrap_or(0);
    let exponent = exponent.parse::<i32>().unwrap_or(0) - (digits as i32 - 1);
    // Below a power of ten, decimals are ten times as dense.
    let below = if mantissa == 10_u64.pow(digits as u32 - 1) {
        (10 * mantissa - 1, exponent - 1)
    } else {
        (mantissa.saturating_sub(1), exponent)
    };
    [(mantissa, exponent), below, (mantissa + 1, exponent)]
        .into_iter()
        .filter_map(|(mantissa, exponent)| format!("{mantissa}e{exponent}").parse::<f64>().ok())
        .map(move |decimal| decimal.copysign(value))
}

/// An integer that represents a real number in a range.
pub trait Scaled: Copy {
    /// The field's name in the definition.
    const NAME: &'static str;
    /// The unit, as the definition spells it.
    const UNIT: &'static str;
    /// The range.
    const SCALE: Scale;

    /// The nearest value that the field can hold.
    ///
    /// # Errors
    /// If the value is outside the range, which includes its limits.
    fn from_real(value: f64) -> Result<Self, OutOfRange>;

    /// The value in the field's unit.
    fn to_real(self) -> f64;
}

/// Error: a number is outside the range of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfRange {
    /// The field's name in the definition.
    pub field: &'static str,
    /// The number.
    pub value: f64,
    /// The least number that the field holds.
    pub lower: f64,
    /// The greatest number that the field holds.
    pub upper: f64,
    /// The unit, as spelled in the definition; `one` for a dimensionless number.
    pub unit: &'static str,
}

impl OutOfRange {
    /// Creates the error for a scaled field.
    #[doc(hidden)]
    #[cold]
    pub const fn of<T: Scaled>(value: f64) -> Self {
        Self {
            field: T::NAME,
            value,
            lower: T::SCALE.lower,
            upper: T::SCALE.upper,
            unit: T::UNIT,
        }
    }
}

impl core::error::Error for OutOfRange {}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            field,
            value,
            lower,
            upper,
            unit,
        } = self;
        let unit = if *unit == "one" {
            String::new()
        } else {
            format!(" {unit}")
        };
        write!(f, "{field}: {value} is not in {lower} to {upper}{unit}")
    }
}

/// Implements the scaled field traits for a newtype over an integer.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_scaled {
    ($name:ident($raw:ty), $field:literal, $lower:literal to $upper:literal $unit:literal, $rounding:ident) => {
        #[allow(clippy::approx_constant)]
        impl $crate::Scaled for $name {
            const NAME: &'static str = $field;
            const UNIT: &'static str = $unit;
            const SCALE: $crate::Scale = $crate::Scale::of_integer(
                $lower,
                $upper,
                <$raw>::MIN as i64,
                <$raw>::MAX as i64,
                $crate::Rounding::$rounding,
            );

            #[inline]
            fn from_real(value: f64) -> Result<Self, $crate::OutOfRange> {
                Self::new(value)
            }

            #[inline]
            fn to_real(self) -> f64 {
                self.value()
            }
        }

        impl $name {
            /// The nearest value that the field can hold.
            ///
            /// # Errors
            /// If the value is outside the range, which includes its limits.
            #[inline]
            pub fn new(value: f64) -> Result<Self, $crate::OutOfRange> {
                match <Self as $crate::Scaled>::SCALE.raw(value) {
                    Some(count) => Ok(Self::of_count(count)),
                    None => Err($crate::OutOfRange::of::<Self>(value)),
                }
            }

            /// The value in the field's unit.
            #[inline]
            pub fn value(self) -> f64 {
                <Self as $crate::Scaled>::SCALE.value(self.count())
            }

            /// The integer on the wire.
            pub const fn raw(self) -> $raw {
                self.0
            }

            /// Creates the value from the integer on the wire. Every integer is valid.
            pub const fn from_raw(raw: $raw) -> Self {
                Self(raw)
            }

            /// Steps above the least integer of the type.
            #[inline]
            const fn count(self) -> u64 {
                (self.0 as i64).abs_diff(<$raw>::MIN as i64)
            }

            #[inline]
            const fn of_count(count: u64) -> Self {
                Self((count as i64 + <$raw>::MIN as i64) as $raw)
            }
        }

        $crate::fixed_newtype!($name($raw));

        impl ::core::fmt::Display for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                let scale = <Self as $crate::Scaled>::SCALE;
                ::core::fmt::Display::fmt(&scale.shortest(self.count()), f)
            }
        }

        impl ::core::fmt::Debug for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                ::core::fmt::Display::fmt(self, f)
            }
        }

        $crate::if_serde! {
            impl $crate::view::View for $name {
                fn view(&self) -> $crate::view::Value {
                    let scale = &<Self as $crate::Scaled>::SCALE;
                    $crate::view::scaled(scale, self.count())
                }

                fn from_view(
                    value: &$crate::view::Value,
                ) -> Result<Self, $crate::view::Error> {
                    let scale = &<Self as $crate::Scaled>::SCALE;
                    let out_of_range = $crate::OutOfRange::of::<Self>;
                    let count = $crate::view::raw_scaled(value, scale, out_of_range)?;
                    Ok(Self::of_count(count))
                }
            }
        }

        $crate::arbitrary_integer!($name);
    };
}
