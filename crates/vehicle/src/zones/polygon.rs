//! Simple polygons: their check, and the distance of a point from them.

/// A point of the local frame: X (north) and Y (east) in metres.
pub type Point = (f64, f64);

/// A polygon without crossing edges. The last vertex joins the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    vertices: Vec<Point>,
    /// The corners of the box around it.
    least: Point,
    most: Point,
}

/// Why vertices make no polygon.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonError {
    /// Fewer than three different vertices.
    #[error("it has {0} different vertices: set at least 3")]
    TooFew(usize),
    /// More vertices than a message holds.
    #[error("it has {0} vertices: set at most {max}, the most that a message holds", max = Polygon::MAX_VERTICES)]
    TooMany(usize),
    /// A coordinate is not a number, or infinite.
    #[error("vertex {0} is not at a finite place: set numbers of metres or degrees")]
    NotFinite(usize),
    /// Two edges cross or touch, counted from 1.
    #[error("edges {0} and {1} cross or touch: list the vertices in their order along the edge")]
    Crossing(usize, usize),
}

impl Polygon {
    /// The most vertices: the count in messages is one octet.
    pub const MAX_VERTICES: usize = 255;

    /// Checks the vertices. Repetitions of a vertex, and of the first one at the end, are dropped.
    ///
    /// # Errors
    /// If they do not enclose one area.
    pub fn new(mut vertices: Vec<Point>) -> Result<Self, PolygonError> {
        if vertices.len() > Self::MAX_VERTICES {
            return Err(PolygonError::TooMany(vertices.len()));
        }
        let is_finite = |&(x, y): &Point| x.is_finite() && y.is_finite();
        if let Some(index) = vertices.iter().position(|it| !is_finite(it)) {
            return Err(PolygonError::NotFinite(index + 1));
        }
        vertices.dedup();
        while vertices.len() > 1 && vertices.first() == vertices.last() {
            vertices.pop();
        }
        if vertices.len() < 3 {
            return Err(PolygonError::TooFew(vertices.len()));
        }
        let bound = |pick: fn(f64, f64) -> f64| {
            let mut all = vertices.iter().copied();
            let first = all.next().unwrap_or_default();
            all.fold(first, |a, b| (pick(a.0, b.0), pick(a.1, b.1)))
        };
        let polygon = Self {
            least: bound(f64::min),
            most: bound(f64::max),
            vertices,
        };
        match polygon.crossing() {
            Some((a, b)) => Err(PolygonError::Crossing(a + 1, b + 1)),
            None => Ok(polygon),
        }
    }

    /// The vertices in their order.
    #[must_use]
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// The edges, each from a vertex to the next.
    pub fn edges(&self) -> impl Iterator<Item = (Point, Point)> + Clone {
        let next = self.vertices.iter().cycle().skip(1);
        self.vertices.iter().copied().zip(next.copied())
    }

    /// Distance of a point from the edge in metres; negative inside.
    #[must_use]
    pub fn signed_distance(&self, point: Point) -> f64 {
        let mut nearest = f64::INFINITY;
        let mut inside = false;
        for (a, b) in self.edges() {
            nearest = nearest.min(squared_distance(point, a, b));
            inside ^= crosses_ray(point, a, b);
        }
        let distance = nearest.sqrt();
        if inside { -distance } else { distance }
    }

    /// Lower bound of the distance of a point; 0 in the box around the polygon.
    pub(super) fn least_distance(&self, (x, y): Point) -> f64 {
        let beyond = |at: f64, least: f64, most: f64| (least - at).max(at - most).max(0.0);
        beyond(x, self.least.0, self.most.0).hypot(beyond(y, self.least.1, self.most.1))
    }

    /// The first two edges that cross or touch without being neighbours, or that run back over
    /// each other.
    fn crossing(&self) -> Option<(usize, usize)> {
        let edges: Vec<_> = self.edges().collect();
        let count = edges.len();
        for (i, &(a, b)) in edges.iter().enumerate() {
            for (j, &(c, d)) in edges.iter().enumerate().skip(i + 1) {
                let found = if j == i + 1 {
                    runs_back(a, b, d)
                } else if i == 0 && j == count - 1 {
                    runs_back(c, d, b)
                } else {
                    meet((a, b), (c, d))
                };
                if found {
                    return Some((i, j));
                }
            }
        }
        None
    }
}

/// Twice the signed area of a triangle: the side of `a`-`b` on which `c` lies.
fn side(a: Point, b: Point, c: Point) -> f64 {
    (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
}

/// Whether the edge from `b` to `c` runs back over the one from `a` to `b`.
fn runs_back(a: Point, b: Point, c: Point) -> bool {
    let ahead = (b.0 - a.0) * (c.0 - b.0) + (b.1 - a.1) * (c.1 - b.1);
    side(a, b, c) == 0.0 && ahead < 0.0
}

/// Whether two edges have a point in common.
fn meet((a, b): (Point, Point), (c, d): (Point, Point)) -> bool {
    let (ab_c, ab_d) = (side(a, b, c), side(a, b, d));
    let (cd_a, cd_b) = (side(c, d, a), side(c, d, b));
    if ab_c * ab_d < 0.0 && cd_a * cd_b < 0.0 {
        return true;
    }
    let within = |p: Point, q: Point, r: Point| {
        (p.0.min(q.0)..=p.0.max(q.0)).contains(&r.0) && (p.1.min(q.1)..=p.1.max(q.1)).contains(&r.1)
    };
    (ab_c == 0.0 && within(a, b, c))
        || (ab_d == 0.0 && within(a, b, d))
        || (cd_a == 0.0 && within(c, d, a))
        || (cd_b == 0.0 && within(c, d, b))
}

/// Whether the ray from `point` along Y crosses the edge from `a` to `b`.
fn crosses_ray((x, y): Point, a: Point, b: Point) -> bool {
    (a.0 > x) != (b.0 > x) && y < (b.1 - a.1) * (x - a.0) / (b.0 - a.0) + a.1
}

/// Distance of a point from the line between two others.
pub(crate) fn distance(point: Point, a: Point, b: Point) -> f64 {
    match a == b {
        true => (point.0 - a.0).hypot(point.1 - a.1),
        false => squared_distance(point, a, b).sqrt(),
    }
}

/// Square of the distance of a point from the edge from `a` to `b`.
fn squared_distance((x, y): Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let along = ((x - a.0) * dx + (y - a.1) * dy) / (dx * dx + dy * dy);
    let along = along.clamp(0.0, 1.0);
    let (px, py) = (x - a.0 - along * dx, y - a.1 - along * dy);
    px * px + py * py
}
