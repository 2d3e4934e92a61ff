//! Path planning from the vehicle's position to its destination over a map.

use super::ground::Ground;
use super::{Terrain, bends, search, sight};
use crate::zones::ZoneId;

/// A point of the local frame: X (north) and Y (east) in metres.
pub type Point = (f64, f64);

/// Dimensions of the vehicle for planning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// Width in metres.
    pub width: f64,
    /// Clearance on each side in metres.
    pub margin: f64,
    /// Least turning radius in metres; 0 for a vehicle that turns on the spot.
    pub turning_radius: f64,
}

impl Default for Footprint {
    fn default() -> Self {
        Self {
            width: 0.6,
            margin: 0.1,
            turning_radius: 0.0,
        }
    }
}

impl Footprint {
    /// Minimum distance of the vehicle's centre from obstacles, in metres.
    #[must_use]
    pub fn clearance(&self) -> f64 {
        self.width / 2.0 + self.margin
    }

    /// Radius of the arcs in the corners of a path: wider than the least, to leave the driver room
    /// for corrections.
    fn bend(&self) -> f64 {
        1.25 * self.turning_radius
    }
}

/// A drivable path of straight segments.
///
/// ```
/// use jaus_vehicle::mission::{Footprint, Terrain, plan};
///
/// // 20 x 20 cells of half a metre; 255 is open ground.
/// let terrain = Terrain::new(20, 20, 0.5, (0.0, 0.0), vec![255; 400])?;
/// let path = plan(&terrain, &Footprint::default(), (1.0, 1.0), (9.0, 9.0))?;
/// assert_eq!(path.segments().len(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Path {
    points: Vec<Point>,
}

impl Path {
    /// The most segments of a path: the capacity of a driver's list.
    pub const MAX_SEGMENTS: usize = 4096;

    /// Creates a path over these corners, starting with the first.
    #[must_use]
    pub const fn new(points: Vec<Point>) -> Self {
        Self { points }
    }

    /// The corners, from start to destination.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The start and end of each segment.
    pub fn segments(&self) -> impl ExactSizeIterator<Item = (Point, Point)> {
        let ends = self.points.iter().skip(1);
        self.points.iter().zip(ends).map(|(&from, &to)| (from, to))
    }

    /// Length in metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.remaining(0)
    }

    /// Remaining length in metres from the start of a segment, counted from 0.
    #[must_use]
    pub fn remaining(&self, segment: usize) -> f64 {
        let segments = self.segments().skip(segment);
        segments.map(|(a, b)| (b.0 - a.0).hypot(b.1 - a.1)).sum()
    }
}

/// Why planning found no path.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoPath {
    /// The destination is not on the map.
    #[error(
        "the destination at {} is outside the map, which extends from {} to {}: choose one on the \
         map, or give the store a larger map", At(*.destination), At(.corners[0]), At(.corners[1])
    )]
    DestinationOutside {
        /// The destination.
        destination: Point,
        /// The south-west and the north-east corner of the map.
        corners: [Point; 2],
    },
    /// Zones bar the destination.
    #[error(
        "the destination at {} is barred by {zone}: choose another one, or change the zone",
        At(*.destination)
    )]
    DestinationBarred {
        /// The destination.
        destination: Point,
        /// The zone.
        zone: ZoneId,
    },
    /// The vehicle is where zones do not allow it.
    #[error(
        "the vehicle at {} is beyond {zone}: drive it out manually, or change the zone", At(*.start)
    )]
    StartBarred {
        /// The vehicle's position.
        start: Point,
        /// The zone.
        zone: ZoneId,
    },
    /// The destination is in an obstacle or too close to one.
    #[error(
        "the destination at {} is closer than {clearance:.2} m to an obstacle: choose one with \
         more clearance",
        At(*.destination)
    )]
    DestinationBlocked {
        /// The destination.
        destination: Point,
        /// Required distance of the vehicle's centre from obstacles, in metres.
        clearance: f64,
    },
    /// The vehicle is not on the map.
    #[error(
        "the vehicle at {} is outside the map, which extends from {} to {}: drive it there \
         manually, or correct its pose", At(*.start), At(.corners[0]), At(.corners[1])
    )]
    StartOutside {
        /// The vehicle's position.
        start: Point,
        /// The south-west and the north-east corner of the map.
        corners: [Point; 2],
    },
    /// The vehicle is in an obstacle according to the map.
    #[error(
        "the vehicle at {} is in an obstacle of the map: drive it out manually, or correct its \
         pose or the map", At(*.start)
    )]
    StartBlocked {
        /// The vehicle's position.
        start: Point,
    },
    /// No path to the destination exists for a vehicle of this size.
    #[error(
        "there is no path from {} to {} with {clearance:.2} m of clearance: clear obstacles, \
         correct the map or the zones, or choose another destination", At(*.start), At(*.destination)
    )]
    Unreachable {
        /// The vehicle's position.
        start: Point,
        /// The destination.
        destination: Point,
        /// Required distance of the vehicle's centre from obstacles, in metres.
        clearance: f64,
    },
    /// A corner of the path leaves no room for the vehicle's turning radius.
    #[error(
        "the path to {} turns at {} without room for an arc of {radius:.2} m: clear obstacles \
         there, correct the map, or choose another destination", At(*.destination), At(*.corner)
    )]
    TooTight {
        /// The destination.
        destination: Point,
        /// The corner.
        corner: Point,
        /// Radius of the arc in metres.
        radius: f64,
    },
    /// The path has more segments than a driver's list holds.
    #[error(
        "the path to {} has {segments} segments, and a driver accepts at most {}: choose a closer \
         destination", At(*.destination), Path::MAX_SEGMENTS
    )]
    TooLong {
        /// The destination.
        destination: Point,
        /// Number of segments.
        segments: usize,
    },
}

impl NoPath {
    /// Whether the same request may succeed later, because the obstacle may move.
    #[must_use]
    pub const fn may_pass(&self) -> bool {
        matches!(self, Self::Unreachable { .. } | Self::TooTight { .. })
    }
}

/// Formats a point for the operator.
struct At(Point);

impl std::fmt::Display for At {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self((x, y)) = *self;
        write!(f, "north {x:.2} m, east {y:.2} m")
    }
}

/// The distance from the vehicle at which the map blocks the rest of a path, in metres; `None` if the
/// path is clear.
///
/// `segment` is the segment that the vehicle drives, counted from 0. It needs only the vehicle's
/// width: a path that was planned with a margin stays valid when an obstacle is seen a little nearer.
#[must_use]
pub fn blocked_after(
    terrain: &Terrain,
    vehicle: &Footprint,
    here: Point,
    path: &Path,
    segment: usize,
) -> Option<f64> {
    // Off the map nothing is known.
    let from = terrain.to_grid(here)?;
    let ground = Ground::new(terrain, vehicle.width / 2.0, from);
    let mut passed = 0.0;
    let mut from = here;
    for &to in path.points().iter().skip(segment + 1) {
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let is_clear = |share: f64| {
            let to = (
                from.0 + (to.0 - from.0) * share,
                from.1 + (to.1 - from.1) * share,
            );
            let ends = terrain.to_grid(from).zip(terrain.to_grid(to));
            ends.is_none_or(|(from, to)| sight::cost(&ground, from, to).is_some())
        };
        if !is_clear(1.0) {
            return Some(passed + length * last_clear(is_clear));
        }
        passed += length;
        from = to;
    }
    None
}

/// The largest share of a line that is clear, to one part in 256.
fn last_clear(is_clear: impl Fn(f64) -> bool) -> f64 {
    let (mut good, mut bad) = (0.0, 1.0);
    for _ in 0..8 {
        let middle = f64::midpoint(good, bad);
        *(if is_clear(middle) {
            &mut good
        } else {
            &mut bad
        }) = middle;
    }
    good
}

/// Finds the cheapest path with sufficient clearance for the vehicle. Cost combines distance and
/// traversability. On maps with more than 512 x 512 cells the path may cost slightly more than the
/// optimum.
///
/// For a vehicle with a turning radius, the corners are rounded. An arc cuts its corner, so the path
/// keeps more clearance before. The direction in which the vehicle starts is not considered: its
/// first turn needs about one turning radius of room on each side.
///
/// On the largest map, 4096 x 4096 cells, planning takes some 60 MB and up to one or two seconds;
/// `docs/performance.md` has the figures. Async callers should run it on a separate thread.
///
/// # Errors
/// [`NoPath`] with the cause and a remedy.
pub fn plan(
    terrain: &Terrain,
    vehicle: &Footprint,
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
    let clearance = vehicle.clearance() + CUT * vehicle.bend();
    let ground = Ground::new(terrain, clearance, from);
    let is_open = |cell| {
        let (row, column) = ground.place(cell);
        ground.is_open(row, column)
    };
    let (first, last) = (ground.cell_at(from), ground.cell_at(to));
    let barring = |point| {
        let clearance = terrain.zones().clearance(point);
        clearance.filter(|it| it.metres < 0.0).map(|it| it.zone)
    };
    if let Some(zone) = barring(start) {
        return Err(NoPath::StartBarred { start, zone });
    }
    if let Some(zone) = barring(destination) {
        return Err(NoPath::DestinationBarred { destination, zone });
    }
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
    let mut corners = sight::straighten(&ground, &way, from, to);
    if vehicle.turning_radius > 0.0 {
        let room = Ground::new(terrain, vehicle.clearance(), from);
        let rounded = bends::round(&room, &corners, vehicle.bend() / terrain.cell());
        corners = rounded.map_err(|corner| NoPath::TooTight {
            destination,
            corner: terrain.to_local(corner),
            radius: vehicle.bend(),
        })?;
    }
    let mut points: Vec<Point> = corners.iter().map(|&it| terrain.to_local(it)).collect();
    // Restores the exact ends, without rounding from the grid conversion.
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

/// How far an arc cuts a corner of 60 degrees, as a fraction of its radius.
const CUT: f64 = 0.155;
