//! Age of samples from their own time stamps, with unsynchronised clocks: by comparison of the samples with each other,
//! and by the measured offset of the sender's clock if the sender offers the Time service. The former does not see a
//! delay that all samples have.

use std::time::{Duration, Instant};

use jaus::messages::mobility::report_local_pose::TimeStamp;
use jaus::service::Age;

/// What is known of the time of a sample when its report arrives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sampled {
    stamp: Option<TimeStamp>,
    /// By the measured offset of the sender's clock.
    age: Option<Age>,
}

impl Sampled {
    pub(super) const fn new(stamp: Option<TimeStamp>) -> Self {
        Self { stamp, age: None }
    }

    /// Enters the age that `measured` gives for the stamp.
    pub(super) fn measure(&mut self, measured: impl FnOnce(TimeStamp) -> Option<Age>) {
        self.age = self.stamp.and_then(measured);
    }
}

/// Milliseconds since the start of the sender's month.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Stamp(u64);

/// Estimates when the samples of one sender were taken, by the local clock.
///
/// The sample with the least delay is the reference: it counts as taken on arrival, and the age of
/// the others follows from the stamp differences. A repeated stamp means a frozen sensor, so the
/// sample ages although reports arrive.
#[derive(Debug, Clone, Copy)]
pub(super) struct SampleClock {
    /// Stamp and arrival time of the sample with the least delay.
    reference: (Stamp, Instant),
    newest: Stamp,
    /// Time of the newest sample.
    taken: Instant,
    /// Arrival time of the newest sample.
    received: Instant,
    /// When the sender's clock was last seen to be set. Offsets measured before do not hold.
    since: Instant,
}

impl Stamp {
    /// Reads a stamp; `None` if it is not a valid time.
    fn read(stamp: TimeStamp) -> Option<Self> {
        let [day, hour, minutes, seconds] =
            [stamp.day(), stamp.hour(), stamp.minutes(), stamp.seconds()].map(u64::from);
        let milliseconds = u64::from(stamp.milliseconds());
        let is_real = hour < 24 && minutes < 60 && seconds < 60 && milliseconds < 1000;
        let seconds = ((day * 24 + hour) * 60 + minutes) * 60 + seconds;
        is_real.then_some(Self(seconds * 1000 + milliseconds))
    }

    fn since(self, earlier: Self) -> Duration {
        Duration::from_millis(self.0.saturating_sub(earlier.0))
    }
}

impl SampleClock {
    /// Clocks differ by less than one part in this number.
    const DRIFT: u32 = 1000;

    /// Handles the sample of a report that arrives now, and returns the time when it was taken. Without a stamp, that
    /// is now.
    pub(super) fn sampled_at(clock: &mut Option<Self>, now: Instant, sampled: Sampled) -> Instant {
        let Some(stamp) = sampled.stamp.and_then(Stamp::read) else {
            *clock = None;
            return now;
        };
        let clock = clock.get_or_insert_with(|| Self::new(now, stamp));
        let taken = clock.handle_sample(now, stamp);
        let age = sampled.age.filter(|age| age.measured_at > clock.since);
        let measured = age.and_then(|age| now.checked_sub(age.at_least()));
        measured.map_or(taken, |measured| measured.min(taken))
    }

    /// Starts with the first sample of a sender.
    const fn new(now: Instant, stamp: Stamp) -> Self {
        Self {
            reference: (stamp, now),
            newest: stamp,
            taken: now,
            received: now,
            since: now,
        }
    }

    /// Handles a sample that arrives now. Returns the time when it was taken.
    fn handle_sample(&mut self, now: Instant, stamp: Stamp) -> Instant {
        if stamp == self.newest {
            return self.taken;
        }
        // The sender's clock was set back or its month is over, so its stamps have a new reference.
        if stamp < self.newest {
            *self = Self::new(now, stamp);
            return now;
        }
        let (first, at) = self.reference;
        // Without this, a slower sender clock would make all samples look old after some hours.
        let drift = now.saturating_duration_since(self.received) / Self::DRIFT;
        let at = at + drift;
        let taken = at.checked_add(stamp.since(first)).unwrap_or(now);
        (self.newest, self.received) = (stamp, now);
        if taken >= now {
            (self.reference, self.taken) = ((stamp, now), now);
        } else {
            (self.reference, self.taken) = ((first, at), taken);
        }
        self.taken
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// A clock that has received samples at 10 Hz without delay, `tenths` in total.
    fn running(start: Instant, tenths: u64) -> SampleClock {
        let mut clock = SampleClock::new(start, Stamp(0));
        for tenth in 1..=tenths {
            let now = start + ms(100 * tenth);
            assert_eq!(clock.handle_sample(now, Stamp(100 * tenth)), now);
        }
        clock
    }

    #[test]
    fn a_sample_that_is_reported_again_gets_older() {
        let start = Instant::now();
        let mut clock = running(start, 10);
        let taken = start + ms(1000);
        for later in [1100, 1500, 9000] {
            assert_eq!(clock.handle_sample(start + ms(later), Stamp(1000)), taken);
        }
    }

    #[test]
    fn samples_that_are_late_are_old_by_their_delay() {
        let start = Instant::now();
        let mut clock = running(start, 10);
        let taken = clock.handle_sample(start + ms(3100), Stamp(1100));
        let age = (start + ms(3100)).duration_since(taken);
        assert!((ms(1990)..=ms(2000)).contains(&age), "{age:?}");
        let taken = clock.handle_sample(start + ms(3200), Stamp(3200));
        assert_eq!(taken, start + ms(3200), "without delay again");
    }

    #[test]
    fn a_clock_of_the_sender_that_is_set_makes_no_sample_old() {
        let start = Instant::now();
        for step in [-500_i64, -3_600_000, 3_600_000] {
            let mut clock = SampleClock::new(start, Stamp(10_000_000));
            let stamp = Stamp(10_000_100_u64.saturating_add_signed(step));
            assert_eq!(clock.handle_sample(start + ms(100), stamp), start + ms(100));
            let next = Stamp(stamp.0 + 100);
            let taken = clock.handle_sample(start + ms(200), next);
            assert_eq!(taken, start + ms(200), "{step}");
        }
    }

    #[test]
    fn a_clock_of_the_sender_that_is_slow_makes_no_sample_old() {
        let start = Instant::now();
        let mut clock = SampleClock::new(start, Stamp(0));
        // One day at 1 Hz with a clock that loses 0.5 ms per second.
        for second in 1..86_400 {
            let now = start + ms(1000 * second);
            let taken = clock.handle_sample(now, Stamp(1000 * second - second / 2));
            assert!(now - taken < ms(2), "after {second} s: {:?}", now - taken);
        }
    }

    /// Reports of samples from 10 s after midnight on, with the age that the last measurement of the sender's clock
    /// gives them.
    struct Delayed {
        start: Instant,
        clock: Option<SampleClock>,
        measured_at: Instant,
        /// How far the sender's clock was ahead then, in milliseconds.
        measured: i64,
    }

    impl Delayed {
        fn new(start: Instant) -> Self {
            Self {
                start,
                clock: None,
                measured_at: start,
                measured: 0,
            }
        }

        /// The age of a sample that arrives `after` the start with a delay, from a sender whose clock is `ahead`. All in
        /// milliseconds.
        fn age(&mut self, after: u64, ahead: i64, delay: u64) -> Duration {
            let now = self.start + ms(after);
            let stamp = (10_000 + after - delay).saturating_add_signed(ahead);
            let (seconds, milliseconds) = (stamp / 1000 % 60, stamp % 1000);
            let stamp = TimeStamp::default()
                .with_minutes((stamp / 60_000) as u8)
                .unwrap();
            let stamp = stamp.with_seconds(seconds as u8).unwrap();
            let stamp = stamp.with_milliseconds(milliseconds as u16).unwrap();
            let mut sampled = Sampled::new(Some(stamp));
            sampled.measure(|_| {
                Some(Age {
                    seconds: (delay as f64 + (self.measured - ahead) as f64) / 1e3 + 0.01,
                    uncertainty: 0.01,
                    measured_at: self.measured_at,
                })
            });
            now - SampleClock::sampled_at(&mut self.clock, now, sampled)
        }
    }

    #[test]
    fn a_delay_that_all_samples_have_shows_once_the_clock_is_measured() {
        let start = Instant::now();
        let mut reports = Delayed::new(start);
        assert_eq!(
            reports.age(3000, 0, 2000),
            ms(0),
            "not measured since it began"
        );
        reports.measured_at = start + ms(3500);
        for after in [4000, 5000, 9000] {
            let age = reports.age(after, 0, 2000);
            assert!((ms(1999)..=ms(2001)).contains(&age), "{age:?}");
        }
    }

    #[test]
    fn a_clock_that_is_set_back_counts_again_once_it_is_measured() {
        let start = Instant::now();
        let mut reports = Delayed::new(start);
        reports.age(2000, 0, 2000);
        reports.measured_at = start + ms(2100);
        assert!(reports.age(6000, 0, 2000) > ms(1999));
        // The sender's clock is now 5 s behind, and the measurement does not know it yet.
        assert_eq!(reports.age(6100, -5000, 2000), ms(0));
        assert_eq!(reports.age(6200, -5000, 2000), ms(0));
        (reports.measured_at, reports.measured) = (start + ms(6250), -5000);
        let age = reports.age(6300, -5000, 2000);
        assert!((ms(1999)..=ms(2001)).contains(&age), "{age:?}");
    }

    #[test]
    fn a_stamp_that_is_no_time_is_none() {
        assert!(Stamp::read(TimeStamp::default()).is_some());
        let wrong = TimeStamp::default().with_hour(31);
        assert_eq!(wrong.ok().and_then(Stamp::read), None);
    }
}
