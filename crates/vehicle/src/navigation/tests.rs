//! The estimator against simulated journeys, with sensors that fail.
#![expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]

use std::time::{Duration, Instant};

use super::*;
use crate::motion::{Frame, Gone, Noise, Pose, wrap};

const HERE: Frame = Frame {
    latitude: 52.5,
    longitude: 13.4,
    altitude: 80.0,
    heading: 0.0,
};

/// A vehicle that drives, and its sensors.
struct Journey {
    estimator: Estimator,
    now: Instant,
    steps: u32,
    truth: Pose,
    noise: Noise,
    has_gnss: bool,
    has_wheels: bool,
    /// The bias of the gyroscope in radians per second, if there is one.
    gyro: Option<f64>,
    /// Error of all positions to the east in metres.
    offset: f64,
}

impl Journey {
    const STEP: Duration = Duration::from_millis(20);

    fn new(seed: u64) -> Self {
        Self {
            estimator: Estimator::default(),
            now: Instant::now(),
            steps: 0,
            truth: Pose::default(),
            noise: Noise::new(seed),
            has_gnss: true,
            has_wheels: true,
            gyro: None,
            offset: 0.0,
        }
    }

    /// Drives at a speed and a turn rate.
    fn drive(&mut self, speed: f64, rate: f64, seconds: f64) {
        for _ in 0..(seconds / Self::STEP.as_secs_f64()) as u32 {
            self.step(speed, rate);
        }
    }

    fn step(&mut self, speed: f64, rate: f64) {
        let seconds = Self::STEP.as_secs_f64();
        self.now += Self::STEP;
        self.steps += 1;
        self.truth.yaw = wrap(self.truth.yaw + rate * seconds);
        self.truth.x += speed * seconds * self.truth.yaw.cos();
        self.truth.y += speed * seconds * self.truth.yaw.sin();
        if let Some(bias) = self.gyro {
            let noise = 0.002 * self.noise.normal();
            self.estimator.handle_rate(self.now, rate + bias + noise);
        }
        if self.has_wheels {
            let slip = if speed == 0.0 {
                0.0
            } else {
                0.01 * self.noise.normal()
            };
            let gone = Gone {
                forward: speed * seconds * (1.0 + slip),
                turn: rate * seconds * (1.0 + slip),
            };
            self.estimator.handle_travel(self.now, gone);
        }
        if self.has_gnss && self.steps.is_multiple_of(10) {
            let fix = self.fix();
            self.estimator.handle_fix(self.now, &fix);
            let direction = self.truth.yaw
                + if speed < 0.0 {
                    std::f64::consts::PI
                } else {
                    0.0
                };
            let noise = 0.05 * self.noise.normal();
            self.estimator.handle_course(
                self.now,
                &Course {
                    speed: speed.abs(),
                    direction: wrap(direction + noise),
                },
            );
        }
    }

    fn fix(&mut self) -> Fix {
        let noise = [0.5 * self.noise.normal(), 0.5 * self.noise.normal()];
        let place = Pose::at(
            self.truth.x + noise[0],
            self.truth.y + noise[1] + self.offset,
        );
        let global = HERE.to_global(&place);
        Fix {
            time: Duration::from_millis(u64::from(self.steps) * 20),
            latitude: global.latitude,
            longitude: global.longitude,
            altitude: Some(80.0),
            quality: Quality::Differential,
            hdop: 0.9,
        }
    }

    /// Errors of position and heading, and the estimate.
    fn error(&self) -> (f64, f64, Estimate) {
        let estimate = self.estimator.estimate().unwrap();
        let found = HERE.to_local(&estimate.pose);
        let missed = found.distance(self.truth.x, self.truth.y);
        (missed, wrap(found.yaw - self.truth.yaw).abs(), estimate)
    }
}

#[test]
fn on_a_winding_course_the_error_stays_within_what_it_states() {
    for seed in 1..=10 {
        let mut journey = Journey::new(seed);
        journey.gyro = (seed % 2 == 0).then_some(0.01);
        journey.drive(0.0, 0.0, 5.0);
        for rate in [0.0, 0.1, -0.2, 0.05, -0.1] {
            journey.drive(1.5, rate, 10.0);
            let (missed, turned, estimate) = journey.error();
            let told = (estimate.position_rms, estimate.heading_rms);
            assert!(
                missed < 3.0 * told.0 && missed < 1.5,
                "{missed} m, {told:?}"
            );
            assert!(turned < 4.0 * told.1 && turned < 0.2, "{turned}, {told:?}");
            assert_eq!(estimate.sampled_at, journey.now);
        }
    }
}

#[test]
fn the_heading_is_unknown_until_the_vehicle_has_moved() {
    let mut journey = Journey::new(1);
    journey.drive(0.0, 0.0, 10.0);
    let estimate = journey.estimator.estimate().unwrap();
    assert!(estimate.pose.yaw.is_nan() && estimate.heading_rms.is_nan());
    journey.drive(-1.0, 0.0, 5.0);
    let (_, turned, _) = journey.error();
    assert!(
        turned < 0.1,
        "backwards the course is the opposite: {turned}"
    );
}

#[test]
fn wheels_and_gyroscope_bridge_a_drop_out_and_the_uncertainty_grows() {
    let mut journey = Journey::new(2);
    journey.gyro = Some(-0.01);
    journey.drive(0.0, 0.0, 10.0);
    journey.drive(1.5, 0.02, 30.0);
    let before = journey.error().2;
    journey.has_gnss = false;
    journey.drive(1.5, 0.05, 30.0);
    let (missed, _, after) = journey.error();
    assert!(
        missed < 3.0 * after.position_rms && missed < 5.0,
        "{missed}"
    );
    assert!(after.position_rms > 1.5 * before.position_rms, "{after:?}");
    journey.has_gnss = true;
    journey.drive(1.5, 0.0, 20.0);
    assert!(journey.error().0 < 1.5, "it finds its way back");
}

#[test]
fn a_gyroscope_that_falls_silent_in_a_turn_leaves_the_heading_to_the_wheels() {
    for seed in 1..=10 {
        let mut journey = Journey::new(seed);
        journey.gyro = Some(0.01);
        journey.drive(0.0, 0.0, 10.0);
        journey.drive(1.5, 0.0, 20.0);
        journey.has_gnss = false;
        journey.drive(1.5, 1.0, 1.0);
        journey.gyro = None;
        journey.drive(1.5, 1.0, 1.0);
        let (_, turned, estimate) = journey.error();
        assert!(
            turned < 3.0 * estimate.heading_rms,
            "{turned}, {estimate:?}"
        );
    }
}

#[test]
fn without_any_input_the_estimate_does_not_look_fresh() {
    let mut journey = Journey::new(3);
    journey.drive(1.0, 0.0, 20.0);
    let last = journey.now;
    (journey.has_gnss, journey.has_wheels) = (false, false);
    journey.gyro = Some(0.0);
    journey.drive(1.0, 0.0, 10.0);
    let estimate = journey.estimator.estimate().unwrap();
    assert_eq!(
        estimate.sampled_at, last,
        "a turn rate alone is no position"
    );
}

#[test]
fn a_jump_is_rejected_and_counts_as_uncertainty_until_it_lasts() {
    let mut journey = Journey::new(4);
    journey.drive(1.0, 0.0, 30.0);
    journey.offset = 40.0;
    journey.drive(1.0, 0.0, 2.0);
    let (missed, _, estimate) = journey.error();
    assert!(missed < 2.0, "still where it was: {missed}");
    assert!(estimate.position_rms > 30.0, "and in doubt: {estimate:?}");
    journey.offset = 0.0;
    journey.drive(1.0, 0.0, 1.0);
    assert!(journey.error().2.position_rms < 2.0, "the jump is over");
    journey.offset = 40.0;
    journey.drive(1.0, 0.0, 10.0);
    let (missed, _, estimate) = journey.error();
    assert!(
        (missed - 40.0).abs() < 3.0,
        "the receiver was right: {missed}"
    );
    assert!(estimate.position_rms < 3.0, "{estimate:?}");
}

#[test]
fn two_jumps_with_silence_between_them_do_not_move_the_estimate() {
    let mut journey = Journey::new(8);
    journey.drive(1.0, 0.0, 30.0);
    journey.offset = 40.0;
    for _ in 0..3 {
        journey.drive(1.0, 0.0, 0.2);
        journey.has_gnss = false;
        journey.drive(1.0, 0.0, 5.0);
        journey.has_gnss = true;
    }
    let (missed, _, estimate) = journey.error();
    assert!(missed < 2.0, "{missed}");
    assert!(estimate.position_rms > 30.0, "in doubt: {estimate:?}");
}

#[test]
fn rejected_positions_at_different_places_do_not_move_the_estimate() {
    let mut journey = Journey::new(9);
    journey.drive(1.0, 0.0, 30.0);
    for step in 0..50 {
        journey.offset = if step % 2 == 0 { 40.0 } else { -40.0 };
        journey.drive(1.0, 0.0, 0.2);
    }
    let (missed, _, estimate) = journey.error();
    assert!(missed < 2.0, "{missed}");
    assert!(estimate.position_rms > 30.0, "in doubt: {estimate:?}");
}

#[test]
fn without_wheels_the_position_follows_the_receiver() {
    let mut journey = Journey::new(5);
    journey.has_wheels = false;
    journey.drive(2.0, 0.1, 30.0);
    let (missed, turned, estimate) = journey.error();
    assert!(
        missed < 3.0 * estimate.position_rms && missed < 3.0,
        "{missed}"
    );
    assert!(turned < 0.3, "{turned}");
}

#[test]
fn far_from_its_start_it_is_as_accurate() {
    let mut journey = Journey::new(6);
    journey.drive(30.0, 0.0, 400.0);
    let (_, _, estimate) = journey.error();
    // The test's own plane is not accurate here, so the latitude is compared on the ellipsoid.
    let north = (estimate.pose.latitude - HERE.latitude) * 111_272.0;
    assert!((north - journey.truth.x).abs() < 60.0, "{north}");
    assert!(estimate.position_rms < 3.0);
}

#[test]
fn inputs_that_are_no_numbers_change_nothing() {
    let mut journey = Journey::new(7);
    journey.drive(1.0, 0.0, 10.0);
    let before = journey.estimator.estimate().unwrap();
    let bad = Gone {
        forward: f64::NAN,
        turn: 0.0,
    };
    let later = journey.now + Duration::from_secs(1);
    journey.estimator.handle_travel(later, bad);
    journey.estimator.handle_rate(later, f64::INFINITY);
    journey.estimator.set_heading(f64::NAN);
    assert_eq!(journey.estimator.estimate(), Some(before));
}
