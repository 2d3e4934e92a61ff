//! Exact floating-point arithmetic, for the few values so close to a rounding boundary that
//! ordinary arithmetic cannot decide the side.
//!
//! A sum of products is kept as an expansion: non-overlapping floating-point numbers whose exact
//! sum is the value (Shewchuk 1997). The sign of the expansion is the sign of its largest part.

use core::cmp::Ordering;

/// An exact sum of at most [`PARTS`](Self::PARTS) floating-point numbers.
#[derive(Debug, Default)]
pub(super) struct Expansion {
    /// The first `len` are used, sorted from small to large, without zeros.
    parts: [f64; Self::PARTS],
    len: usize,
}

impl Expansion {
    const PARTS: usize = 16;

    /// Adds `(a - b) * factor`. At most two calls fit into one expansion.
    pub(super) fn add_product_of_difference(&mut self, a: f64, b: f64, factor: i128) {
        let (difference, rest) = two_sum(a, -b);
        let low = factor % (1 << 33);
        for factor in [low as f64, (factor - low) as f64] {
            self.add_product(rest, factor);
            self.add_product(difference, factor);
        }
    }

    fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        self.add(product_error(a, b, product));
        self.add(product);
    }

    fn add(&mut self, value: f64) {
        let mut sum = value;
        let mut kept = 0;
        for i in 0..self.len {
            let (high, low) = two_sum(sum, self.parts[i]);
            sum = high;
            if low != 0.0 {
                self.parts[kept] = low;
                kept += 1;
            }
        }
        if sum != 0.0 && kept < Self::PARTS {
            self.parts[kept] = sum;
            kept += 1;
        }
        self.len = kept;
    }

    /// Compares the sum with zero.
    pub(super) fn sign(&self) -> Ordering {
        match self.parts[..self.len].last() {
            Some(&largest) if largest > 0.0 => Ordering::Greater,
            Some(_) => Ordering::Less,
            None => Ordering::Equal,
        }
    }
}

/// The rounded sum and its exact rounding error (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    let a_part = sum - b_part;
    (sum, (a - a_part) + (b - b_part))
}

/// The rounding error of a finite product that neither overflows nor underflows, exactly.
fn product_error(a: f64, b: f64, product: f64) -> f64 {
    let ((a, a_exponent), (b, b_exponent)) = (parts(a), parts(b));
    let (rounded, exponent) = parts(product);
    // Without a bit more than the rounded product, the product is exact.
    let Ok(shift @ 1..=64) = u32::try_from(exponent - (a_exponent + b_exponent)) else {
        return 0.0;
    };
    let error = a * b - (rounded << shift);
    error as f64 * power_of_two(a_exponent) * power_of_two(b_exponent)
}

/// The integer and the exponent of two whose product a finite number is.
const fn parts(number: f64) -> (i128, i32) {
    let bits = number.to_bits();
    let exponent = (bits >> 52 & 0x7FF) as i32;
    let fraction = (bits & 0xF_FFFF_FFFF_FFFF) as i128;
    let (integer, exponent) = match exponent {
        0 => (fraction, -1074),
        _ => (fraction | 1 << 52, exponent - 1075),
    };
    (if bits >> 63 == 1 { -integer } else { integer }, exponent)
}

/// Two to the power of an exponent from [`parts`].
const fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(match exponent {
        -1022.. => ((exponent + 1023) as u64) << 52,
        _ => 1 << (exponent + 1074),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sign_of(a: f64, b: f64, factor: i128, c: f64, d: f64, other: i128) -> Ordering {
        let mut sum = Expansion::default();
        sum.add_product_of_difference(a, b, factor);
        sum.add_product_of_difference(c, d, -other);
        sum.sign()
    }

    #[test]
    fn a_difference_below_the_precision_of_f64_is_seen() {
        let above = f64::from_bits(0.3_f64.to_bits() + 1);
        assert_eq!(sign_of(0.3, -1e9, 3, 0.3, -1e9, 3), Ordering::Equal);
        assert_eq!(sign_of(above, -1e9, 3, 0.3, -1e9, 3), Ordering::Greater);
        assert_eq!(sign_of(0.3, -1e9, 3, above, -1e9, 3), Ordering::Less);
    }

    #[test]
    fn factors_of_sixty_five_bits_are_exact() {
        let factor = (1 << 65) - 1;
        assert_eq!(
            sign_of(1.0, 0.0, factor, 1.0, 0.0, factor - 1),
            Ordering::Greater
        );
        assert_eq!(sign_of(1.0, 0.0, factor, 1.0, 0.0, factor), Ordering::Equal);
    }

    #[test]
    fn the_rounding_error_of_a_product_is_exact() {
        let numbers = [
            0.0,
            1.0,
            -1.0,
            0.1,
            -0.3,
            1e9 / 3.0,
            1e-9 / 7.0,
            -65_535.0,
            1e100 / 3.0,
            2.5e-100,
            4_294_967_295.0,
            f64::from_bits(0x4340_0000_0000_0001),
            1e-280,
            -123_456.789,
        ];
        for a in numbers {
            for b in numbers {
                let product = a * b;
                let expected = a.mul_add(b, -product);
                assert_eq!(product_error(a, b, product), expected, "{a} * {b}");
            }
        }
    }
}
