//! The fence of a simulated rover.

use super::*;
use crate::motion::{Curve, Frame, Goal, Heading, Pilot, SkidSteer, SkidSteerConfig, Waypoint};
use crate::zones::{Polygon, ZoneId};

/// A simulated rover before a wall of keep-out from X 5 to 8, within an operating zone whose
/// edge is at X -3.
struct Bench {
    pilot: Pilot,
    fence: Fence,
    now: Instant,
}

const RADIUS: f64 = 0.25;

fn rectangle(south: f64, west: f64, north: f64, east: f64) -> Polygon {
    let vertices = vec![(south, west), (north, west), (north, east), (south, east)];
    Polygon::new(vertices).unwrap()
}

fn walled() -> Zones {
    let mut zones = Zones::default();
    zones.set(ZoneId::Operating, rectangle(-3.0, -20.0, 40.0, 20.0));
    zones.set(ZoneId::KeepOut(7), rectangle(5.0, -10.0, 8.0, 10.0));
    zones
}

impl Bench {
    fn new(zones: Zones) -> Self {
        let fence = Fence::new(FenceConfig::default());
        fence.set_zones(zones);
        let rover = SkidSteer::new(SkidSteerConfig::default());
        let pilot = Pilot::new(rover, Frame::default()).with_fence(fence.clone());
        Self {
            pilot,
            fence,
            now: Instant::now(),
        }
    }

    /// Pursues a goal for some seconds. Returns the least clearance of the vehicle's disc.
    fn drive(&mut self, goal: Goal, seconds: u32) -> f64 {
        self.pilot.pursue(goal);
        let mut least = f64::INFINITY;
        for _ in 0..seconds * 50 {
            self.now += Pilot::STEP;
            self.pilot.handle_time(self.now);
            least = least.min(self.room());
        }
        least
    }

    fn room(&self) -> f64 {
        let Pose { x, y, .. } = self.pilot.motion().pose;
        let zones = Arc::clone(&self.fence.lock().zones);
        zones
            .clearance((x, y))
            .map_or(f64::INFINITY, |it| it.metres)
            - RADIUS
    }

    fn x(&self) -> f64 {
        self.pilot.motion().pose.x
    }
}

fn effort(forward: f64, turn: f64) -> Goal {
    Goal::Effort(Effort {
        forward,
        turn,
        ..Effort::default()
    })
}

fn every_goal() -> [Goal; 5] {
    let speed = 2.0;
    [
        effort(1.0, 0.0),
        Goal::Velocity(Velocity::forward(speed, 0.0)),
        Goal::Vector {
            speed,
            heading: Some(Heading::Local(0.1)),
        },
        Goal::Waypoint {
            to: Waypoint::at(20.0, 0.0),
            speed,
            goes_on: false,
        },
        Goal::Path {
            curve: Curve {
                start: (0.0, 0.0),
                control: (10.0, 0.5),
                end: (20.0, 1.0),
                weight: 0.0,
            },
            speed,
            tolerance: 0.3,
            goes_on: false,
        },
    ]
}

#[test]
fn no_goal_leads_into_a_keep_out_zone_and_the_vehicle_stops_close_to_it() {
    for goal in every_goal() {
        let mut bench = Bench::new(walled());
        let least = bench.drive(goal, 15);
        assert!(least > 0.0, "{goal:?}: {least:.2} m");
        assert!(bench.x() > 4.0, "{goal:?}: only to {:.2} m", bench.x());
        let held = bench.fence.held().unwrap_or_default();
        assert!(held.starts_with("keep-out zone 7 is"), "{goal:?}: {held}");
    }
}

#[test]
fn the_operating_zone_is_not_left_in_reverse() {
    for goal in [
        effort(-1.0, 0.0),
        Goal::Velocity(Velocity::forward(-1.0, 0.0)),
    ] {
        let mut bench = Bench::new(walled());
        let least = bench.drive(goal, 10);
        assert!(
            least > 0.0 && bench.x() < -2.0,
            "{goal:?}: {least:.2}, {:.2}",
            bench.x()
        );
    }
}

#[test]
fn from_an_edge_the_vehicle_turns_and_drives_away() {
    let mut bench = Bench::new(walled());
    bench.drive(effort(1.0, 0.0), 15);
    let at_edge = bench.x();
    let least = bench.drive(effort(-0.5, 0.0), 2);
    assert!(
        bench.x() < at_edge - 0.5 && least > 0.0,
        "back from {at_edge:.2}"
    );
    bench.drive(effort(1.0, 0.0), 15);
    let around = Goal::Vector {
        speed: 1.0,
        heading: Some(Heading::Local(std::f64::consts::PI)),
    };
    let least = bench.drive(around, 6);
    assert!(
        bench.x() < at_edge - 1.0 && least > 0.0,
        "{:.2}: {least:.2}",
        bench.x()
    );
}

#[test]
fn a_vehicle_in_a_new_zone_leaves_it_slowly_and_drives_no_deeper() {
    let mut zones = walled();
    zones.set(ZoneId::KeepOut(9), rectangle(-1.0, -5.0, 10.0, 5.0));
    let mut bench = Bench::new(zones);
    bench.drive(effort(1.0, 0.0), 3);
    assert!(bench.x() < 0.01, "deeper: {:.2}", bench.x());
    let held = bench.fence.held().unwrap_or_default();
    assert!(held.contains("1.0 m beyond keep-out zone 9"), "{held}");
    bench.drive(Goal::Velocity(Velocity::forward(-1.0, 0.0)), 3);
    assert!(
        (-1.1..-0.6).contains(&bench.x()),
        "slowly: {:.2}",
        bench.x()
    );
    bench.drive(Goal::Velocity(Velocity::forward(-1.0, 0.0)), 10);
    assert!(
        (-2.8..-2.0).contains(&bench.x()),
        "then to the edge: {:.2}",
        bench.x()
    );
}

/// A vehicle that drives in circles of a radius of 1 m, 5 m away from an obstacle.
fn circling(speed: f64, limits: &Limits) -> (Bounds, Option<String>) {
    let fence = Fence::new(FenceConfig::default());
    fence.set_obstacles(vec![(0.0, -5.0)]);
    let motion = Motion {
        velocity: Velocity::forward(speed, speed),
        ..Motion::default()
    };
    let bounds = fence.bounds(Instant::now(), &motion, limits, 1.0);
    (bounds, fence.held())
}

#[test]
fn without_brakes_a_vehicle_is_held_before_an_obstacle() {
    for deceleration in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let limits = Limits {
            deceleration,
            ..Limits::default()
        };
        let (bounds, held) = circling(0.5, &limits);
        assert_eq!(bounds, Bounds::HOLD, "{deceleration}");
        assert!(held.unwrap_or_default().contains("deceleration limit"));
    }
}

#[test]
fn a_vehicle_that_is_too_fast_to_look_ahead_may_drive_as_fast_as_it_can_stop() {
    let limits = Limits::default();
    let (bounds, _) = circling(1.0, &limits);
    assert_eq!(bounds.ahead, f64::INFINITY, "the circle is free");
    let (bounds, _) = circling(1e9, &limits);
    let way = bounds.ahead.powi(2) / (2.0 * limits.deceleration);
    assert!((100.0..20_000.0).contains(&way), "{bounds:?}");
}

#[test]
fn zones_that_go_let_the_command_in_force_go_on() {
    let mut bench = Bench::new(walled());
    let goal = every_goal()[3];
    bench.drive(goal, 15);
    bench.fence.set_zones(Zones::default());
    bench.drive(goal, 15);
    assert!(bench.x() > 19.0);
}

#[test]
fn without_a_pose_a_driver_that_needs_one_from_elsewhere_stands_while_there_are_zones() {
    let mut bench = Bench::new(Zones::default());
    bench.fence = Fence::located_elsewhere(FenceConfig::default(), &Limits::default());
    let rover = SkidSteer::new(SkidSteerConfig::default());
    bench.pilot = Pilot::new(rover, Frame::default()).with_fence(bench.fence.clone());
    bench.drive(effort(1.0, 0.0), 2);
    let moved = bench.x();
    assert!(moved > 0.5, "no zones: {moved:.2}");
    bench.fence.set_zones(walled());
    bench.drive(effort(1.0, 0.0), 3);
    let after = bench.x();
    assert!(after < moved + 1.5, "{moved:.2} to {after:.2}");
    assert!(
        bench
            .fence
            .held()
            .unwrap_or_default()
            .contains("pose is unknown")
    );
    for pose in [Pose::at(f64::NAN, 0.0), Pose::default()] {
        bench.fence.handle_pose(Some((pose, bench.now)));
        bench.drive(effort(1.0, 0.0), 1);
        assert!(
            pose.x.is_nan() == (bench.x() - after < 0.1),
            "{pose:?}: {:.2}",
            bench.x()
        );
    }
}

#[test]
fn a_pose_that_jumps_while_there_are_zones_holds_the_vehicle_until_it_is_confirmed() {
    let mut bench = Bench::new(walled());
    let fence = Fence::located_elsewhere(FenceConfig::default(), &Limits::default());
    fence.set_zones(walled());
    bench.fence = fence.clone();
    let rover = SkidSteer::new(SkidSteerConfig::default());
    bench.pilot = Pilot::new(rover, Frame::default()).with_fence(fence.clone());
    bench.pilot.pursue(effort(1.0, 0.0));
    // Drives with a pose that is `off` metres from the true one.
    let mut drive = |off: f64, steps: u32| {
        for _ in 0..steps {
            bench.now += Pilot::STEP;
            bench.pilot.handle_time(bench.now);
            let pose = bench.pilot.motion().pose;
            let believed = Pose::at(pose.x - off, pose.y);
            fence.handle_pose(Some((believed, bench.now)));
        }
        bench.x()
    };
    let edge = drive(0.0, 500);
    assert!((4.0..5.0).contains(&edge), "{edge:.2}");
    let after = drive(4.0, 500);
    assert!((after - edge).abs() < 0.1, "{edge:.2} to {after:.2}");
    let why = fence.held().unwrap_or_default();
    assert!(why.starts_with("the pose jumped by 4.0 m"), "{why}");
    fence.confirm_pose();
    let confirmed = drive(4.0, 100);
    assert!(confirmed > after + 0.5, "{confirmed:.2}");
}
