//! Planning: from where the vehicle is to where it is to be, over a map.

use super::ground::Ground;
use super::{Terrain, search, sight};

/// A point of the local frame: X (north) and Y (east) in metres.
pub type Point = (f64, f64);

/// What the vehicle needs of its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vehicle {
    /// How wide it is, in metres.
    pub width: f64,
    /// How much room it is to have on both sides, in metres.
    pub margin: f64,
}

impl Default for Vehicle {
    fn default() -> Self {
        Self {
            width: 0.6,
            margin: 0.1,
        }
    }
}

impl Vehicle {
    /// How far its middle stays from what nothing can drive on, in metres.
    #[must_use]
    pub fn clearance(&self) -> f64 {
        self.width / 2.0 + self.margin
    }
}

/// A way that can be driven: straight segments from corner to corner.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Path {
    points: Vec<Point>,
}

impl Path {
    /// The most segments that a path may have: what a list of a driver holds.
    pub const MAX_SEGMENTS: usize = 4096;

    /// A path over these corners, the start first.
    #[must_use]
    pub const fn new(points: Vec<Point>) -> Self {
        Self { points }
    }

    /// Its corners, the start first and the destination last.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Its segments: start and end of each.
    pub fn segments(&self) -> impl ExactSizeIterator<Item = (Point, Point)> {
        let ends = self.points.iter().skip(1);
        self.points.iter().zip(ends).map(|(&from, &to)| (from, to))
    }

    /// How long it is, in metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.remaining(0)
    }

    /// How long it is from the beginning of a segment on, counted from 0, in metres.
    #[must_use]
    pub fn remaining(&self, segment: usize) -> f64 {
        let segments = self.segments().skip(segment);
        segments.map(|(a, b)| (b.0 - a.0).hypot(b.1 - a.1)).sum()
    }
}

/// Why there is no path.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoPath {
    /// The destination is not on the map.
    #[error(
        "the destination at {} is not on the map, which goes from {} to {}: choose one on the map, \
         or give the store a larger map", At(*.destination), At(.corners[0]), At(.corners[1])
    )]
    DestinationOutside {
        /// Where it is.
        destination: Point,
        /// The south-west and the north-east corner of the map.
        corners: [Point; 2],
    },
    /// The destination is in an obstacle, or too close to one.
    #[error(
        "the destination at {} is closer than {clearance:.2} m to an obstacle: choose one in the open",
        At(*.destination)
    )]
    DestinationBlocked {
        /// Where it is.
        destination: Point,
        /// How far the vehicle's middle has to be from obstacles, in metres.
        clearance: f64,
    },
    /// The vehicle is not on the map.
    #[error(
        "the vehicle at {} is not on the map, which goes from {} to {}: drive it there by hand, or \
         set its pose right", At(*.start), At(.corners[0]), At(.corners[1])
    )]
    StartOutside {
        /// Where it is.
        start: Point,
        /// The south-west and the north-east corner of the map.
        corners: [Point; 2],
    },
    /// The vehicle is in an obstacle, as the map has it.
    #[error(
        "the vehicle at {} is in an obstacle, as the map has it: drive it out by hand, or set its \
         pose or the map right", At(*.start)
    )]
    StartBlocked {
        /// Where it is.
        start: Point,
    },
    /// There is no way to the destination for a vehicle of this size.
    #[error(
        "no way leads from {} to {} for a vehicle that keeps {clearance:.2} m from obstacles: clear \
         one, correct the map, or choose another destination", At(*.start), At(*.destination)
    )]
    Unreachable {
        /// Where the vehicle is.
        start: Point,
        /// Where it is to be.
        destination: Point,
        /// How far the vehicle's middle has to be from obstacles, in metres.
        clearance: f64,
    },
    /// The way has too many segments for a driver's list.
    #[error(
        "the way to {} has {segments} segments, and a driver takes {} at most: choose a destination \
         on the way", At(*.destination), Path::MAX_SEGMENTS
    )]
    TooLong {
        /// Where it leads.
        destination: Point,
        /// How many segments it has.
        segments: usize,
    },
}

impl NoPath {
    /// Whether there may be a path later although nobody changes the wish: what stands in the way
    /// now may move.
    #[must_use]
    pub const fn may_pass(&self) -> bool {
        matches!(self, Self::Unreachable { .. })
    }
}

/// A point for people.
struct At(Point);

impl std::fmt::Display for At {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self((x, y)) = *self;
        write!(f, "x {x:.2} m, y {y:.2} m")
    }
}

/// The best path over a map that the vehicle has room on: short, and over good ground rather than
/// bad. On maps with more than 512 times 512 cells it may be a little dearer than the best.
///
/// On the largest map, 4096 times 4096 cells, this takes some 60 MB and a second or two at most;
/// `docs/performance.md` has the figures. An async caller gives it a thread of its own.
///
/// # Errors
/// [`NoPath`] says why there is none and what to do.
pub fn plan(
    terrain: &Terrain,
    vehicle: &Vehicle,
    start: Point,
    destination: Point,
) -> Result<Path, NoPath> {
    let corners = terrain.corners();
    let from = terrain
        .to_grid(start)
        .ok_or(NoPath::StartOutside { start, corners })?;
    let to = terrain
        .to_grid(destination)
        .ok_or(NoPath::DestinationOutside {
            destination,
            corners,
        })?;
    let clearance = vehicle.clearance();
    let ground = Ground::new(terrain, clearance, from);
    let is_open = |cell| {
        let (row, column) = ground.place(cell);
        ground.is_open(row, column)
    };
    let (first, last) = (ground.cell_at(from), ground.cell_at(to));
    if !is_open(first) {
        return Err(NoPath::StartBlocked { start });
    }
    if !is_open(last) {
        return Err(NoPath::DestinationBlocked {
            destination,
            clearance,
        });
    }
    let way = search::find(&ground, first, last).ok_or(NoPath::Unreachable {
        start,
        destination,
        clearance,
    })?;
    let corners = sight::straighten(&ground, &way, from, to);
    let mut points: Vec<Point> = corners.iter().map(|&it| terrain.to_local(it)).collect();
    // Without the rounding of the way to rows and columns and back.
    if let [first, .., last] = points.as_mut_slice() {
        (*first, *last) = (start, destination);
    }
    let path = Path::new(points);
    let segments = path.segments().len();
    if segments > Path::MAX_SEGMENTS {
        return Err(NoPath::TooLong {
            destination,
            segments,
        });
    }
    Ok(path)
}
