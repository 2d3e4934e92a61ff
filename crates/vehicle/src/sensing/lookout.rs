//! Watches the path of a vehicle for obstacles.

use std::time::Instant;

use super::{Obstacles, Scan};
use crate::motion::{Pose, wrap};
use crate::zones::Point;

/// Keeps the obstacles that scans show around a vehicle, and tells when they block its path.
#[derive(Debug, Default)]
pub struct Lookout {
    here: Option<Pose>,
    /// The turn between the last two poses, in radians.
    turn: f64,
    obstacles: Obstacles,
    /// Whether the last look saw the path blocked.
    was_blocked: bool,
}

impl Lookout {
    /// Largest turn between two poses, in radians, at which scans are placed by the later one.
    const STEADY: f64 = 0.05;

    /// Takes in the vehicle's pose.
    pub fn handle_pose(&mut self, pose: Pose) {
        let before = self.here.replace(pose).unwrap_or(pose);
        self.turn = wrap(pose.yaw - before.yaw).abs();
    }

    /// Takes in a scan from the last pose. Scans of a vehicle that turns fast are left out, because
    /// their obstacles would be misplaced.
    pub fn handle_scan(&mut self, now: Instant, scan: &Scan) {
        if let Some(pose) = self.here.filter(|_| self.turn < Self::STEADY) {
            self.obstacles.handle_scan(now, &pose, scan);
        }
    }

    /// The vehicle's position.
    #[must_use]
    pub fn here(&self) -> Option<Point> {
        self.here.map(|pose| (pose.x, pose.y))
    }

    /// The places of the obstacles.
    #[must_use]
    pub fn obstacles(&self) -> Vec<Point> {
        self.obstacles.points()
    }

    /// Begins to watch another path.
    pub const fn begin(&mut self) {
        self.was_blocked = false;
    }

    /// Looks along the rest of the path, given by its corners ahead. Returns whether this look and
    /// the one before found an obstacle closer than `radius` metres to it, so that a single wrong
    /// measurement moves nothing.
    pub fn sees_blocked(&mut self, ahead: impl IntoIterator<Item = Point>, radius: f64) -> bool {
        let Some(here) = self.here() else {
            return false;
        };
        let line: Vec<_> = std::iter::once(here).chain(ahead).collect();
        let is_blocked = self.obstacles.block(&line, radius);
        std::mem::replace(&mut self.was_blocked, is_blocked) && is_blocked
    }
}
