//! The time of day, from a moment at which it was known.

use std::time::{Duration, Instant};

use crate::messages::mobility::report_local_pose::TimeStamp;
use crate::service::calendar::Date;

/// Knows what time it was at some moment, and so what time it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    /// The moment.
    pub(super) at: Instant,
    /// The time then, since the beginning of 1970 (UTC).
    pub(super) since_1970: Duration,
}

impl Clock {
    /// The time since the beginning of 1970.
    pub(super) fn since_1970(&self, now: Instant) -> Duration {
        match now.checked_duration_since(self.at) {
            Some(later) => self.since_1970 + later,
            None => self.since_1970.saturating_sub(self.at - now),
        }
    }
}

/// The time as the reports of version 1.0 tell it: the day of the month, and the time of day.
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
