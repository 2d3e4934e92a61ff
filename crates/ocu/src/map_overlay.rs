//! What a vehicle reports of its surroundings, for the map on pages: operating zones, the last scan
//! of its range sensor, and the obstacles that scans have shown.
//!
//! Its size is bounded whatever a vehicle reports, and pages fetch it only when it has changed.

use std::time::Instant;

use super::state::{self, age};
use jaus_vehicle::motion::Pose;
use jaus_vehicle::sensing::{Obstacles, Scan};
use jaus_vehicle::zones::{Point, Zones};

/// The surroundings of one vehicle.
#[derive(Debug, Default)]
pub(super) struct MapOverlay {
    zones: Vec<state::Zone>,
    /// Zones beyond the limit.
    omitted: usize,
    /// Why the reported zones cannot be shown.
    problem: String,
    zones_revision: u32,
    points: Vec<[f64; 2]>,
    obstacles: Obstacles,
    /// Middles of the cells with an obstacle.
    cells: Vec<[f64; 2]>,
    scan_revision: u32,
    scanned_at: Option<Instant>,
}

impl MapOverlay {
    /// Limit of zones.
    const MOST_ZONES: usize = 64;
    /// Limit of obstacle cells; the nearest remain.
    const MOST_CELLS: usize = 1024;

    /// Handles the reported zones, or why they are unusable.
    pub(super) fn handle_zones(&mut self, reported: Result<Zones, String>) {
        let (zones, omitted, problem) = match reported {
            Ok(zones) => {
                let shown = zones.iter().take(Self::MOST_ZONES).map(|(id, polygon)| {
                    let vertices = polygon.vertices().iter();
                    state::Zone {
                        number: id.number(),
                        points: vertices.map(|&point| rounded(point)).collect(),
                    }
                });
                let omitted = zones.iter().skip(Self::MOST_ZONES).count();
                (shown.collect(), omitted, String::new())
            }
            Err(problem) => (Vec::new(), 0, problem),
        };
        if self.zones_revision == 0 || (&self.zones, &self.problem) != (&zones, &problem) {
            self.zones_revision += 1;
        }
        (self.zones, self.omitted, self.problem) = (zones, omitted, problem);
    }

    /// Handles a scan from a pose, or that the sensor does not measure. Without a pose it is not
    /// known where its points are.
    pub(super) fn handle_scan(&mut self, now: Instant, pose: Option<Pose>, scan: Option<&Scan>) {
        let Some((pose, scan)) = pose.zip(scan) else {
            return;
        };
        self.obstacles.handle_scan(now, &pose, scan);
        self.points = scan.hits(pose).map(rounded).collect();
        let mut cells = self.obstacles.points();
        let far = |&(x, y): &Point| (x - pose.x).hypot(y - pose.y);
        cells.sort_by(|a, b| far(a).total_cmp(&far(b)));
        self.cells = cells
            .into_iter()
            .take(Self::MOST_CELLS)
            .map(rounded)
            .collect();
        self.scan_revision += 1;
        self.scanned_at = Some(now);
    }

    /// Forgets what was reported. Revisions go on, so that pages notice.
    pub(super) fn forget(&mut self) {
        let next = |revision: u32| revision + u32::from(revision > 0);
        *self = Self {
            zones_revision: next(self.zones_revision),
            scan_revision: next(self.scan_revision),
            ..Self::default()
        };
    }

    /// Revisions for the snapshot; 0 before the first report.
    pub(super) fn revision(&self, now: Instant) -> state::OverlayRevision {
        state::OverlayRevision {
            zones: self.zones_revision,
            scan: self.scan_revision,
            scan_age_ms: self.scanned_at.map(|at| age(now, at)),
        }
    }

    /// The overlay for a page that has the zones of a revision.
    pub(super) fn state(&self, known_zones: u32) -> state::Overlay {
        let is_known = known_zones == self.zones_revision;
        state::Overlay {
            zones_revision: self.zones_revision,
            zones: (!is_known).then(|| self.zones.clone()),
            omitted_zones: self.omitted,
            problem: self.problem.clone(),
            scan_revision: self.scan_revision,
            scan: self.points.clone(),
            cell_m: Obstacles::CELL,
            obstacles: self.cells.clone(),
        }
    }
}

/// Centimetres suffice for display.
fn rounded((x, y): Point) -> [f64; 2] {
    [x, y].map(|it| (it * 100.0).round() / 100.0)
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use jaus_vehicle::sensing::Ray;
    use jaus_vehicle::zones::{Polygon, ZoneId};

    fn square(side: f64) -> Polygon {
        Polygon::new(vec![(0.0, 0.0), (0.0, side), (side, side), (side, 0.0)]).unwrap()
    }

    #[test]
    fn zones_are_sent_to_a_page_only_when_they_have_changed() {
        let mut overlay = MapOverlay::default();
        assert_eq!(overlay.revision(Instant::now()).zones, 0);
        let mut zones = Zones::default();
        zones.set(ZoneId::Operating, square(10.0));
        overlay.handle_zones(Ok(zones.clone()));
        let sent = overlay.state(0);
        assert_eq!(sent.zones.unwrap()[0].points.len(), 4);
        overlay.handle_zones(Ok(zones.clone()));
        assert_eq!(overlay.state(sent.zones_revision).zones, None);
        zones.set(ZoneId::KeepOut(2), square(1.0));
        overlay.handle_zones(Ok(zones));
        let sent = overlay.state(sent.zones_revision);
        assert_eq!(sent.zones.unwrap()[1].number, 2);
        overlay.handle_zones(Err("edges 1 and 3 cross".to_owned()));
        let sent = overlay.state(sent.zones_revision);
        assert_eq!(sent.zones.unwrap(), []);
        assert_eq!(sent.problem, "edges 1 and 3 cross");
    }

    #[test]
    fn the_overlay_is_bounded_whatever_a_vehicle_reports() {
        let mut overlay = MapOverlay::default();
        let mut zones = Zones::default();
        for number in 2..300 {
            zones.set(ZoneId::KeepOut(number), square(1.0));
        }
        overlay.handle_zones(Ok(zones));
        let mut now = Instant::now();
        for step in 0..40 {
            let ray = |number: u16| Ray {
                bearing: f64::from(number) / 100.0,
                range: 5.0,
            };
            let scan = Scan::new((0..10_000).map(ray));
            let pose = Pose::at(12.0 * f64::from(step), 1e300);
            overlay.handle_scan(now, Some(pose), Some(&scan));
            overlay.handle_scan(
                now,
                Some(Pose::at(12.0 * f64::from(step), 0.0)),
                Some(&scan),
            );
            now += std::time::Duration::from_millis(100);
        }
        let state = overlay.state(0);
        assert_eq!(state.zones.as_ref().unwrap().len(), MapOverlay::MOST_ZONES);
        assert_eq!(state.omitted_zones, 298 - MapOverlay::MOST_ZONES);
        assert_eq!(state.obstacles.len(), MapOverlay::MOST_CELLS);
        let octets = serde_json::to_string(&state).unwrap().len();
        assert!(octets < 64 * 1024, "{octets}");
    }

    #[test]
    fn points_of_a_scan_are_where_the_vehicle_was_and_none_without_a_pose() {
        let mut overlay = MapOverlay::default();
        let ahead = Ray {
            bearing: 0.0,
            range: 2.0,
        };
        let scan = Scan::new([ahead]);
        let now = Instant::now();
        overlay.handle_scan(now, None, Some(&scan));
        assert_eq!(overlay.revision(now).scan, 0);
        let pose = Pose {
            yaw: std::f64::consts::FRAC_PI_2,
            ..Pose::at(1.0, 1.0)
        };
        overlay.handle_scan(now, Some(pose), Some(&scan));
        assert_eq!(overlay.state(0).scan, [[1.0, 3.0]]);
        overlay.forget();
        assert_eq!(overlay.state(0).scan, [[0.0; 2]; 0]);
        assert!(overlay.revision(now).scan > 1);
    }
}
