//! Whether what two sets of points describe meets, on a plane that touches the globe near them.

use super::object::{Geometry, Place};

/// Metres in a degree of latitude on a globe of the mean radius of the earth.
pub(super) const METRES_PER_DEGREE: f64 = 111_195.0;

/// Metres north and east of somewhere.
type Point = [f64; 2];

/// Points on a plane and what they are.
pub(super) struct Shape {
    geometry: Geometry,
    points: Vec<Point>,
}

impl Shape {
    /// A shape on the plane that touches the globe at `origin`.
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

    /// Whether the two come as close to each other as `reach` metres.
    pub(super) fn meets(&self, other: &Self, reach: f64) -> bool {
        self.holds_some_of(other) || other.holds_some_of(self) || {
            let reach = reach * reach;
            self.edges().any(|[a, b]| {
                let mut edges = other.edges();
                edges.any(|[c, d]| between_edges(a, b, c, d) <= reach)
            })
        }
    }

    /// Whether this encloses a point of the other. If it encloses one of a connected shape, either
    /// it encloses all of it or their edges cross; so the first will do.
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

    /// The lines between neighbouring points; a lone point is a line without length.
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

/// A difference of longitudes the short way around the globe.
fn around(degrees: f64) -> f64 {
    (degrees + 180.0).rem_euclid(360.0) - 180.0
}

/// The square of the distance between two edges.
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

/// Whether each edge has its ends on both sides of the other.
fn cross(a: Point, b: Point, c: Point, d: Point) -> bool {
    let apart = |a, b, c, d| side(a, b, c) * side(a, b, d) < 0.0;
    apart(a, b, c, d) && apart(c, d, a, b)
}

/// On which side of the line from `a` to `b` a point is.
fn side(a: Point, b: Point, point: Point) -> f64 {
    (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])
}

/// The square of the distance from a point to an edge.
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
