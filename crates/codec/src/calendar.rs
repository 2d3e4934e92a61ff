//! Converts between calendar dates (in messages) and day counts (in clocks).

use core::time::Duration;

/// A day of the Gregorian calendar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Date {
    /// 0 to 9999.
    pub year: u64,
    /// 1 to 12.
    pub month: u64,
    /// 1 to 31.
    pub day: u64,
}

/// Days from 1 March of year 0 to 1 January 1970.
const DAYS_BEFORE_1970: u64 = 719_468;
/// Days in 400 years, after which the calendar repeats.
const DAYS_OF_ERA: u64 = 146_097;

impl Date {
    /// The date `days` days after 1 January 1970.
    ///
    /// Years are counted from March, so that the leap day is the last day of a year.
    #[must_use]
    pub const fn after_1970(days: u64) -> Self {
        let days = days + DAYS_BEFORE_1970;
        let of_era = days % DAYS_OF_ERA;
        let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
        let of_year = of_era - (365 * year + year / 4 - year / 100);
        let month = (5 * of_year + 2) / 153;
        let day = of_year - (153 * month + 2) / 5 + 1;
        let next_year = month >= 10;
        Self {
            year: 400 * (days / DAYS_OF_ERA) + year + next_year as u64,
            month: if next_year { month - 9 } else { month + 3 },
            day,
        }
    }

    /// Days from 1 January 1970 to this date. `None` if the date does not exist or is earlier.
    #[must_use]
    pub fn days_after_1970(self) -> Option<u64> {
        if !(1..=12).contains(&self.month) || !(1..=31).contains(&self.day) || self.year > 9999 {
            return None;
        }
        let (year, month) = if self.month > 2 {
            (self.year, self.month - 3)
        } else {
            (self.year.checked_sub(1)?, self.month + 9)
        };
        let of_year = (153 * month + 2) / 5 + self.day - 1;
        let days = 365 * year + year / 4 - year / 100 + year / 400 + of_year;
        let days = days.checked_sub(DAYS_BEFORE_1970)?;
        // 30 February would become 1 or 2 March.
        (Self::after_1970(days) == self).then_some(days)
    }
}

/// The standard's time stamp: day of the month and time of day, in the bit field of that layout.
/// The time counts from the beginning of 1970 (UTC).
#[must_use]
pub const fn time_stamp(since_1970: Duration) -> u32 {
    let seconds = since_1970.as_secs();
    let day = Date::after_1970(seconds / 86_400).day as u32;
    let hour = (seconds / 3600 % 24) as u32;
    let minutes = (seconds / 60 % 60) as u32;
    let milliseconds = since_1970.subsec_millis();
    day << 27 | hour << 22 | minutes << 16 | ((seconds % 60) as u32) << 10 | milliseconds
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn date(year: u64, month: u64, day: u64) -> Date {
        Date { year, month, day }
    }

    #[test]
    fn days_and_dates_agree_around_leap_days_and_new_years() {
        for (days, expected) in [
            (0, date(1970, 1, 1)),
            (58, date(1970, 2, 28)),
            (59, date(1970, 3, 1)),
            (364, date(1970, 12, 31)),
            (365, date(1971, 1, 1)),
            (10_957, date(2000, 1, 1)),
            (11_016, date(2000, 2, 29)),
            (11_017, date(2000, 3, 1)),
            (20_513, date(2026, 3, 1)),
        ] {
            assert_eq!(Date::after_1970(days), expected);
            assert_eq!(expected.days_after_1970(), Some(days));
        }
    }

    #[test]
    fn a_time_stamp_has_the_day_of_the_month_and_the_time_of_day() {
        // 2015-06-08 01:02:03.004 UTC.
        let stamp = time_stamp(Duration::from_millis(1_433_725_323_004));
        assert_eq!((stamp >> 27, stamp >> 22 & 0x1F), (8, 1));
        assert_eq!((stamp >> 16 & 0x3F, stamp >> 10 & 0x3F), (2, 3));
        assert_eq!(stamp & 0x3FF, 4);
    }

    #[test]
    fn every_day_of_two_centuries_is_found_again() {
        for days in 0..73_049 {
            assert_eq!(Date::after_1970(days).days_after_1970(), Some(days));
        }
    }

    #[test]
    fn there_is_no_thirtieth_of_february() {
        for none in [
            date(2026, 2, 29),
            date(2024, 2, 30),
            date(2026, 13, 1),
            date(2026, 4, 31),
            date(2026, 0, 1),
            date(2026, 1, 0),
            date(1969, 12, 31),
        ] {
            assert_eq!(none.days_after_1970(), None, "{none:?}");
        }
    }
}
