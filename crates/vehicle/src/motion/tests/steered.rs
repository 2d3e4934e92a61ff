//! A simulated car in virtual time: it cannot turn on the spot and still reaches its goals.

use super::*;
use crate::actuator::{
    MotorConfig, Odometer, SimulatedMotor, SimulatedServo, SteeredDrive, Wheels, WheelsConfig,
};

fn car() -> Wheels<SteeredDrive<SimulatedMotor, SimulatedServo>> {
    let motor = SimulatedMotor::new(MotorConfig::default());
    let servo = SimulatedServo::new(SimulatedServo::RATE);
    let (config, geometry) = (WheelsConfig::default(), Ackermann::default());
    Wheels::steered(motor, servo, config, geometry, Odometer::new(1))
}

#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
fn pilot() -> (Pilot, Instant) {
    let now = Instant::now();
    let mut pilot = Pilot::new(car(), Frame::default());
    pilot.handle_time(now);
    (pilot, now)
}

/// Drives to a goal. Checks that the vehicle never turns tighter than it can. Returns its pose, the
/// seconds, and the farthest distance from the start.
fn drive(goal: Goal, limit: f64) -> (Pose, f64, f64) {
    let (mut pilot, mut now) = pilot();
    let ticket = pilot.pursue(goal);
    let (mut seconds, mut farthest) = (0.0, 0.0_f64);
    while !pilot.has_arrived(ticket) || !pilot.is_at_rest() {
        let before = pilot.motion().pose;
        now += Pilot::STEP;
        seconds += Pilot::STEP.as_secs_f64();
        pilot.handle_time(now);
        let pose = pilot.motion().pose;
        let turned = wrap(pose.yaw - before.yaw).abs();
        let moved = before.distance(pose.x, pose.y);
        let least = Ackermann::default().turning_radius();
        assert!(turned * least <= moved * 1.01 + 1e-9, "{turned} in {moved}");
        farthest = farthest.max(pose.distance(0.0, 0.0));
        assert!(seconds < limit, "not there: {pose:?} to {goal:?}");
    }
    (pilot.motion().pose, seconds, farthest)
}

#[test]
fn waypoints_all_around_are_reached_without_turning_on_the_spot() {
    for tolerance in [0.1, 0.5] {
        for direction in 0..24 {
            let angle = f64::from(direction) * PI / 12.0;
            for distance in [0.3, 1.0, 2.0, 30.0] {
                let to = Waypoint {
                    tolerance,
                    ..Waypoint::at(distance * angle.cos(), distance * angle.sin())
                };
                let (pose, _, farthest) = drive(waypoint(to, 1.0), 90.0);
                assert!(pose.distance(to.x, to.y) <= tolerance + 0.05, "{to:?}");
                assert!(
                    farthest < distance + 3.5,
                    "{to:?}: it needed {farthest} m of room"
                );
            }
        }
    }
}

#[test]
fn a_waypoint_with_a_heading_is_reached_in_that_heading() {
    for heading in [0.0, FRAC_PI_2, PI, -2.0] {
        for (x, y) in [(-4.0, 3.0), (0.5, 0.5), (12.0, 0.0)] {
            let to = Waypoint {
                heading: Some(heading),
                ..Waypoint::at(x, y)
            };
            let (pose, ..) = drive(waypoint(to, 1.0), 120.0);
            assert!(pose.distance(x, y) <= 0.6, "{to:?}: {pose:?}");
            assert!(wrap(pose.yaw - heading).abs() < 0.2, "{to:?}: {pose:?}");
        }
    }
}

#[test]
fn a_curve_is_followed_closely_to_its_end() {
    let curve = Curve {
        start: (0.0, 0.0),
        control: (4.0, 0.0),
        end: (4.0, 4.0),
        weight: std::f64::consts::FRAC_1_SQRT_2,
    };
    let (mut pilot, mut now) = pilot();
    let ticket = pilot.pursue(Goal::Path {
        curve,
        speed: 1.0,
        tolerance: 0.2,
        goes_on: false,
    });
    for _ in 0..1500 {
        now += Pilot::STEP;
        pilot.handle_time(now);
        let pose = pilot.motion().pose;
        let off = (pose.distance(0.0, 4.0) - 4.0).abs();
        assert!(off < 0.4, "{off} m off the curve at {pose:?}");
        if pilot.has_arrived(ticket) {
            return;
        }
    }
    panic!("not there: {:?}", pilot.motion());
}

#[test]
fn a_vector_behind_is_taken_by_backing_up_and_kept() {
    let (mut pilot, mut now) = pilot();
    pilot.pursue(Goal::Vector {
        speed: 1.0,
        heading: Some(Heading::Local(PI)),
    });
    let mut went_back = false;
    for _ in 0..500 {
        now += Pilot::STEP;
        pilot.handle_time(now);
        went_back |= pilot.motion().velocity.x < -0.2;
    }
    let motion = pilot.motion();
    assert!(went_back, "one wide circle would need more room");
    assert!(wrap(motion.pose.yaw - PI).abs() < 0.02, "{motion:?}");
    assert!((motion.velocity.x - 1.0).abs() < 0.05 && motion.pose.x < 0.0);
}

#[test]
fn a_velocity_that_only_turns_moves_nothing() {
    let (mut pilot, mut now) = pilot();
    pilot.pursue(Goal::Velocity(Velocity::forward(0.0, 1.0)));
    for _ in 0..100 {
        now += Pilot::STEP;
        pilot.handle_time(now);
    }
    assert!(pilot.motion().velocity.is_rest());
    assert_eq!(pilot.motion().pose, Pose::default());
}
