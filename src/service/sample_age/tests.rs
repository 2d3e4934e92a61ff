//! A sensor with a clock of its own behind a network with delays: the estimated ages against the
//! true ones.
#![expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]

use proptest::prelude::*;

use super::*;

const PERIOD: Duration = Duration::from_millis(40);
/// Maximum age of a sample whose report arrived immediately.
const FRESH: Duration = Duration::from_millis(1);
/// Uncertainty of a measured offset: half a round trip.
const UNCERTAINTY: f64 = 0.005;

/// A sensor whose clock starts at one hour.
struct Sensor {
    now: Instant,
    /// The sensor's clock, in seconds.
    clock: f64,
    /// Seconds per second that the sensor's clock gains.
    slew: f64,
    /// The last measurement of the clock: when, and how far it was ahead of the true time then.
    measured: Option<(Instant, f64)>,
    start: Instant,
    age: SampleAge,
}

impl Sensor {
    fn new() -> Self {
        let start = Instant::now();
        let mut sensor = Self {
            now: start,
            clock: 3600.0,
            slew: 0.0,
            measured: None,
            start,
            age: SampleAge::default(),
        };
        sensor.report(10);
        assert!(sensor.age() < FRESH);
        sensor
    }

    /// Advances both clocks.
    fn pass(&mut self, time: Duration) {
        self.now += time;
        self.clock += time.as_secs_f64() * (1.0 + self.slew);
    }

    /// How far the sensor's clock is ahead.
    fn ahead(&self) -> f64 {
        self.clock - (self.now - self.start).as_secs_f64()
    }

    /// Measures the sensor's clock.
    fn measure(&mut self) {
        self.measured = Some((self.now, self.ahead()));
    }

    /// Receives a report of a sample that was taken at this time of the sensor's clock.
    fn receive(&mut self, clock: f64) -> Option<Instant> {
        let time = Duration::from_secs_f64(clock);
        let measured = self.measured.map(|(measured_at, ahead)| Age {
            seconds: (self.now - self.start).as_secs_f64() + ahead - clock,
            uncertainty: UNCERTAINTY,
            measured_at,
        });
        self.age
            .handle(self.now, Some(SampleStamp::new(time, measured)))
    }

    /// Receives `count` prompt reports.
    fn report(&mut self, count: usize) {
        for _ in 0..count {
            self.pass(PERIOD);
            self.receive(self.clock);
        }
    }

    fn age(&self) -> Duration {
        self.age.age(self.now).unwrap()
    }
}

#[test]
fn a_stamp_that_is_no_time_and_the_stamp_0_are_none() {
    assert_eq!(SampleStamp::of_report(TimeStamp::default(), None), None);
    let wrong = TimeStamp(u32::MAX);
    assert_eq!(SampleStamp::of_report(wrong, None), None);
    let stamp = TimeStamp::default().with_day(2).unwrap();
    let stamp = stamp.with_milliseconds(7).unwrap();
    let time = Duration::from_millis(2 * 86_400_000 + 7);
    let expected = Some(SampleStamp::from(time));
    assert_eq!(SampleStamp::of_report(stamp, None), expected);
}

#[test]
fn a_stamp_that_stands_still_goes_stale() {
    let mut sensor = Sensor::new();
    sensor.measure();
    let frozen = sensor.clock;
    for _ in 0..25 {
        sensor.pass(PERIOD);
        sensor.receive(frozen);
    }
    assert_eq!(sensor.age(), 25 * PERIOD);
}

#[test]
fn a_sensor_that_was_frozen_from_the_beginning_is_never_fresh() {
    let mut age = SampleAge::default();
    let start = Instant::now();
    for count in 0..10 {
        age.handle(
            start + PERIOD * count,
            Some(Duration::from_secs(3600).into()),
        );
    }
    assert_eq!(age.age(start + PERIOD * 10), None);
}

#[test]
fn reports_from_a_queue_are_as_old_as_their_samples() {
    let mut sensor = Sensor::new();
    let held = sensor.clock;
    sensor.pass(Duration::from_secs(1));
    for count in 1..=10 {
        sensor.pass(PERIOD);
        sensor.receive(held + 0.04 * f64::from(count));
        let age = sensor.age().as_secs_f64();
        assert!((0.999..1.04).contains(&age), "{age} s");
    }
    sensor.report(2);
    assert!(sensor.age() < FRESH, "the queue is empty again");
}

#[test]
fn a_step_of_the_sensors_clock_costs_at_most_one_report() {
    for step in [1800.0, -1800.0, 0.4, -0.4] {
        let mut sensor = Sensor::new();
        sensor.measure();
        sensor.clock += step;
        sensor.report(1);
        assert_eq!(sensor.age(), PERIOD, "that report does not count");
        // The measured offset is wrong by the step until the clock is measured again.
        for _ in 0..20 {
            sensor.report(1);
            assert!(sensor.age() < FRESH, "{step}");
        }
        sensor.measure();
        sensor.report(1);
        assert!(sensor.age() < FRESH, "{step}");
    }
}

#[test]
fn no_step_of_the_clock_makes_a_queue_fresh() {
    for step in [1800.0, -1800.0] {
        let mut sensor = Sensor::new();
        sensor.pass(Duration::from_secs(1));
        let stood = sensor.age();
        let first = sensor.clock + step - 1.0;
        // The whole queue arrives at once.
        for count in 0..25 {
            sensor.receive(first + 0.04 * f64::from(count));
            assert!(sensor.age() >= stood, "report {count}");
        }
    }
}

#[test]
fn without_stamps_the_age_is_that_of_the_message() {
    let mut age = SampleAge::default();
    let now = Instant::now();
    assert_eq!(age.age(now), None);
    age.handle(now, None);
    assert_eq!(age.age(now + PERIOD), Some(PERIOD));
    age.forget();
    assert_eq!(age.age(now), None);
}

#[test]
fn clocks_that_drift_apart_stay_fresh_without_measurement() {
    let mut sensor = Sensor::new();
    sensor.slew = -1e-4;
    sensor.report(90_000);
    let age = sensor.age();
    assert!(age < Duration::from_millis(2), "after an hour: {age:?}");
}

#[test]
fn a_clock_that_is_slewed_makes_no_sample_old_while_it_is_measured() {
    for slew in [MOST_SLEW, -MOST_SLEW] {
        for reports_per_second in [25, 1] {
            let mut sensor = Sensor::new();
            sensor.slew = slew;
            for _ in 0..60 {
                sensor.measure();
                for _ in 0..reports_per_second {
                    sensor.pass(Duration::from_secs(1) / reports_per_second);
                    let handled = sensor.receive(sensor.clock);
                    assert!(handled.is_some(), "a report was ignored at {slew}");
                    let age = sensor.age().as_secs_f64();
                    assert!(age < 0.2, "{age} s at {slew}");
                }
            }
        }
    }
}

#[test]
fn a_delay_that_all_samples_have_shows_once_the_clock_is_measured() {
    let mut sensor = Sensor::new();
    sensor.age.forget();
    let receive_late = |sensor: &mut Sensor| {
        sensor.pass(PERIOD);
        sensor.receive(sensor.clock - 2.0);
    };
    (0..10).for_each(|_| receive_late(&mut sensor));
    assert!(sensor.age() < FRESH, "comparison does not show it");
    sensor.measure();
    receive_late(&mut sensor);
    let age = sensor.age().as_secs_f64();
    assert!((1.97..=2.01).contains(&age), "{age} s");
}

#[test]
fn a_slew_hides_no_delay() {
    for slew in [MOST_SLEW, -MOST_SLEW] {
        let mut sensor = Sensor::new();
        sensor.slew = slew;
        for second in 0..20 {
            // Nothing arrives while the delay grows.
            let delay = if second < 5 { 0.0 } else { 1.0 };
            if second == 5 {
                sensor.pass(Duration::from_secs(1));
            }
            sensor.measure();
            for _ in 0..25 {
                sensor.pass(PERIOD);
                sensor.receive(sensor.clock - delay * (1.0 + slew));
                let age = sensor.age().as_secs_f64();
                assert!(age >= delay - 0.2, "{age} s at {slew}");
                assert!(age <= delay + 0.2, "{age} s at {slew}");
            }
        }
    }
}

#[test]
fn a_clock_that_is_slewed_since_its_last_measurement_hides_no_delay() {
    let mut sensor = Sensor::new();
    sensor.measure();
    sensor.slew = MOST_SLEW;
    sensor.report(125);
    // Each sample is half a second late from now on.
    sensor.pass(Duration::from_millis(500));
    for _ in 0..12 {
        sensor.pass(PERIOD);
        sensor.receive(sensor.clock - 0.5 * (1.0 + sensor.slew));
        let age = sensor.age().as_secs_f64();
        assert!((0.4..0.6).contains(&age), "{age} s");
    }
}

/// One second of a sensor: its slew, the step of its clock at the end, and the greatest delay.
fn second() -> impl Strategy<Value = (f64, f64, f64)> {
    let step = prop_oneof![4 => Just(0.0), 1 => -100.0..100.0_f64];
    (-MOST_SLEW..MOST_SLEW, step, 0.0..0.4_f64)
}

proptest! {
    /// Whatever the clock does, an age is wrong by no more than the delay that reports always have,
    /// and the uncertainty of the measurement. After a step that holds from the next measurement on.
    #[test]
    fn ages_are_true_whatever_the_clock_does(
        seconds in prop::collection::vec(second(), 1..40),
        jitters in prop::collection::vec(0.0..1.0_f64, 1000),
    ) {
        let mut sensor = Sensor::new();
        let mut jitters = jitters.into_iter().cycle();
        for (slew, step, delay) in seconds {
            sensor.slew = slew;
            sensor.measure();
            for _ in 0..25 {
                sensor.pass(PERIOD);
                let true_age = delay * jitters.next().unwrap_or_default();
                if sensor.receive(sensor.clock - true_age).is_some() {
                    let error = sensor.age().as_secs_f64() - true_age;
                    prop_assert!(error.abs() < 0.4 + 0.2, "wrong by {error} s");
                }
            }
            sensor.clock = (sensor.clock + step).max(1.0);
            // The report after the step shows it.
            sensor.report(1);
        }
    }
}
