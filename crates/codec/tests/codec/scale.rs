//! Real numbers as scaled integers.

use std::f64::consts::PI;

use jaus_codec::Rounding::{Ceiling, Floor, Round};
use jaus_codec::{OutOfRange, Rounding, Scale, Scaled};

use crate::messages::{Course, Depth};

const ROUNDINGS: [Rounding; 3] = [Round, Floor, Ceiling];

/// A signed octet in steps of a half, of which -64 is one below the range.
const fn halves(rounding: Rounding) -> Scale {
    Scale::of_integer(-63.5, 63.5, -128, 127, rounding)
}

#[test]
fn a_scale_reaches_from_its_lower_limit_to_its_upper_limit() {
    let scale = halves(Round);
    let limits = (scale.lower(), scale.upper(), scale.step());
    assert_eq!(limits, (-63.5, 63.5, 0.5));
    for (raw, value) in [(0, -64.0), (1, -63.5), (128, 0.0), (255, 63.5)] {
        assert_eq!((scale.value(raw), scale.raw(value)), (value, Some(raw)));
    }
    let unsigned = Scale::of_integer(0.0, 127.5, 0, 255, Round);
    for (raw, value) in [(0, 0.0), (1, 0.5), (255, 127.5)] {
        assert_eq!(
            (unsigned.value(raw), unsigned.raw(value)),
            (value, Some(raw))
        );
    }
    for outside in [-0.5, 0_f64.next_down(), 127.5_f64.next_up(), f64::NAN] {
        assert_eq!(unsigned.raw(outside), None, "{outside}");
    }
    // Three steps of a third are more than the range.
    let upper = -11.0 / 3.0;
    assert_eq!(Scale::new(-10.0, upper, 3, Round).value(3), upper);
}

#[test]
fn the_integer_below_a_signed_range_stands_for_its_own_value() {
    // Least number of it, greatest number of it.
    for (rounding, greatest) in [
        (Round, (-63.75_f64).next_down()),
        (Floor, (-63.5_f64).next_down()),
        (Ceiling, -64.0),
    ] {
        let scale = halves(rounding);
        let least = -64.25_f64;
        for (value, raw) in [
            (least.next_down(), None),
            (least, Some(0)),
            (-64.0, Some(0)),
            (greatest, Some(0)),
            (greatest.next_up(), Some(1)),
            (-63.5, Some(1)),
            (f64::NAN, None),
        ] {
            assert_eq!(scale.raw(value), raw, "{value} in {rounding:?}");
        }
    }
}

#[test]
fn numbers_between_two_steps_are_rounded_as_the_definition_says() {
    for (steps, round, floor, ceiling) in [
        (6.25, 6, 6, 7),
        (6.5, 7, 6, 7),
        (6.75, 7, 6, 7),
        (7.0, 7, 7, 7),
        (253.999, 254, 253, 254),
    ] {
        let raw = ROUNDINGS.map(|rounding| Scale::new(-2.0, 253.0, 255, rounding).raw(steps - 2.0));
        assert_eq!(raw, [round, floor, ceiling].map(Some), "{steps}");
    }
    // 64 bits: the half is exact where a product of floating-point numbers is not.
    let top = u64::MAX;
    for (value, round, floor, ceiling) in [
        (0.5, 1 << 63, (1 << 63) - 1, 1 << 63),
        (1_f64.next_down(), top - 2048, top - 2048, top - 2047),
        (1.0, top, top, top),
    ] {
        let raw = ROUNDINGS.map(|rounding| Scale::new(0.0, 1.0, top, rounding).raw(value));
        assert_eq!(raw, [round, floor, ceiling].map(Some), "{value}");
    }
}

/// A multiple of 2^-80 as a whole number.
fn whole(value: f64) -> i128 {
    let units = value * 2_f64.powi(80);
    assert_eq!(units.fract(), 0.0, "{value} is too fine");
    units as i128
}

/// The steps from the lower limit to a number, by whole numbers alone.
fn steps(value: f64, (lower, upper): (f64, f64), max: u64, rounding: Rounding) -> i128 {
    let range = whole(upper) - whole(lower);
    let above = (whole(value) - whole(lower)) * i128::from(max);
    match rounding {
        Round => (2 * above + range).div_euclid(2 * range),
        Floor => above.div_euclid(range),
        Ceiling => (above + range - 1).div_euclid(range),
    }
}

#[test]
fn numbers_beside_a_boundary_are_rounded_exactly() {
    let limits = [
        (0.0, 1.0),
        (-0.1, 0.2),
        (-7.3, -1.1),
        (-PI, PI),
        (-90.0, 90.0),
        (0.3, 16.1),
    ];
    for (lower, upper) in limits {
        for (rounding, max) in ROUNDINGS.into_iter().zip([7, 254, 65_535]).cycle().take(9) {
            let scale = Scale::new(lower, upper, max, rounding);
            for half in (0..=2 * max).step_by(1 + max as usize / 100) {
                let place = lower + half as f64 * (scale.step() / 2.0);
                for value in [place.next_down(), place, place.next_up()] {
                    if value < lower || value > upper {
                        assert_eq!(scale.raw(value), None);
                    } else if value == 0.0 || value.abs() > 1e-7 {
                        let exact = steps(value, (lower, upper), max, rounding);
                        let raw = scale.raw(value).map(i128::from);
                        assert_eq!(raw, Some(exact), "{value} in {scale:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_shortest_decimal_of_an_integer_stands_for_it() {
    let limits = [
        (0.0, 1.0),
        (-PI, PI),
        (-7.3, -1.1),
        (-30.0 / 7.0, -17.0 / 7.0),
        (-10.0, -11.0 / 3.0),
    ];
    for (lower, upper) in limits {
        for rounding in ROUNDINGS {
            for max in [1, 3, 13, 254, 255] {
                let scale = Scale::new(lower, upper, max, rounding);
                for raw in 0..=max {
                    let shortest = scale.shortest(raw);
                    assert_eq!(scale.raw(shortest), Some(raw), "{shortest} in {scale:?}");
                }
            }
        }
    }
}

#[test]
fn the_shortest_decimal_has_no_digit_too_many() {
    let sevenths = |numerator: f64| numerator / 7.0;
    for (lower, upper, max, rounding, raw, shortest) in [
        (0.0, 655.35, 65535, Round, 1234, 12.34),
        (0.0, 655.35, 65535, Round, 65535, 655.35),
        (0.0, 1e-9, 1000, Round, 57, 5.7e-11),
        (-PI, PI, 65534, Round, 32767, 0.0),
        (-PI, PI, 65534, Round, 3, -3.1413),
        (0.0, 10.0, 10, Floor, 3, 3.0),
        (0.0, 10.0, 10, Ceiling, 3, 3.0),
        // The nearest decimal is outside the range, the next one is inside: below, above, and
        // below a power of ten.
        (0.0, 3.6, 2, Round, 2, 3.0),
        (3.4, 7.0, 2, Round, 0, 4.0),
        (-3.6, 0.0, 2, Round, 0, -3.0),
        (0.0, 0.96, 4, Round, 4, 0.9),
        (0.0, 0.996, 8, Round, 8, 0.99),
        // The computed value is on the wrong side of the boundary.
        (sevenths(-30.0), sevenths(20.0), 5, Floor, 3, 0.7),
        (-3.0, 0.3, 11, Ceiling, 10, -0.1),
        // Only the limit itself is rounded down to the greatest integer.
        (-10.0, -11.0 / 3.0, 3, Floor, 3, -11.0 / 3.0),
    ] {
        let scale = Scale::new(lower, upper, max, rounding);
        assert_eq!(scale.shortest(raw), shortest, "{raw} in {scale:?}");
    }
    assert_eq!(halves(Round).shortest(0), -64.0);
    // Steps finer than a real number: the value itself.
    let fine = Scale::new(0.0, 1.0, u64::MAX, Round);
    let raw = (1 << 62) + 1;
    assert_eq!(fine.shortest(raw), fine.value(raw));
}

#[test]
fn a_scaled_field_takes_and_gives_real_numbers() {
    let depth = Depth::new(12.344).unwrap();
    assert_eq!((depth.raw(), depth.value()), (1234, 12.34));
    assert_eq!(format!("{depth} {depth:?} {depth:6}"), "12.34 12.34  12.34");
    assert_eq!(Depth::from_real(655.35).unwrap().raw(), u16::MAX);
    for (raw, value) in [
        (i16::MIN, -3.2768),
        (-32767, -3.2767),
        (0, 0.0),
        (i16::MAX, 3.2767),
    ] {
        assert_eq!(Course::new(value).unwrap().raw(), raw);
        assert_eq!(Course::from_raw(raw).to_string(), value.to_string());
    }
    assert_eq!(Course::from_raw(i16::MAX).to_real(), 3.2767);
}

#[test]
fn a_number_outside_its_range_is_refused_with_the_range() {
    let error = Depth::new(-0.5).unwrap_err();
    let expected = OutOfRange {
        field: "Depth",
        value: -0.5,
        lower: 0.0,
        upper: 655.35,
        unit: "meter",
    };
    assert_eq!(error, expected);
    assert_eq!(error.to_string(), "Depth: -0.5 is not in 0 to 655.35 meter");
    let ratio = OutOfRange {
        unit: "one",
        ..error
    };
    assert_eq!(ratio.to_string(), "Depth: -0.5 is not in 0 to 655.35");
    assert_eq!(Course::new(3.3).unwrap_err().field, "Course");
}
