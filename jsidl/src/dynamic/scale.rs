//! Scaled integers: real numbers in a range, encoded as integers.
//!
//! A real number becomes the integer that the definition's `integer_function` gives for
//! `(real - lower) * (2^n - 1) / (upper - lower)`, computed without rounding errors: limits and
//! number are treated as exact fractions. (Floating point arithmetic is off by one for a few per
//! cent of the numbers halfway between two steps.)

use std::cmp::Ordering;

use super::value::Raw;
use crate::model::{Number, Rounding, Scale, Signed, Unsigned};

/// The values of a scaled integer of any type, counted from the least one.
#[derive(Debug, Clone, Copy)]
pub struct Steps {
    scale: Scale,
    /// Steps from the lower limit to the upper one.
    max: u64,
    /// Steps of the type below the lower limit.
    below: u64,
    /// The least integer, if the type is signed.
    least: Option<i64>,
}

impl Steps {
    /// `None` if numbers of this type cannot be scaled.
    pub fn of(scale: &Scale, number: Number) -> Option<Self> {
        let width = match number {
            Number::Unsigned(width) => return Some(Self::of_unsigned(scale, width)),
            Number::Signed(Signed::I8) => Unsigned::U8,
            Number::Signed(Signed::I16) => Unsigned::U16,
            Number::Signed(Signed::I32) => Unsigned::U32,
            Number::Signed(Signed::I64) | Number::F32 | Number::F64 => return None,
        };
        Some(Self {
            scale: *scale,
            max: width.max() - 1,
            below: 1,
            least: Some(-(1 << (width.size() * 8 - 1))),
        })
    }

    const fn of_unsigned(scale: &Scale, width: Unsigned) -> Self {
        Self {
            scale: *scale,
            max: width.max(),
            below: 0,
            least: None,
        }
    }

    /// The distance between neighbouring values.
    pub fn step(&self) -> f64 {
        (self.scale.upper - self.scale.lower) / self.max as f64
    }

    /// The displayed value: see [`shortest_real`]. `None` if the integer has another type.
    pub fn shown(&self, raw: Raw) -> Option<f64> {
        let count = match (raw, self.least) {
            (Raw::Unsigned(raw), None) => raw,
            (Raw::Signed(raw), Some(least)) => raw.checked_sub(least)?.try_into().ok()?,
            _ => return None,
        };
        Some(self.shortest(count))
    }

    /// The integer for a real number: see [`raw_from_real`]. Below the range it accepts only the
    /// value of the least integer, so that this can be encoded too.
    pub fn raw(&self, real: f64) -> Option<Raw> {
        let count = self.count(real)?;
        Some(match self.least {
            None => Raw::Unsigned(count),
            // A signed type has at most 32 bits.
            Some(least) => Raw::Signed(count as i64 + least),
        })
    }

    /// The real number at this number of steps from the least integer.
    fn real(&self, count: u64) -> f64 {
        (count as f64 - self.below as f64) * self.step() + self.scale.lower
    }

    /// Steps from the least integer to that of a real number.
    fn count(&self, real: f64) -> Option<u64> {
        let (lower, upper) = (self.scale.lower, self.scale.upper);
        if self.below > 0 && real < lower && real >= lower - 1.5 * self.step() {
            return Some(u64::from(self.reaches(real, 0)));
        }
        if !(lower..=upper).contains(&real) {
            return None;
        }
        let reaches = |raw| raw == 0 || self.reaches(real, raw);
        // The conversion saturates, so that the result is in the type's range or above it.
        let guess = ((real - lower) / self.step()) as u64;
        let mut least = guess.min(self.max).saturating_sub(2);
        let mut greatest = guess.saturating_add(2).min(self.max);
        if !reaches(least) {
            least = 0;
        }
        if greatest < self.max && reaches(greatest + 1) {
            greatest = self.max;
        }
        while least < greatest {
            let middle = greatest - (greatest - least) / 2;
            if reaches(middle) {
                least = middle;
            } else {
                greatest = middle - 1;
            }
        }
        Some(least + self.below)
    }

    /// Whether the integer for `real` is at least `raw` steps above the lower limit, exactly.
    ///
    /// That is the case if `real` is at least (for `ceiling`: above) the threshold
    /// `lower + k/2 * (upper - lower) / max`, where `k` counts half steps. Multiplied by `2 * max`,
    /// both sides are sums of integer multiples of the three numbers.
    fn reaches(&self, real: f64, raw: u64) -> bool {
        let (raw, max) = (i128::from(raw), i128::from(self.max));
        let (half_steps, admitted) = match self.scale.rounding {
            Rounding::Round => (2 * raw - 1, Ordering::Equal),
            Rounding::Floor => (2 * raw, Ordering::Equal),
            Rounding::Ceiling => (2 * raw - 2, Ordering::Greater),
        };
        let terms = [
            (2 * max, real),
            (half_steps - 2 * max, self.scale.lower),
            (-half_steps, self.scale.upper),
        ];
        sign_of_sum(terms) >= admitted
    }

    fn shortest(&self, count: u64) -> f64 {
        let exact = self.real(count);
        if !exact.is_finite() {
            return exact;
        }
        let encodes_back = |real: &f64| self.count(*real) == Some(count);
        if encodes_back(&0.0) {
            return 0.0;
        }
        // With `floor` and `ceiling` the exact value is the boundary of what encodes back, and the
        // rounding error of its computation may cross it.
        let step = self.step();
        let inside = match self.scale.rounding {
            Rounding::Round => exact,
            // The greatest integer has no next one: rounded down, only the limit stands for it.
            Rounding::Floor => (exact + step / 2.0).min(self.scale.upper),
            Rounding::Ceiling => exact - step / 2.0,
        };
        // Most candidates are too far away to need an exact check.
        let near = |real: &f64| (real - exact).abs() <= 2.0 * step;
        let around = |number| {
            (1..=17)
                .flat_map(move |digits| neighbours(number, digits))
                .filter(near)
        };
        around(exact)
            .chain(around(inside))
            .find(encodes_back)
            .unwrap_or(exact)
    }
}

/// The real number of an integer: `raw * (upper - lower) / (2^n - 1) + lower`.
pub fn real_from_raw(scale: &Scale, width: Unsigned, raw: u64) -> f64 {
    Steps::of_unsigned(scale, width).real(raw)
}

/// The integer for a real number; `None` if the number is not a number or outside the range, which
/// includes its limits.
pub fn raw_from_real(scale: &Scale, width: Unsigned, real: f64) -> Option<u64> {
    Steps::of_unsigned(scale, width).count(real)
}

/// The decimal with the fewest significant digits that encodes back to `raw`.
///
/// Zero counts as a number without digits, so that the middle of a symmetric range displays as 0.
/// Of several decimals with equally many digits, the nearest to [`real_from_raw`] is chosen. Where
/// steps are finer than `f64` can express and no decimal encodes back, the result is
/// [`real_from_raw`] itself.
pub fn shortest_real(scale: &Scale, width: Unsigned, raw: u64) -> f64 {
    Steps::of_unsigned(scale, width).shortest(raw)
}

/// The sign of a sum of products, without rounding. Factors are below 2^66.
fn sign_of_sum(terms: [(i128, f64); 3]) -> Ordering {
    let mut terms = terms.map(|(factor, number)| {
        let (mantissa, exponent) = parts(number);
        (factor * i128::from(mantissa), exponent)
    });
    terms.sort_by_key(|&(_, exponent)| std::cmp::Reverse(exponent));
    let mut sum = 0_i128;
    let mut unit = terms[0].1;
    for (term, exponent) in terms {
        let shift = (unit - exponent).unsigned_abs();
        unit = exponent;
        if sum != 0 {
            // Each term is below 2^119: a sum of 2^121 or more keeps its sign whatever follows.
            if sum.unsigned_abs().ilog2() + shift >= 121 {
                break;
            }
            sum <<= shift;
        }
        sum += term;
    }
    sum.cmp(&0)
}

/// A finite number as `mantissa * 2^exponent`.
fn parts(number: f64) -> (i64, i32) {
    let bits = number.to_bits();
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let (magnitude, exponent) = match ((bits >> 52) & 0x7ff) as i32 {
        0 => (fraction, -1074),
        biased => (fraction | 1 << 52, biased - 1075),
    };
    (
        if number.is_sign_negative() {
            -magnitude
        } else {
            magnitude
        },
        exponent,
    )
}

/// The two decimals with `digits` significant digits around a nonzero number, the nearer first.
fn neighbours(number: f64, digits: usize) -> impl Iterator<Item = f64> {
    // "-1.25e-3" is read as -125 * 10^-5.
    let text = format!("{:.*e}", digits - 1, number.abs());
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let whole: u64 = mantissa.replace('.', "").parse().unwrap_or(0);
    let exponent = exponent.parse::<i32>().unwrap_or(0) - (digits as i32 - 1);
    let decimal = |whole: u64, exponent: i32| -> Option<f64> {
        let magnitude: f64 = format!("{whole}e{exponent}").parse().ok()?;
        Some(magnitude.copysign(number))
    };
    let nearest = decimal(whole, exponent);
    let other = match nearest {
        Some(nearest) if nearest.abs() <= number.abs() => decimal(whole + 1, exponent),
        // Below a power of ten, decimals are ten times as dense.
        _ if whole == 10_u64.pow(digits as u32 - 1) => decimal(whole * 10 - 1, exponent - 1),
        _ => decimal(whole - 1, exponent),
    };
    nearest.into_iter().chain(other)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTHS: [Unsigned; 3] = [Unsigned::U8, Unsigned::U16, Unsigned::U32];

    fn scale(lower: f64, upper: f64, rounding: Rounding) -> Scale {
        Scale {
            lower,
            upper,
            rounding,
        }
    }

    #[test]
    fn the_limits_are_in_the_range_and_their_neighbours_are_not() {
        let range = scale(-5.27, 5.27, Rounding::Round);
        for width in WIDTHS {
            assert_eq!(raw_from_real(&range, width, -5.27), Some(0));
            assert_eq!(raw_from_real(&range, width, 5.27), Some(width.max()));
        }
        for outside in [f64::NAN, f64::INFINITY, 5.27_f64.next_up(), -5.28] {
            assert_eq!(
                raw_from_real(&range, Unsigned::U16, outside),
                None,
                "{outside}"
            );
        }
    }

    #[test]
    fn halves_go_up_and_anything_below_goes_down() {
        let range = scale(0.0, 255.0, Rounding::Round);
        assert_eq!(raw_from_real(&range, Unsigned::U8, 7.5), Some(8));
        assert_eq!(
            raw_from_real(&range, Unsigned::U8, 7.5_f64.next_down()),
            Some(7)
        );
        assert_eq!(
            raw_from_real(&range, Unsigned::U8, f64::MIN_POSITIVE),
            Some(0)
        );
    }

    #[test]
    fn floor_goes_down_and_ceiling_goes_up() {
        let floor = scale(-255.0, 0.0, Rounding::Floor);
        let ceiling = scale(-255.0, 0.0, Rounding::Ceiling);
        for (real, down, up) in [
            (-255.0, 0, 0),
            (-254.5, 0, 1),
            (-254.0, 1, 1),
            (-0.1, 254, 255),
        ] {
            assert_eq!(
                raw_from_real(&floor, Unsigned::U8, real),
                Some(down),
                "{real}"
            );
            assert_eq!(
                raw_from_real(&ceiling, Unsigned::U8, real),
                Some(up),
                "{real}"
            );
        }
        let tiny = -f64::from_bits(1);
        assert_eq!(raw_from_real(&floor, Unsigned::U8, tiny), Some(254));
        assert_eq!(raw_from_real(&ceiling, Unsigned::U8, tiny), Some(255));
    }

    #[test]
    fn extreme_ranges_are_exact_too() {
        let wide = scale(-f64::MAX, f64::MAX, Rounding::Round);
        assert_eq!(raw_from_real(&wide, Unsigned::U8, -f64::MAX), Some(0));
        assert_eq!(raw_from_real(&wide, Unsigned::U8, 0.0), Some(128));
        assert_eq!(
            raw_from_real(&wide, Unsigned::U64, f64::MAX),
            Some(u64::MAX)
        );
        let one = scale(0.0, 1.0, Rounding::Round);
        assert_eq!(raw_from_real(&one, Unsigned::U64, 0.5), Some(1 << 63));
        assert_eq!(raw_from_real(&one, Unsigned::U64, 1.0), Some(u64::MAX));
    }

    #[test]
    fn the_shortest_decimal_is_short() {
        let angle = scale(-180.0, 180.0, Rounding::Round);
        assert_eq!(shortest_real(&angle, Unsigned::U32, 1 << 31), 0.0);
        assert_eq!(shortest_real(&angle, Unsigned::U32, u32::MAX.into()), 180.0);
        let percent = scale(0.0, 100.0, Rounding::Round);
        assert_eq!(shortest_real(&percent, Unsigned::U8, 1), 0.4);
        assert_eq!(shortest_real(&percent, Unsigned::U8, 255), 100.0);
        // 2.3457 would be nearest to the upper limit, but lies beyond it.
        let odd = scale(0.0, 2.3456963, Rounding::Round);
        assert_eq!(shortest_real(&odd, Unsigned::U16, 65535), 2.34569);
    }

    #[test]
    fn the_zero_of_a_signed_integer_is_the_centre_of_its_range() {
        let steps = |lower, upper, signed| {
            let range = scale(lower, upper, Rounding::Round);
            Steps::of(&range, Number::Signed(signed)).unwrap()
        };
        let height = steps(-10000.0, 35000.0, Signed::I32);
        for (raw, real) in [
            (0, 12500.0),
            (i64::from(i32::MAX), 35000.0),
            (-i64::from(i32::MAX), -10000.0),
        ] {
            assert_eq!(height.shown(Raw::Signed(raw)), Some(real));
            assert_eq!(height.raw(real), Some(Raw::Signed(raw)));
        }
        assert_eq!(height.raw(35000.1), None);
        // Halves go up, exactly.
        let percent = steps(-100.0, 100.0, Signed::I16);
        assert_eq!(percent.raw(50.0), Some(Raw::Signed(16384)));
        assert_eq!(percent.raw(-50.0), Some(Raw::Signed(-16383)));
        let octet = steps(-127.0, 127.0, Signed::I8);
        for raw in -128..=127 {
            let real = octet.shown(Raw::Signed(raw)).unwrap();
            assert_eq!(real, raw as f64);
            assert_eq!(octet.raw(real), Some(Raw::Signed(raw)));
        }
        assert_eq!(octet.shown(Raw::Unsigned(1)), None);
    }

    #[test]
    fn every_octet_comes_back_from_its_shortest_decimal() {
        for rounding in [Rounding::Round, Rounding::Floor, Rounding::Ceiling] {
            for (lower, upper) in [
                (0.0, 100.0),
                (-0.3, 0.7),
                (-1e-9, 1e9),
                (99.9, 100.1),
                (-30.0 / 7.0, -12.0 / 7.0),
            ] {
                let range = scale(lower, upper, rounding);
                for raw in 0..=255 {
                    let real = shortest_real(&range, Unsigned::U8, raw);
                    assert_eq!(
                        raw_from_real(&range, Unsigned::U8, real),
                        Some(raw),
                        "{range:?}"
                    );
                }
            }
        }
    }
}
