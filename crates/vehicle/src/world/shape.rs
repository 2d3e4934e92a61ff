//! Intersection test of two shapes, on a plane tangent to the globe near them.

use super::object::{Geometry, Place};

/// Metres per degree of latitude, for the mean radius of the earth.
pub(super) const METRES_PER_DEGREE: f64 = 111_195.0;

/// Metres north and east of the origin.
type Point = [f64; 2];

/// Points on a plane, and their interpretation.
pub(super) struct Shape {
    geometry: Geometry,
    points: Vec<Point>,
}

impl Shape {
    /// Projects a shape onto the plane tangent to the globe at `origin`.
    pub(super) fn new(geometry: Geometry, places: &[Place], origin: Place) -> Self {
        let (latitude, longitude) = origin.degrees();
        let shrink = latitude.to_radians().cos();
        let points = places.iter().map(|place| {
            let (north, east) = place.degrees();
            [
                (north - latitude) * METRES_PER_DEGREE,
                around(east - longitude) * METRES_PER_DEGREE * shrink,
            ]
        });
        Self {
            geometry,
            points: points.collect(),
        }
    }

    /// Whether the distance between two shapes is at most `reach` metres.
    pub(super) fn meets(&self, other: &Self, reach: f64) -> bool {
        self.holds_some_of(other) || other.holds_some_of(self) || {
            let reach = reach * reach;
            self.edges().any(|[a, b]| {
                let mut edges = other.edges();
                edges.any(|[c, d]| between_edges(a, b, c, d) <= reach)
            })
        }
    }

    /// Whether this shape encloses a point of the other. For a connected shape the first point
    /// suffices: if any point is enclosed, either all are or the edges cross.
    fn holds_some_of(&self, other: &Self) -> bool {
        self.geometry == Geometry::Polygon
            && other.points.first().is_some_and(|point| self.holds(*point))
    }

    /// Counts how often a ray from the point crosses the boundary.
    fn holds(&self, [x, y]: Point) -> bool {
        let crossings = self.edges().filter(|[a, b]| {
            (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0]
        });
        crossings.count() % 2 == 1
    }

    /// The edges between consecutive points. A single point is an edge of zero length.
    fn edges(&self) -> impl Iterator<Item = [Point; 2]> + '_ {
        let closing = match (self.geometry, self.points.first(), self.points.last()) {
            (Geometry::Polygon, Some(&first), Some(&last)) => Some([last, first]),
            (_, Some(&first), _) if self.points.len() == 1 => Some([first, first]),
            _ => None,
        };
        let sides = self.points.windows(2).map(|pair| [pair[0], pair[1]]);
        sides.chain(closing)
    }
}

/// A difference of longitudes, taken the short way around the globe.
fn around(degrees: f64) -> f64 {
    (degrees + 180.0).rem_euclid(360.0) - 180.0
}

/// The squared distance between two edges.
fn between_edges(a: Point, b: Point, c: Point, d: Point) -> f64 {
    if cross(a, b, c, d) {
        return 0.0;
    }
    let ends = [
        to_edge(a, c, d),
        to_edge(b, c, d),
        to_edge(c, a, b),
        to_edge(d, a, b),
    ];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

/// Whether each edge has its ends on different sides of the other.
fn cross(a: Point, b: Point, c: Point, d: Point) -> bool {
    let apart = |a, b, c, d| side(a, b, c) * side(a, b, d) < 0.0;
    apart(a, b, c, d) && apart(c, d, a, b)
}

/// The side of the line from `a` to `b` on which a point lies, as the sign.
fn side(a: Point, b: Point, point: Point) -> f64 {
    (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])
}

/// The squared distance from a point to an edge.
fn to_edge(point: Point, a: Point, b: Point) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let from = [point[0] - a[0], point[1] - a[1]];
    let length = along[0] * along[0] + along[1] * along[1];
    let share = if length > 0.0 {
        ((from[0] * along[0] + from[1] * along[1]) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let away = [from[0] - share * along[0], from[1] - share * along[1]];
    away[0] * away[0] + away[1] * away[1]
}
