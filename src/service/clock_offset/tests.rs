//! A peer's clock behind a simulated network: delays in both directions, loss, drift, steps.
#![expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]

use super::super::time::{date_stamp, time_stamp};
use super::*;

/// 2024-02-28 23:59:58.
const BEFORE_MIDNIGHT: u64 = 1_709_164_798;

/// The peer, the network and the own clock.
struct World {
    estimator: ClockEstimator,
    start: Instant,
    /// Time since the start.
    now: Duration,
    /// Own time of day at the start.
    own: Duration,
    /// Seconds that the peer's clock is ahead at the start.
    offset: f64,
    drift: f64,
    has_date: bool,
    seed: u64,
}

impl World {
    fn new(offset: f64) -> Self {
        Self {
            estimator: ClockEstimator::default(),
            start: Instant::now(),
            now: Duration::ZERO,
            own: Duration::from_secs(BEFORE_MIDNIGHT),
            offset,
            drift: 0.0,
            has_date: true,
            seed: 1,
        }
    }

    /// A number from 0 to below 1.
    fn random(&mut self) -> f64 {
        self.seed = self
            .seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.seed >> 33) as f64 / f64::from(1_u32 << 31)
    }

    fn true_offset(&self) -> f64 {
        self.offset + self.drift * self.now.as_secs_f64()
    }

    fn pass(&mut self, seconds: f64) {
        self.now += Duration::from_secs_f64(seconds);
    }

    fn report(&self) -> ReportTime {
        let time = (self.own + self.now).as_secs_f64() + self.true_offset();
        let milliseconds = (time * 1e3).floor() as i64;
        ReportTime {
            time_stamp: time_stamp(milliseconds),
            date_stamp: date_stamp(milliseconds).filter(|_| self.has_date),
        }
    }

    /// An exchange with these delays in seconds there and back.
    fn exchange(&mut self, there: f64, back: f64) -> Exchange {
        let sent = self.start + self.now;
        self.pass(there);
        let report = self.report();
        self.pass(back);
        let received = self.start + self.now;
        let own = self.own + self.now;
        self.estimator.handle_report(sent, received, own, &report)
    }

    fn age(&self, stamp: TimeStamp) -> Age {
        self.estimator.age(stamp, self.start + self.now).unwrap()
    }

    #[track_caller]
    fn assert_sound(&self) -> ClockOffset {
        let offset = self.estimator.offset().unwrap();
        let error = (offset.seconds - self.true_offset()).abs();
        // The own drift since the peer read its clock is far below a microsecond.
        assert!(error <= offset.uncertainty + 1e-6, "{error} s: {offset:?}");
        offset
    }
}

#[test]
fn the_offset_is_known_to_half_the_round_trip() {
    for offset in [0.0, 12.345, -0.2, 86_400.0, -3e7] {
        let mut world = World::new(offset);
        assert_eq!(world.exchange(0.004, 0.004), Exchange::Accepted);
        let measured = world.assert_sound();
        assert!(measured.uncertainty <= 0.0046, "{measured:?}");
    }
}

#[test]
fn delays_of_one_direction_do_not_leave_the_bounds_and_prompt_exchanges_narrow_them() {
    let mut world = World::new(1.5);
    for exchange in 0..200 {
        let (there, back) = (world.random() * 0.005, world.random() * 0.8);
        let is_lost = world.random() < 0.3;
        world.pass(1.0);
        // A lost exchange costs its delay and gives nothing.
        if is_lost {
            world.pass(there + back);
            continue;
        }
        assert_eq!(
            world.exchange(there, back),
            Exchange::Accepted,
            "{exchange}"
        );
        world.assert_sound();
    }
    let measured = world.assert_sound();
    assert!(measured.uncertainty < 0.1, "{measured:?}");
    assert_eq!(measured.steps, 0);
}

#[test]
fn a_drift_is_found_and_is_no_step() {
    for drift in [50e-6, -120e-6, 0.0] {
        let mut world = World::new(-0.75);
        world.drift = drift;
        assert_eq!(world.exchange(0.001, 0.001), Exchange::Accepted);
        assert_eq!(world.assert_sound().drift, None);
        for _ in 0..120 {
            world.pass(10.0);
            let (there, back) = (world.random() * 0.003, world.random() * 0.003);
            assert_eq!(world.exchange(there, back), Exchange::Accepted);
            world.assert_sound();
        }
        let found = world.assert_sound().drift.unwrap();
        assert!(
            (found.ratio - drift).abs() <= found.uncertainty,
            "{found:?}"
        );
        assert!(found.uncertainty < 20e-6, "{found:?}");
    }
}

#[test]
fn a_step_of_either_clock_is_noticed_with_the_next_exchange() {
    let mut world = World::new(0.25);
    for _ in 0..20 {
        world.pass(1.0);
        world.exchange(0.002, 0.002);
    }
    world.offset = -3.0;
    world.pass(1.0);
    assert_eq!(world.exchange(0.002, 0.002), Exchange::Stepped);
    assert_eq!(world.assert_sound().steps, 1);
    world.pass(1.0);
    assert_eq!(world.exchange(0.002, 0.002), Exchange::Accepted);
    // The own clock: the peer's true time is the same.
    world.own += Duration::from_secs(60);
    world.offset -= 60.0;
    assert_eq!(world.exchange(0.002, 0.002), Exchange::Stepped);
    assert_eq!(world.assert_sound().steps, 2);
}

#[test]
fn a_slew_is_no_step_and_the_offset_follows_it() {
    for slew in [MOST_SLEW, -MOST_SLEW] {
        let mut world = World::new(0.25);
        world.exchange(0.002, 0.002);
        for _ in 0..60 {
            world.pass(1.0);
            world.offset += slew;
            assert_ne!(world.exchange(0.002, 0.002), Exchange::Stepped);
            world.assert_sound();
        }
        assert_eq!(world.assert_sound().steps, 0);
    }
}

#[test]
fn a_step_of_the_own_clock_makes_no_report_older() {
    let mut world = World::new(-40.0);
    world.exchange(0.002, 0.002);
    let stamp = world.report().time_stamp.unwrap();
    world.pass(0.5);
    world.own += Duration::from_secs(3600);
    let age = world.age(stamp);
    assert!((age.seconds - 0.5).abs() <= age.uncertainty, "{age:?}");
}

#[test]
fn midnight_changes_the_day_of_reports_with_and_without_a_date() {
    for has_date in [true, false] {
        for offset in [0.9, -0.9] {
            let mut world = World::new(offset);
            world.has_date = has_date;
            for _ in 0..40 {
                assert_eq!(world.exchange(0.001, 0.001), Exchange::Accepted);
                world.assert_sound();
                world.pass(0.1);
            }
        }
    }
}

#[test]
fn a_date_from_the_other_side_of_midnight_is_that_of_the_time() {
    // Today's date was read before midnight, the time after it.
    let midnight = i64::try_from(BEFORE_MIDNIGHT + 2).unwrap() * 1000;
    let report = ReportTime {
        time_stamp: time_stamp(midnight + 1),
        date_stamp: date_stamp(midnight - 1),
    };
    let own = Duration::from_secs(BEFORE_MIDNIGHT + 2);
    assert_eq!(reported_milliseconds(&report, own), Some(midnight + 1));
}

#[test]
fn a_report_without_a_valid_time_is_ignored() {
    let mut world = World::new(0.0);
    let now = world.start;
    for report in [
        ReportTime::default(),
        ReportTime {
            time_stamp: Some(TimeStamp(u32::MAX)),
            ..ReportTime::default()
        },
    ] {
        let own = world.own;
        let exchange = world.estimator.handle_report(now, now, own, &report);
        assert_eq!(exchange, Exchange::Ignored);
        assert_eq!(world.estimator.offset(), None);
    }
}

#[test]
fn the_memory_is_bounded() {
    let mut world = World::new(0.0);
    for _ in 0..10_000 {
        world.pass(20.0);
        world.exchange(0.001, 0.001);
        assert!(world.estimator.history.len() <= ClockEstimator::KEPT);
    }
}

#[test]
fn the_age_of_a_report_needs_no_synchronised_clocks() {
    for offset in [0.0, 3600.0, -40.0] {
        let mut world = World::new(offset);
        world.exchange(0.002, 0.002);
        let stamp = world.report().time_stamp.unwrap();
        world.pass(0.5);
        let age = world.age(stamp);
        assert!((age.seconds - 0.5).abs() <= age.uncertainty, "{age:?}");
        assert!(age.uncertainty < 0.005, "{age:?}");
    }
    let unknown = ClockEstimator::default();
    assert_eq!(unknown.age(TimeStamp(0), Instant::now()), None);
}
