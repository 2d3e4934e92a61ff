//! Age of samples from their own time stamps, with unsynchronised clocks.

use std::time::{Duration, Instant};

use jaus::messages::mobility::report_local_pose::TimeStamp;

/// Milliseconds since the start of the sender's month.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Stamp(u64);

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
}

impl Stamp {
    /// Reads a stamp; `None` if it is not a valid time.
    pub(super) fn read(stamp: TimeStamp) -> Option<Self> {
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

    /// Starts with the first sample of a sender.
    pub(super) const fn new(now: Instant, stamp: Stamp) -> Self {
        Self {
            reference: (stamp, now),
            newest: stamp,
            taken: now,
            received: now,
        }
    }

    /// Handles a sample that arrives now. Returns the time when it was taken.
    pub(super) fn handle_sample(&mut self, now: Instant, stamp: Stamp) -> Instant {
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

    #[test]
    fn a_stamp_that_is_no_time_is_none() {
        assert!(Stamp::read(TimeStamp::default()).is_some());
        let wrong = TimeStamp::default().with_hour(31);
        assert_eq!(wrong.ok().and_then(Stamp::read), None);
    }
}
