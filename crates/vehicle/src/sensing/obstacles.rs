//! The obstacles that scans have shown, in cells of the local frame.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::Scan;
use crate::motion::Pose;
use crate::zones::Point;

/// Number of a cell along X and Y.
type Cell = (i32, i32);

/// Cells in which something was seen. A cell is free again as soon as a ray passes through it, and
/// after [`MEMORY`](Self::MEMORY) without a hit.
#[derive(Debug, Default)]
pub struct Obstacles {
    seen: BTreeMap<Cell, Instant>,
}

impl Obstacles {
    /// Side of a cell in metres.
    pub const CELL: f64 = 0.25;
    /// How long an obstacle out of sight is remembered.
    pub const MEMORY: Duration = Duration::from_secs(30);
    /// Maximum number of cells. Of a flood of obstacles the latest remain.
    pub const MOST_CELLS: usize = 4096;

    /// Takes in a scan from a pose.
    pub fn handle_scan(&mut self, now: Instant, pose: &Pose, scan: &Scan) {
        let is_known = [pose.x, pose.y, pose.yaw].iter().all(|it| it.is_finite());
        if !is_known {
            return;
        }
        for ray in scan.rays() {
            // The cell of the hit and the one before it are no passage.
            let free = ray.range.min(Scan::HORIZON) - 2.0 * Self::CELL;
            let steps = (free / Self::CELL).max(0.0) as u32;
            for step in 0..steps {
                let way = f64::from(step) * Self::CELL;
                self.seen.remove(&cell(ray.point(pose, way)));
            }
        }
        for hit in scan.hits(*pose) {
            self.seen.insert(cell(hit), now);
        }
        self.seen
            .retain(|_, at| now.saturating_duration_since(*at) <= Self::MEMORY);
        while self.seen.len() > Self::MOST_CELLS {
            let oldest = self.seen.iter().min_by_key(|(_, at)| **at);
            let Some(oldest) = oldest.map(|(&cell, _)| cell) else {
                return;
            };
            self.seen.remove(&oldest);
        }
    }

    /// The middles of the cells with an obstacle.
    #[must_use]
    pub fn points(&self) -> Vec<Point> {
        let middle = |number: i32| (f64::from(number) + 0.5) * Self::CELL;
        let cells = self.seen.keys();
        cells.map(|&(x, y)| (middle(x), middle(y))).collect()
    }

    /// Whether an obstacle is closer than `radius` metres to a line of places.
    #[must_use]
    pub fn block(&self, line: &[Point], radius: f64) -> bool {
        let points = self.points();
        line.windows(2).any(|ends| {
            let near = |&point: &Point| crate::zones::distance(point, ends[0], ends[1]) < radius;
            points.iter().any(near)
        })
    }
}

fn cell((x, y): Point) -> Cell {
    // Casts saturate.
    let number = |at: f64| (at / Obstacles::CELL).floor() as i32;
    (number(x), number(y))
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::sensing::{Disc, RangerConfig, Ray, Scenery, SimulatedRanger};

    const AHEAD: Disc = Disc {
        middle: (3.0, 0.5),
        radius: 0.5,
    };

    fn seen(discs: Vec<Disc>, pose: &Pose) -> Scan {
        let scenery = Scenery::default();
        scenery.set(discs);
        SimulatedRanger::new(RangerConfig::default(), scenery).scan(pose)
    }

    #[test]
    fn a_disc_is_seen_where_it_stands_within_reach_and_field_of_view() {
        let pose = Pose {
            yaw: 0.3,
            ..Pose::at(0.5, -0.5)
        };
        let scan = seen(vec![AHEAD], &pose);
        let hits: Vec<_> = scan.hits(pose).collect();
        assert!(hits.len() > 5, "{hits:?}");
        for (x, y) in hits {
            let off = ((x - 3.0).hypot(y - 0.5) - 0.5).abs();
            assert!(off < 0.15, "{x:.2}, {y:.2}: {off:.2} m beside its edge");
        }
        let far = Disc {
            middle: (20.0, 0.0),
            ..AHEAD
        };
        let behind = Disc {
            middle: (-3.0, -1.0),
            ..AHEAD
        };
        assert_eq!(seen(vec![far, behind], &pose).hits(pose).count(), 0);
    }

    #[test]
    fn what_was_seen_is_remembered_out_of_sight_and_forgotten_when_it_is_gone() {
        let mut obstacles = Obstacles::default();
        let start = Instant::now();
        let here = Pose::default();
        obstacles.handle_scan(start, &here, &seen(vec![AHEAD], &here));
        let line = [(0.0, 0.0), (5.0, 1.0)];
        assert!(obstacles.block(&line, 0.3));
        assert!(!obstacles.block(&[(0.0, 0.0), (5.0, -3.0)], 0.3));
        let away = Pose {
            yaw: std::f64::consts::PI,
            ..here
        };
        let later = start + Obstacles::MEMORY;
        obstacles.handle_scan(later, &away, &seen(vec![AHEAD], &away));
        assert!(obstacles.block(&line, 0.3), "out of sight");
        let mut aged = Obstacles::default();
        std::mem::swap(&mut aged, &mut obstacles);
        aged.handle_scan(later + Duration::from_millis(1), &away, &Scan::default());
        assert!(aged.points().is_empty(), "too old");
        obstacles.handle_scan(start, &here, &seen(vec![AHEAD], &here));
        obstacles.handle_scan(start, &here, &seen(vec![], &here));
        assert!(obstacles.points().is_empty(), "rays pass through");
    }

    #[test]
    fn a_flood_of_obstacles_and_unknown_poses_are_bounded() {
        let mut obstacles = Obstacles::default();
        let start = Instant::now();
        for number in 0..100_u32 {
            let rays = (0..60_000).map(|ray| Ray {
                bearing: f64::from(ray) * 1e-4,
                range: 5.0,
            });
            let at = start + Duration::from_millis(number.into());
            let pose = Pose::at(f64::from(number) * 12.0, 0.0);
            obstacles.handle_scan(at, &pose, &Scan::new(rays));
        }
        assert!(obstacles.points().len() <= Obstacles::MOST_CELLS);
        let before = obstacles.points();
        for pose in [Pose::at(f64::NAN, 0.0), Pose::at(0.0, f64::INFINITY)] {
            obstacles.handle_scan(start, &pose, &seen(vec![AHEAD], &Pose::default()));
        }
        assert_eq!(obstacles.points(), before);
    }
}
