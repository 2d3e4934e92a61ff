//! The vehicle's local frame on the globe, from reports of its local and its global pose. It uses no
//! clock.

use std::time::Instant;

use super::state::{self, age};
use jaus::messages::mobility::ReportGlobalPose;
use jaus_vehicle::motion::{Frame, GlobalPose, Pose, wrap};

/// A reported position on the globe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fix {
    /// Degrees north.
    pub(super) latitude: f64,
    /// Degrees east.
    pub(super) longitude: f64,
    /// Radians clockwise from true north.
    pub(super) yaw: Option<f64>,
}

impl Fix {
    /// The position of a report; `None` if it is unknown.
    pub(super) fn of(report: &ReportGlobalPose) -> Option<Self> {
        Some(Self {
            latitude: report.latitude_deg()?,
            longitude: report.longitude_deg()?,
            yaw: report.yaw_rad(),
        })
    }

    fn pose(&self) -> GlobalPose {
        GlobalPose {
            latitude: self.latitude,
            longitude: self.longitude,
            yaw: self.yaw.unwrap_or_default(),
            ..GlobalPose::default()
        }
    }
}

/// Where the local frame is on the globe.
///
/// The frame moves only if it disagrees with the reported poses, so that the map does not follow
/// the noise of the sensors.
#[derive(Debug, Default)]
pub(super) struct Georeference {
    frame: Option<Frame>,
    /// Whether the frame is the one of the vehicle's local pose. Without a local pose it begins at
    /// the first fix.
    is_local: bool,
    /// The last local pose that a fix was compared with.
    local: Option<Pose>,
    fix: Option<(Fix, Instant)>,
}

/// Disagreement that is noise.
struct Tolerance {
    metres: f64,
    radians: f64,
}

impl Georeference {
    const AT_REST: Tolerance = Tolerance {
        metres: 2.0,
        radians: 0.05,
    };
    /// The two poses are not sampled at the same moment, so a vehicle under way has larger
    /// differences.
    const UNDER_WAY: Tolerance = Tolerance {
        metres: 10.0,
        radians: 0.5,
    };
    /// A local pose that changes less from fix to fix is at rest.
    const REST: Tolerance = Tolerance {
        metres: 0.1,
        radians: 0.02,
    };
    /// Distance in metres from its origin at which a frame without a local pose is moved.
    const REACH: f64 = 5000.0;

    /// Handles a report of the global pose. `local` is the local pose at the same time, if known.
    pub(super) fn handle_fix(
        &mut self,
        now: Instant,
        fix: Option<Fix>,
        local: Option<&state::Pose>,
    ) {
        self.fix = fix.map(|fix| (fix, now));
        let Some(fix) = fix else {
            return;
        };
        let place = local.and_then(|it| Some((it.x?, it.y?)));
        match place {
            Some((x, y)) => {
                let yaw = local.and_then(|it| it.yaw);
                let pose = Pose {
                    yaw: yaw.unwrap_or_default(),
                    ..Pose::at(x, y)
                };
                self.join(&pose, &fix, yaw.is_some());
            }
            None if !self.is_local => self.begin_at(&fix),
            // The local pose is late; its frame still stands.
            None => {}
        }
    }

    /// Lets the frame join the local pose and the fix, if it disagrees with them.
    fn join(&mut self, pose: &Pose, fix: &Fix, has_yaw: bool) {
        let before = self.local.replace(*pose);
        let is_at_rest = before.is_some_and(|it| is_near(&it, pose, &Self::REST));
        let tolerance = match is_at_rest {
            true => Self::AT_REST,
            false => Self::UNDER_WAY,
        };
        // Without one of the two headings the direction stays; at first X points north.
        let known = self.frame.filter(|_| self.is_local);
        let global = match fix.yaw.filter(|_| has_yaw) {
            Some(_) => fix.pose(),
            None => GlobalPose {
                yaw: wrap(pose.yaw + known.map_or(0.0, |it| it.heading)),
                ..fix.pose()
            },
        };
        let agrees = |frame: &Frame| is_near(&frame.to_local(&global), pose, &tolerance);
        if !known.as_ref().is_some_and(agrees) {
            self.frame = Some(Frame::joining(pose, &global));
            self.is_local = true;
        }
    }

    /// A frame for a vehicle without a local pose: its first position, X to the north.
    fn begin_at(&mut self, fix: &Fix) {
        let is_near = |frame: &Frame| {
            let pose = frame.to_local(&fix.pose());
            pose.distance(0.0, 0.0) < Self::REACH
        };
        if !self.frame.as_ref().is_some_and(is_near) {
            self.frame = Some(Frame::at(fix.latitude, fix.longitude));
        }
    }

    /// Snapshot for pages; `None` before the first fix.
    pub(super) fn state(&self, now: Instant) -> Option<state::Place> {
        let frame = self.frame?;
        let fix = self.fix.map(|(fix, at)| {
            let pose = frame.to_local(&fix.pose());
            state::Fix {
                latitude: fix.latitude,
                longitude: fix.longitude,
                x: pose.x,
                y: pose.y,
                yaw: fix.yaw.map(|yaw| wrap(yaw - frame.heading)),
                age_ms: age(now, at),
            }
        });
        Some(state::Place {
            latitude: frame.latitude,
            longitude: frame.longitude,
            heading: frame.heading,
            fix,
        })
    }
}

fn is_near(one: &Pose, other: &Pose, tolerance: &Tolerance) -> bool {
    one.distance(other.x, other.y) < tolerance.metres
        && wrap(one.yaw - other.yaw).abs() < tolerance.radians
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use std::time::Duration;

    use super::*;

    const ORIGIN: Frame = Frame {
        latitude: 52.5,
        longitude: 13.4,
        altitude: 0.0,
        heading: 0.6,
    };

    /// What the sensors of a vehicle in a frame report, with an error of the fix in metres.
    fn reports(frame: &Frame, (x, y, yaw): (f64, f64, f64), error: f64) -> (Fix, state::Pose) {
        let pose = Pose {
            yaw,
            ..Pose::at(x + error, y)
        };
        let global = frame.to_global(&pose);
        let fix = Fix {
            latitude: global.latitude,
            longitude: global.longitude,
            yaw: Some(global.yaw),
        };
        let local = state::Pose {
            x: Some(x),
            y: Some(y),
            yaw: Some(yaw),
            age_ms: 0,
        };
        (fix, local)
    }

    fn origin(georeference: &Georeference, now: Instant) -> (f64, f64, f64) {
        let place = georeference.state(now).unwrap();
        (place.latitude, place.longitude, place.heading)
    }

    #[test]
    fn the_local_frame_is_found_from_both_poses_wherever_the_vehicle_is() {
        let now = Instant::now();
        for place in [(0.0, 0.0, 0.0), (40.0, -30.0, 2.0), (-500.0, 900.0, -3.0)] {
            let mut georeference = Georeference::default();
            let (fix, local) = reports(&ORIGIN, place, 0.0);
            georeference.handle_fix(now, Some(fix), Some(&local));
            let (latitude, longitude, heading) = origin(&georeference, now);
            assert!((latitude - 52.5).abs() < 1e-8, "{latitude}");
            assert!((longitude - 13.4).abs() < 1e-8, "{longitude}");
            assert!((heading - 0.6).abs() < 1e-9, "{heading}");
            let fix = georeference.state(now).unwrap().fix.unwrap();
            assert!((fix.x - place.0).abs() < 1e-3 && (fix.y - place.1).abs() < 1e-3);
        }
    }

    #[test]
    fn noise_does_not_move_the_frame_and_a_new_local_frame_does() {
        let now = Instant::now();
        let mut georeference = Georeference::default();
        let (fix, local) = reports(&ORIGIN, (5.0, 5.0, 0.0), 0.0);
        georeference.handle_fix(now, Some(fix), Some(&local));
        let first = origin(&georeference, now);
        for error in [1.5, -1.5, 0.3] {
            let (fix, local) = reports(&ORIGIN, (5.0, 5.0, 0.0), error);
            georeference.handle_fix(now, Some(fix), Some(&local));
            assert_eq!(origin(&georeference, now), first);
        }
        // Under way, the fix is of another moment than the local pose.
        let (fix, local) = reports(&ORIGIN, (9.0, 5.0, 0.4), 4.0);
        georeference.handle_fix(now, Some(fix), Some(&local));
        assert_eq!(origin(&georeference, now), first);
        // The reckoning begins again at another place.
        let moved = Frame {
            heading: 0.0,
            ..Frame::at(52.501, 13.4)
        };
        let (fix, local) = reports(&moved, (9.0, 5.0, 0.4), 0.0);
        georeference.handle_fix(now, Some(fix), Some(&local));
        let (latitude, _, heading) = origin(&georeference, now);
        assert!((latitude - 52.501).abs() < 1e-8 && heading.abs() < 1e-9);
    }

    #[test]
    fn without_headings_x_points_north() {
        let now = Instant::now();
        let mut georeference = Georeference::default();
        let (fix, local) = reports(&Frame::at(52.5, 13.4), (3.0, 4.0, 0.7), 0.0);
        let fix = Fix { yaw: None, ..fix };
        georeference.handle_fix(now, Some(fix), Some(&local));
        let place = georeference.state(now).unwrap();
        assert_eq!((place.heading, place.fix.unwrap().yaw), (0.0, None));
        assert!((place.latitude - 52.5).abs() < 1e-8);
    }

    #[test]
    fn without_a_local_pose_the_frame_begins_at_the_first_fix_and_stays() {
        let now = Instant::now();
        let mut georeference = Georeference::default();
        let (fix, _) = reports(&ORIGIN, (0.0, 0.0, 0.0), 0.0);
        georeference.handle_fix(now, Some(fix), None);
        let first = origin(&georeference, now);
        assert_eq!(first, (fix.latitude, fix.longitude, 0.0));
        let north = Fix {
            latitude: fix.latitude + 0.001,
            ..fix
        };
        georeference.handle_fix(now, Some(north), None);
        assert_eq!(origin(&georeference, now), first);
        let seen = georeference.state(now).unwrap().fix.unwrap();
        assert!(
            (seen.x - 111.2).abs() < 0.2 && seen.y.abs() < 1e-6,
            "{seen:?}"
        );
        // A local pose takes precedence as soon as there is one.
        let (fix, local) = reports(&ORIGIN, (7.0, 0.0, 0.0), 0.0);
        georeference.handle_fix(now, Some(fix), Some(&local));
        assert!((origin(&georeference, now).2 - 0.6).abs() < 1e-9);
        georeference.handle_fix(now, Some(north), None);
        assert!((origin(&georeference, now).2 - 0.6).abs() < 1e-9);
    }

    #[test]
    fn an_unknown_position_is_no_fix_and_leaves_the_frame() {
        let now = Instant::now();
        let mut georeference = Georeference::default();
        georeference.handle_fix(now, Fix::of(&ReportGlobalPose::default()), None);
        assert_eq!(georeference.state(now), None);
        let (fix, local) = reports(&ORIGIN, (1.0, 1.0, 0.0), 0.0);
        georeference.handle_fix(now, Some(fix), Some(&local));
        georeference.handle_fix(now, None, Some(&local));
        let later = now + Duration::from_secs(1);
        let place = georeference.state(later).unwrap();
        assert_eq!(place.fix, None);
        assert!((place.latitude - 52.5).abs() < 1e-8);
    }
}
