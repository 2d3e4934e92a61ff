//! Time stamps of reports: sample times in the component's time of day.

use std::time::{Duration, Instant};

use jaus::messages::mobility::report_local_pose::TimeStamp;
use jaus::service::Date;
use jaus::service::TimeOfDay;

/// Stamps samples. A sample keeps its stamp until the time is set.
#[derive(Debug)]
pub(super) struct SampleClock {
    time: TimeOfDay,
    /// The last sample, the time correction at that moment, and its stamp.
    last: Option<(Instant, i64, Duration)>,
}

impl SampleClock {
    pub(super) const fn new(time: TimeOfDay) -> Self {
        Self { time, last: None }
    }

    /// Time of a sample since the start of 1970. The current time is `now`.
    pub(super) fn since_1970(&mut self, now: Instant, sampled_at: Option<Instant>) -> Duration {
        let Some(sampled_at) = sampled_at else {
            return self.time.now();
        };
        let ahead = self.time.ahead();
        if let Some((at, corrected, stamp)) = self.last
            && (at, corrected) == (sampled_at, ahead)
        {
            return stamp;
        }
        let age = now.saturating_duration_since(sampled_at);
        let stamp = self.time.now().saturating_sub(age);
        self.last = Some((sampled_at, ahead, stamp));
        stamp
    }
}

/// The time stamp of version 1.0 reports: day of the month and time of day.
pub(super) fn stamp(since_1970: Duration) -> Option<TimeStamp> {
    let seconds = since_1970.as_secs();
    let part = |value: u64| u8::try_from(value).ok();
    let stamp = TimeStamp::default();
    let stamp = stamp
        .with_day(part(Date::after_1970(seconds / 86_400).day)?)
        .ok()?;
    let stamp = stamp.with_hour(part(seconds / 3600 % 24)?).ok()?;
    let stamp = stamp.with_minutes(part(seconds / 60 % 60)?).ok()?;
    let stamp = stamp.with_seconds(part(seconds % 60)?).ok()?;
    let milliseconds = u16::try_from(since_1970.subsec_millis()).ok()?;
    stamp.with_milliseconds(milliseconds).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_tells_day_and_time() {
        // 2015-06-08 01:02:03.004 UTC.
        let stamp = stamp(Duration::from_millis(1_433_725_323_004)).unwrap();
        assert_eq!((stamp.day(), stamp.hour(), stamp.minutes()), (8, 1, 2));
        assert_eq!((stamp.seconds(), stamp.milliseconds()), (3, 4));
    }
}
