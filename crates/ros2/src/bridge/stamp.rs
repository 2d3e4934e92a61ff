//! When a sample was taken: from the time stamp of the report, which has neither month nor year.

use std::time::Duration;

use jaus::codec::Date;

/// A time stamp of JAUS: day of the month and time of day (UTC), in the bit field of the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp(pub u32);

/// A report whose stamp differs more than this from its arrival is stamped with its arrival: the
/// clock of the vehicle is not set, and ROS would reject or misplace the sample.
pub const LARGEST_DIFFERENCE: Duration = Duration::from_secs(10);

/// The seconds of a day.
const DAY: u64 = 86_400;

impl Stamp {
    /// The time that the stamp means, as time since the beginning of 1970 (UTC), for a report that
    /// arrived at `received`. `None` if the stamp is not a time or differs more than
    /// [`LARGEST_DIFFERENCE`] from the arrival.
    #[must_use]
    pub fn near(self, received: Duration) -> Option<Duration> {
        let (day, of_day) = self.read()?;
        let today = received.as_secs() / DAY;
        // The sample may be of yesterday or, if the clocks differ, of tomorrow.
        let days = [Some(today), today.checked_sub(1), Some(today + 1)];
        let mut near = days.into_iter().flatten();
        let date = near.find(|&days| Date::after_1970(days).day == day)?;
        let time = Duration::from_secs(date * DAY) + of_day;
        (time.abs_diff(received) <= LARGEST_DIFFERENCE).then_some(time)
    }

    /// The day of the month, and the time since midnight; `None` if there is no such time.
    fn read(self) -> Option<(u64, Duration)> {
        let bits = |shift: u32, mask: u32| u64::from(self.0 >> shift & mask);
        let (day, hour) = (bits(27, 0x1F), bits(22, 0x1F));
        let (minutes, seconds) = (bits(16, 0x3F), bits(10, 0x3F));
        let milliseconds = bits(0, 0x3FF);
        let is_time = hour < 24 && minutes < 60 && seconds < 60 && milliseconds < 1000;
        let of_day = Duration::from_secs((hour * 60 + minutes) * 60 + seconds);
        is_time.then_some((day, of_day + Duration::from_millis(milliseconds)))
    }
}

/// The stamp of a sample for ROS, since the beginning of 1970: that of the report if it has a usable
/// one, else its arrival.
#[must_use]
pub fn sampled_at(stamp: Option<Stamp>, received: Duration) -> Duration {
    let taken = stamp.and_then(|stamp| stamp.near(received));
    taken.unwrap_or(received)
}

#[cfg(test)]
mod tests {
    use super::*;
    use jaus::codec::time_stamp;

    /// 2024-03-01 00:00:01 UTC.
    const MARCH: Duration = Duration::from_secs(1_709_251_201);

    #[test]
    fn a_stamp_of_last_month_just_before_midnight_is_two_seconds_old() {
        // 29 February 23:59:59.250.
        let taken = MARCH - Duration::from_millis(1750);
        let stamp = Stamp(time_stamp(taken));
        assert_eq!(stamp.near(MARCH), Some(taken));
    }

    #[test]
    fn a_vehicle_whose_clock_is_ahead_over_midnight_is_understood() {
        let received = MARCH - Duration::from_secs(2);
        let taken = MARCH + Duration::from_secs(3);
        assert_eq!(Stamp(time_stamp(taken)).near(received), Some(taken));
    }

    #[test]
    fn a_clock_that_is_not_set_and_a_stamp_that_is_no_time_give_the_arrival() {
        let late = MARCH - LARGEST_DIFFERENCE - Duration::from_millis(1);
        let no_time = 24 << 22 | 1 << 27;
        for stamp in [
            time_stamp(late),
            time_stamp(Duration::ZERO) + (5 << 27),
            no_time,
            0,
        ] {
            assert_eq!(sampled_at(Some(Stamp(stamp)), MARCH), MARCH, "{stamp:08X}");
        }
        assert_eq!(sampled_at(None, MARCH), MARCH);
    }
}
