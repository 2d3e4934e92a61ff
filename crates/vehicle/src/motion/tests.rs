//! A simulated vehicle in virtual time: it reaches its goals and keeps its limits on the way.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::*;

mod steered;

/// A vehicle and its time, checked at every step.
struct Track {
    pilot: Pilot,
    now: Instant,
    seconds: f64,
}

impl Track {
    fn new() -> Self {
        Self::with(SkidSteerConfig::default())
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn with(config: SkidSteerConfig) -> Self {
        let now = Instant::now();
        let mut pilot = Pilot::new(SkidSteer::new(config), Frame::default());
        pilot.handle_time(now);
        Self {
            pilot,
            now,
            seconds: 0.0,
        }
    }

    /// Advances one step. Checks that nothing jumps and no limit is exceeded.
    fn step(&mut self) {
        let before = self.pilot.motion();
        self.now += Pilot::STEP;
        self.pilot.handle_time(self.now);
        let after = self.pilot.motion();
        let (limits, step) = (self.pilot.limits(), Pilot::STEP.as_secs_f64());
        self.seconds += step;
        let slack = 1.0 + 1e-9;
        let speed = after.velocity.x;
        assert!(
            speed <= limits.speed * slack && speed >= -limits.reverse * slack,
            "{speed}"
        );
        assert!(after.velocity.yaw.abs() <= limits.yaw_rate * slack);
        let moved = before.pose.distance(after.pose.x, after.pose.y);
        assert!(
            moved <= limits.speed.max(limits.reverse) * step * slack,
            "jumped {moved} m"
        );
        let change = (speed - before.velocity.x).abs();
        assert!(
            change <= limits.deceleration * step * slack,
            "{change} m/s at once"
        );
        assert!(wrap(after.pose.yaw - before.pose.yaw).abs() <= limits.yaw_rate * step * slack);
    }

    fn run(&mut self, seconds: f64) {
        let end = self.seconds + seconds - 1e-9;
        while self.seconds < end {
            self.step();
        }
    }

    /// Runs until a goal is reached, then until the vehicle stands still.
    fn arrive(&mut self, goal: Goal, limit: f64) -> Pose {
        let ticket = self.pilot.pursue(goal);
        let end = self.seconds + limit;
        while !self.pilot.has_arrived(ticket) || !self.pilot.is_at_rest() {
            assert!(self.seconds < end, "not there: {:?}", self.pilot.motion());
            self.step();
        }
        self.pilot.motion().pose
    }
}

fn waypoint(to: Waypoint, speed: f64) -> Goal {
    Goal::Waypoint {
        to,
        speed,
        goes_on: false,
    }
}

#[test]
fn waypoints_all_around_are_reached_within_their_tolerance() {
    for tolerance in [0.1, 0.5, 2.0] {
        for direction in 0..16 {
            let angle = f64::from(direction) * PI / 8.0;
            for distance in [0.3, 2.0, 30.0] {
                let to = Waypoint {
                    tolerance,
                    ..Waypoint::at(distance * angle.cos(), distance * angle.sin())
                };
                let mut track = Track::new();
                let pose = track.arrive(waypoint(to, 2.0), 60.0);
                let missed = pose.distance(to.x, to.y);
                assert!(missed <= tolerance, "{to:?} missed by {missed}");
            }
        }
    }
}

#[test]
fn a_waypoint_with_a_heading_is_left_in_that_heading() {
    for heading in [0.0, FRAC_PI_2, PI, -2.0] {
        let to = Waypoint {
            heading: Some(heading),
            ..Waypoint::at(-4.0, 3.0)
        };
        let pose = Track::new().arrive(waypoint(to, 1.0), 60.0);
        assert!(to.is_reached(&pose));
        assert!(
            wrap(pose.yaw - heading).abs() < 0.1,
            "{heading}: {}",
            pose.yaw
        );
    }
}

#[test]
fn a_waypoint_is_reached_with_wheels_that_slip() {
    for seed in 0..20 {
        let config = SkidSteerConfig {
            noise: 0.2,
            seed,
            ..SkidSteerConfig::default()
        };
        let mut track = Track::with(config);
        track.pilot.pursue(waypoint(Waypoint::at(10.0, 5.0), 2.0));
        // Its speed may change faster than that of its wheels, so the limits are not checked.
        for _ in 0..1500 {
            track.now += Pilot::STEP;
            track.pilot.handle_time(track.now);
        }
        let pose = track.pilot.motion().pose;
        assert!(pose.distance(10.0, 5.0) < 0.6, "seed {seed}: {pose:?}");
    }
}

#[test]
fn the_same_seed_gives_the_same_course_and_another_seed_another() {
    let course = |seed| {
        let noise = 0.1;
        let mut track = Track::with(SkidSteerConfig {
            noise,
            seed,
            ..SkidSteerConfig::default()
        });
        track
            .pilot
            .pursue(Goal::Velocity(Velocity::forward(1.0, 0.2)));
        for _ in 0..200 {
            track.now += Pilot::STEP;
            track.pilot.handle_time(track.now);
        }
        track.pilot.motion().pose
    };
    assert_eq!(course(1), course(1));
    assert_ne!(course(1), course(2));
}

#[test]
fn a_vector_is_kept() {
    let mut track = Track::new();
    let heading = Some(-FRAC_PI_2);
    track.pilot.pursue(Goal::Vector {
        speed: 1.5,
        heading: heading.map(Heading::Local),
    });
    track.run(6.0);
    let motion = track.pilot.motion();
    assert!((motion.velocity.x - 1.5).abs() < 0.01 && motion.velocity.yaw.abs() < 0.01);
    assert!(wrap(motion.pose.yaw + FRAC_PI_2).abs() < 0.01);
    assert!(motion.pose.y < -4.0);
}

#[test]
fn a_velocity_beyond_the_limits_is_driven_as_fast_as_they_allow() {
    let mut track = Track::new();
    track
        .pilot
        .pursue(Goal::Velocity(Velocity::forward(300.0, -30.0)));
    track.run(5.0);
    let (motion, limits) = (track.pilot.motion(), track.pilot.limits());
    assert!((motion.velocity.x - limits.speed).abs() < 1e-9);
    assert!((motion.velocity.yaw + limits.yaw_rate).abs() < 1e-9);
}

#[test]
fn narrower_limits_are_kept_and_wider_ones_are_not_taken() {
    let mut track = Track::new();
    let narrow = Limits {
        speed: 0.5,
        yaw_rate: 100.0,
        ..Limits::default()
    };
    track.pilot.set_limits(narrow);
    assert!((track.pilot.limits().yaw_rate - Limits::default().yaw_rate).abs() < 1e-12);
    track
        .pilot
        .pursue(Goal::Velocity(Velocity::forward(2.0, 0.0)));
    track.run(5.0);
    assert!((track.pilot.motion().velocity.x - 0.5).abs() < 1e-9);
}

#[test]
fn full_effort_comes_to_full_speed_and_the_brakes_to_rest() {
    let mut track = Track::new();
    let effort = Effort {
        forward: 1.0,
        ..Effort::default()
    };
    track.pilot.pursue(Goal::Effort(effort));
    track.run(15.0);
    let speed = track.pilot.motion().velocity.x;
    assert!(speed > 0.99 * track.pilot.limits().speed, "{speed}");
    let brake = Effort {
        brake: 1.0,
        ..Effort::default()
    };
    track.pilot.pursue(Goal::Effort(brake));
    track.run(2.0);
    assert!(track.pilot.motion().velocity.is_rest());
    let turn = Effort {
        turn: -1.0,
        ..Effort::default()
    };
    track.pilot.pursue(Goal::Effort(turn));
    track.run(3.0);
    assert!(track.pilot.motion().velocity.yaw < -1.0);
}

#[test]
fn whoever_is_told_to_stop_stops_within_its_brakes_and_then_wants_no_more_time() {
    let mut track = Track::new();
    let ticket = track.pilot.pursue(waypoint(Waypoint::at(50.0, 0.0), 2.0));
    track.run(5.0);
    track.pilot.give_up(ticket);
    track.run(2.0 / 2.0 + 0.1);
    assert!(track.pilot.is_at_rest() && track.pilot.poll_timeout().is_none());
    let pose = track.pilot.motion().pose;
    track.now += Duration::from_secs(3600);
    track.pilot.handle_time(track.now);
    assert_eq!(track.pilot.motion().pose, pose);
}

#[test]
fn a_platform_whose_pilot_goes_away_is_told_to_stop() {
    /// A platform that records its last command.
    struct Reported(Arc<Mutex<Drive>>);

    impl Platform for Reported {
        fn handle_time(&mut self, _: Instant) {}
        fn motion(&self) -> Motion {
            Motion::default()
        }
        fn set_pose(&mut self, _: Pose) {}
        fn drive(&mut self, command: Drive) {
            *self.0.lock().unwrap() = command;
        }
        fn limits(&self) -> Limits {
            Limits::default()
        }
        fn set_limits(&mut self, _: Limits) {}
    }

    let told = Arc::new(Mutex::new(Drive::Stop));
    let mut track = Track::new();
    track.pilot = Pilot::new(Reported(told.clone()), Frame::default());
    track.pilot.handle_time(track.now);
    let forward = Velocity::forward(1.0, 0.0);
    track.pilot.pursue(Goal::Velocity(forward));
    track.pilot.handle_time(track.now + Pilot::STEP);
    assert_eq!(*told.lock().unwrap(), Drive::Velocity(forward));
    drop(track);
    assert_eq!(*told.lock().unwrap(), Drive::Stop);
}

#[test]
fn a_goal_that_was_replaced_is_not_given_up_with_the_old_ticket() {
    let mut track = Track::new();
    let old = track.pilot.pursue(waypoint(Waypoint::at(50.0, 0.0), 2.0));
    let new = track.pilot.pursue(waypoint(Waypoint::at(0.0, 50.0), 2.0));
    track.pilot.give_up(old);
    assert!(track.pilot.pursues(new) && !track.pilot.pursues(old));
}

#[test]
fn a_time_that_stood_still_does_not_make_the_vehicle_jump() {
    let mut track = Track::new();
    track
        .pilot
        .pursue(Goal::Velocity(Velocity::forward(2.0, 0.0)));
    track.run(5.0);
    let before = track.pilot.motion().pose;
    track.now += Duration::from_secs(3600);
    track.pilot.handle_time(track.now);
    let after = track.pilot.motion().pose;
    assert!(before.distance(after.x, after.y) < 5.0);
}

#[test]
fn a_curve_is_followed_closely_to_its_end() {
    let curve = Curve {
        start: (0.0, 0.0),
        control: (10.0, 0.0),
        end: (10.0, 10.0),
        weight: std::f64::consts::FRAC_1_SQRT_2,
    };
    for speed in [0.5, 1.0, 2.0] {
        let mut track = Track::new();
        let goal = Goal::Path {
            curve,
            speed,
            tolerance: 0.2,
            goes_on: false,
        };
        let ticket = track.pilot.pursue(goal);
        while !track.pilot.has_arrived(ticket) {
            assert!(
                track.seconds < 60.0,
                "not there: {:?}",
                track.pilot.motion()
            );
            track.step();
            let pose = track.pilot.motion().pose;
            // The curve is a quarter of a circle around (0, 10).
            let off = (pose.distance(0.0, 10.0) - 10.0).abs();
            assert!(off < 0.4, "{off} m off the curve at {pose:?}");
        }
        track.run(2.0);
        assert!(track.pilot.motion().pose.distance(10.0, 10.0) <= 0.2);
    }
}

#[test]
fn a_new_pose_moves_the_frame_and_not_the_vehicle() {
    let mut track = Track::new();
    let before = track.pilot.global_pose();
    track.pilot.set_pose(Pose {
        yaw: FRAC_PI_2,
        ..Pose::at(-1000.0, -1000.0)
    });
    let after = track.pilot.global_pose();
    assert!((after.latitude - before.latitude).abs() < 1e-9);
    assert!((after.longitude - before.longitude).abs() < 1e-9);
    assert!(wrap(after.yaw - before.yaw).abs() < 1e-9);
    let pose = track.arrive(waypoint(Waypoint::at(-995.0, -1000.0), 1.0), 60.0);
    assert!(pose.distance(-995.0, -1000.0) < 0.5);
}

#[test]
fn a_jump_of_the_pose_ends_a_goal_that_needs_it_also_when_the_goal_is_repeated() {
    for repeats in [false, true] {
        let Track { mut now, .. } = Track::new();
        let observed = Observed::default();
        let mut pilot = Pilot::new(observed.clone(), Frame::default());
        let goal = Goal::Vector {
            speed: 1.0,
            heading: Some(Heading::Local(0.0)),
        };
        let mut drive = |y: f64, steps: u32| {
            for _ in 0..steps {
                now += Pilot::STEP;
                observed.set(Motion {
                    pose: Pose::at(0.0, y),
                    velocity: Velocity::forward(1.0, 0.0),
                    sampled_at: Some(now),
                    ..Motion::default()
                });
                if repeats || !pilot.is_under_way() {
                    pilot.pursue(goal);
                }
                pilot.handle_time(now);
            }
            pilot.take_trouble()
        };
        assert_eq!(drive(0.0, 50), None);
        let trouble = drive(3.0, 1);
        assert!(
            matches!(trouble, Some(Trouble::PoseJumped(_))),
            "{trouble:?}"
        );
    }
}
