//! Lost-link behaviour of a mission, and the return path.

use super::{Path, Point};

/// Behaviour of a mission when control of the planner ends without a release.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LostLink {
    /// The vehicle stops, and the mission ends.
    #[default]
    Stop,
    /// The vehicle stops and holds its position. The mission is kept: a client with a new lease can
    /// approve it again, and it is replanned from there.
    Hold,
    /// The vehicle stops, then the planner drives it back to the start of the mission along the
    /// path it came. A stop input, an emergency or any new lease ends the return.
    Return,
}

/// The path driven so far, as points at least [`SPACING`](Self::SPACING) apart.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Trail {
    points: Vec<Point>,
    last: Option<Point>,
}

impl Trail {
    /// Minimum distance between two points in metres.
    const SPACING: f64 = 0.5;
    /// Maximum number of points. On overflow every other point is dropped.
    const MOST: usize = 1024;

    /// Records the vehicle's position.
    pub(super) fn note(&mut self, (x, y): Point) {
        if !x.is_finite() || !y.is_finite() {
            return;
        }
        self.last = Some((x, y));
        let is_far = |&(from_x, from_y): &Point| (x - from_x).hypot(y - from_y) >= Self::SPACING;
        if self.points.last().is_none_or(is_far) {
            self.points.push((x, y));
        }
        if self.points.len() > Self::MOST {
            let mut index = 0;
            self.points.retain(|_| {
                index += 1;
                index % 2 == 1
            });
        }
    }

    /// The path back to the start; `None` if the vehicle has not moved far enough.
    pub(super) fn back(&self) -> Option<Path> {
        let here = self.last?;
        let mut points = vec![here];
        points.extend(self.points.iter().rev().filter(|&&point| point != here));
        (points.len() > 1).then(|| Path::new(points))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_back_leads_along_the_points_of_the_way_there() {
        let mut trail = Trail::default();
        assert_eq!(trail.back(), None);
        trail.note((0.0, 0.0));
        assert_eq!(trail.back(), None, "it has not moved");
        for step in 0..=20 {
            trail.note((0.1 * f64::from(step), 0.0));
        }
        trail.note((f64::NAN, 1.0));
        let back = trail.back().unwrap();
        let (points, start) = (back.points(), (0.0, 0.0));
        assert_eq!((points[0], points.last()), ((2.0, 0.0), Some(&start)));
        assert_eq!(points.len(), 5);
    }

    #[test]
    fn a_long_way_is_told_by_fewer_points_and_keeps_its_start() {
        let mut trail = Trail::default();
        for step in 0..10_000 {
            trail.note((f64::from(step), 0.0));
        }
        let back = trail.back().unwrap();
        assert!(back.points().len() <= Trail::MOST + 1);
        assert_eq!(back.points().last(), Some(&(0.0, 0.0)));
        assert_eq!(back.points()[0], (9999.0, 0.0));
    }
}
