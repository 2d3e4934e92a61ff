//! The time of day, from a moment at which it was known.

use std::time::{Duration, Instant};

use crate::messages::mobility::report_local_pose::TimeStamp;

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
    let stamp = stamp.with_day(part(day_of_month(seconds / 86_400))?).ok()?;
    let stamp = stamp.with_hour(part(seconds / 3600 % 24)?).ok()?;
    let stamp = stamp.with_minutes(part(seconds / 60 % 60)?).ok()?;
    let stamp = stamp.with_seconds(part(seconds % 60)?).ok()?;
    let milliseconds = u16::try_from(since_1970.subsec_millis()).ok()?;
    stamp.with_milliseconds(milliseconds).ok()
}

/// The day of the month so many days after the first of January 1970.
///
/// Counted in years that begin in March, so that the leap day is the last one.
fn day_of_month(days: u64) -> u64 {
    let days = days + 719_468;
    let of_era = days % 146_097;
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    of_year - (153 * month + 2) / 5 + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_day_of_the_month_is_right_around_leap_days() {
        for (days, day) in [
            (0, 1),
            (31, 1),
            (58, 28),
            (59, 1),
            (11_016, 29),
            (11_017, 1),
            (20_513, 1),
        ] {
            assert_eq!(day_of_month(days), day, "{days}");
        }
    }

    #[test]
    fn a_stamp_tells_day_and_time() {
        // 2015-06-08 01:02:03.004 UTC.
        let stamp = stamp(Duration::from_millis(1_433_725_323_004)).unwrap();
        assert_eq!((stamp.day(), stamp.hour(), stamp.minutes()), (8, 1, 2));
        assert_eq!((stamp.seconds(), stamp.milliseconds()), (3, 4));
    }
}
