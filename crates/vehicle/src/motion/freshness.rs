//! Age of a sensor's last sample, derived from sample times instead of message arrival.

use std::time::{Duration, Instant};

/// Estimates the age of samples that carry a time stamp of the sensor's own clock.
///
/// The two clocks are never compared directly. The age of a sample is the time since the last
/// report whose stamp had advanced, plus the lag of that report: its delay relative to its stamp,
/// compared with the promptest report so far. So a frozen stamp goes stale, and so do reports that
/// waited in a queue. A step of the sensor's clock costs one report, which is ignored. Without
/// stamps the age is that of the message.
#[derive(Debug, Clone, Default)]
pub(crate) struct Freshness {
    /// Stamp of the last report.
    stamp: Option<Duration>,
    /// Arrival time minus stamp of the promptest report, and when it arrived.
    promptest: Option<(f64, Instant)>,
    /// Origin of the arrival times.
    epoch: Option<Instant>,
    /// Time of the last valid sample, by the local clock.
    sampled_at: Option<Instant>,
}

impl Freshness {
    /// A report that is this many seconds prompter than the promptest follows a step of the
    /// sensor's clock, or the reports before it were late and it may be late as well.
    const CATCHING_UP: f64 = 0.02;
    /// Maximum clock drift in seconds per second. The promptest offset is relaxed at this rate.
    const DRIFT: f64 = 0.0005;

    /// Handles a report received at `now`. Returns the sample time by the local clock; `None` if
    /// the report is ignored.
    pub(crate) fn handle(&mut self, now: Instant, stamp: Option<Duration>) -> Option<Instant> {
        let Some(stamp) = stamp else {
            *self = Self {
                sampled_at: Some(now),
                ..Self::default()
            };
            return self.sampled_at;
        };
        let epoch = *self.epoch.get_or_insert(now);
        let receipt = now.saturating_duration_since(epoch).as_secs_f64();
        let offset = receipt - stamp.as_secs_f64();
        let before = self.stamp.replace(stamp);
        if before == Some(stamp) {
            return None;
        }
        let has_advanced = before.is_some_and(|before| stamp > before);
        let promptest = self.promptest.filter(|_| has_advanced).map(|(least, at)| {
            let since = now.saturating_duration_since(at).as_secs_f64();
            least + Self::DRIFT * since
        });
        let Some(promptest) = promptest.filter(|least| offset > least - Self::CATCHING_UP) else {
            self.promptest = Some((offset, now));
            return None;
        };
        if offset <= promptest {
            self.promptest = Some((offset, now));
        }
        let lag = Duration::from_secs_f64((offset - promptest).max(0.0));
        self.sampled_at = now.checked_sub(lag);
        self.sampled_at
    }

    /// Discards all state, because the sensor has lost its measurement or was replaced.
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }

    /// The age of the last sample; `None` without a sample.
    pub(crate) fn age(&self, now: Instant) -> Option<Duration> {
        Some(now.saturating_duration_since(self.sampled_at?))
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(40);
    /// Maximum age of a sample whose report arrived immediately.
    const FRESH: Duration = Duration::from_millis(1);

    /// A sensor whose clock starts at one hour.
    struct Sensor {
        now: Instant,
        clock: Duration,
        freshness: Freshness,
    }

    impl Sensor {
        fn new() -> Self {
            let mut sensor = Self {
                now: Instant::now(),
                clock: Duration::from_secs(3600),
                freshness: Freshness::default(),
            };
            sensor.report(10);
            assert!(sensor.age() < FRESH);
            sensor
        }

        /// Advances both clocks.
        fn pass(&mut self, time: Duration) {
            self.now += time;
            self.clock += time;
        }

        /// Receives `count` prompt reports.
        fn report(&mut self, count: usize) {
            for _ in 0..count {
                self.pass(PERIOD);
                self.freshness.handle(self.now, Some(self.clock));
            }
        }

        fn age(&self) -> Duration {
            self.freshness.age(self.now).unwrap()
        }
    }

    #[test]
    fn a_stamp_that_stands_still_goes_stale() {
        let mut sensor = Sensor::new();
        let frozen = sensor.clock;
        for _ in 0..25 {
            sensor.pass(PERIOD);
            sensor.freshness.handle(sensor.now, Some(frozen));
        }
        assert_eq!(sensor.age(), 25 * PERIOD);
    }

    #[test]
    fn a_sensor_that_was_frozen_from_the_beginning_is_never_fresh() {
        let mut freshness = Freshness::default();
        let start = Instant::now();
        for count in 0..10 {
            let stamp = Some(Duration::from_secs(3600));
            freshness.handle(start + PERIOD * count, stamp);
        }
        assert_eq!(freshness.age(start + PERIOD * 10), None);
    }

    #[test]
    fn reports_from_a_queue_are_as_old_as_their_samples() {
        let mut sensor = Sensor::new();
        let delay = Duration::from_secs(1);
        let (held, since) = (sensor.clock, sensor.now);
        sensor.pass(delay);
        for count in 1..=10 {
            sensor.pass(PERIOD);
            sensor
                .freshness
                .handle(sensor.now, Some(held + PERIOD * count));
            let age = sensor.age();
            assert!(age >= delay - FRESH && age <= sensor.now - since, "{age:?}");
        }
        sensor.report(2);
        assert!(sensor.age() < FRESH, "the queue is empty again");
    }

    #[test]
    fn a_step_of_the_sensors_clock_costs_at_most_one_report() {
        for forward in [true, false] {
            let mut sensor = Sensor::new();
            let step = Duration::from_secs(1800);
            sensor.clock = if forward {
                sensor.clock + step
            } else {
                sensor.clock - step
            };
            sensor.report(1);
            assert_eq!(sensor.age(), PERIOD, "that report does not count");
            sensor.report(1);
            assert!(sensor.age() < FRESH, "the next one does");
        }
    }

    #[test]
    fn no_step_of_the_clock_makes_a_queue_fresh() {
        let step = Duration::from_secs(1800);
        for forward in [true, false] {
            let mut sensor = Sensor::new();
            sensor.pass(Duration::from_secs(1));
            let stood = sensor.age();
            let first = match forward {
                true => sensor.clock + step,
                false => sensor.clock - step,
            } - Duration::from_secs(1);
            // The whole queue arrives at once.
            for count in 0..25 {
                sensor
                    .freshness
                    .handle(sensor.now, Some(first + PERIOD * count));
                assert!(sensor.age() >= stood, "report {count}");
            }
        }
    }

    #[test]
    fn without_stamps_the_age_is_that_of_the_message() {
        let mut freshness = Freshness::default();
        let now = Instant::now();
        assert_eq!(freshness.age(now), None);
        freshness.handle(now, None);
        assert_eq!(freshness.age(now + PERIOD), Some(PERIOD));
        freshness.forget();
        assert_eq!(freshness.age(now), None);
    }

    #[test]
    fn clocks_that_drift_apart_stay_fresh() {
        let mut freshness = Freshness::default();
        let start = Instant::now();
        let (mut now, mut stamp) = (start, 3600.0);
        for _ in 0..90_000 {
            now += PERIOD;
            stamp += PERIOD.as_secs_f64() * (1.0 - 1e-4);
            freshness.handle(now, Some(Duration::from_secs_f64(stamp)));
        }
        let age = freshness.age(now).unwrap();
        assert!(age < Duration::from_millis(2), "after an hour: {age:?}");
    }
}
