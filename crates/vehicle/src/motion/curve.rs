//! Path segments of AS6009: rational quadratic curves from a start to an end, drawn towards a
//! control point.

/// A curve between two points, drawn towards a third: a rational quadratic Bézier curve with end
/// weights of 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    /// Start point (P0): X and Y in metres.
    pub start: (f64, f64),
    /// Control point (P1).
    pub control: (f64, f64),
    /// End point (P2).
    pub end: (f64, f64),
    /// Weight of the control point, 0 to 500. 0 gives a straight line.
    pub weight: f64,
}

impl Curve {
    /// The point at a parameter between 0 (start) and 1 (end).
    #[must_use]
    pub fn point(&self, parameter: f64) -> (f64, f64) {
        let u = parameter.clamp(0.0, 1.0);
        let (first, second, third) = (
            (1.0 - u) * (1.0 - u),
            2.0 * u * (1.0 - u) * self.weight,
            u * u,
        );
        let sum = first + second + third;
        let mix = |a, b, c| (first * a + second * b + third * c) / sum;
        (
            mix(self.start.0, self.control.0, self.end.0),
            mix(self.start.1, self.control.1, self.end.1),
        )
    }

    /// Points along the curve, dense enough to follow.
    pub(super) fn points(&self) -> Vec<(f64, f64)> {
        (0..=Self::POINTS)
            .map(|index| self.point(f64::from(index) / f64::from(Self::POINTS)))
            .collect()
    }

    /// Heading at the end in radians.
    pub(super) fn final_heading(&self) -> f64 {
        let from = match self.weight > 0.0 && self.control != self.end {
            true => self.control,
            false => self.start,
        };
        (self.end.1 - from.1).atan2(self.end.0 - from.0)
    }

    /// Number of sections between points.
    pub(super) const POINTS: u16 = 256;
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARC: Curve = Curve {
        start: (1.0, 0.0),
        control: (1.0, 1.0),
        end: (0.0, 1.0),
        weight: std::f64::consts::FRAC_1_SQRT_2,
    };

    #[test]
    fn with_the_right_weight_it_is_a_quarter_of_a_circle() {
        for (x, y) in ARC.points() {
            assert!((x.hypot(y) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn without_weight_it_is_a_straight_line() {
        let line = Curve { weight: 0.0, ..ARC };
        for (x, y) in line.points() {
            assert!((x + y - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn it_starts_and_ends_where_it_says_whatever_the_weight() {
        for weight in [0.0, 1.0, 500.0] {
            let curve = Curve { weight, ..ARC };
            assert_eq!(curve.point(0.0), curve.start);
            assert_eq!(curve.point(1.0), curve.end);
        }
    }
}
