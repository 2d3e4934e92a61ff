//! Capture time stamps, with the precision of the capture.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

const NANOS_PER_SECOND: u32 = 1_000_000_000;
const SECONDS_PER_DAY: i64 = 86_400;

/// Time since 1970-01-01T00:00:00Z.
///
/// [`Display`](fmt::Display) writes RFC 3339 in UTC, with as many decimals as the capture has:
/// `2015-06-07T14:03:21.068150Z`.
///
/// ```
/// use jaus_view::Timestamp;
///
/// let time: Timestamp = "2015-06-07T14:03:21.068150Z".parse()?;
/// assert_eq!((time.seconds(), time.subsec_nanos()), (1_433_685_801, 68_150_000));
/// assert_eq!(time.to_string(), "2015-06-07T14:03:21.068150Z");
/// # Ok::<(), jaus_view::InvalidTime>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timestamp {
    seconds: i64,
    nanos: u32,
    decimals: u8,
}

impl Timestamp {
    /// Creates a time stamp from `seconds` and `nanos` since 1970. The first `decimals` (at most 9)
    /// of `nanos` are significant.
    ///
    /// Whole seconds in `nanos` carry over to `seconds`.
    pub fn new(seconds: i64, nanos: u32, decimals: u8) -> Self {
        Self {
            seconds: seconds.saturating_add(i64::from(nanos / NANOS_PER_SECOND)),
            nanos: nanos % NANOS_PER_SECOND,
            decimals: decimals.min(9),
        }
    }

    /// Creates a time stamp from the time since the beginning of 1970 (UTC); see [`new`](Self::new).
    pub fn since_1970(time: Duration, decimals: u8) -> Self {
        let seconds = i64::try_from(time.as_secs()).unwrap_or(i64::MAX);
        Self::new(seconds, time.subsec_nanos(), decimals)
    }

    /// Whole seconds since 1970.
    pub fn seconds(self) -> i64 {
        self.seconds
    }

    /// Nanoseconds beyond [`seconds`](Self::seconds).
    pub fn subsec_nanos(self) -> u32 {
        self.nanos
    }
}

impl fmt::Display for Timestamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = civil_date(self.seconds.div_euclid(SECONDS_PER_DAY));
        let second = self.seconds.rem_euclid(SECONDS_PER_DAY);
        write!(
            f,
            "{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}",
            second / 3600,
            second / 60 % 60,
            second % 60
        )?;
        if self.decimals > 0 {
            let width = usize::from(self.decimals);
            let digits = self.nanos / 10_u32.pow(u32::from(9 - self.decimals));
            write!(f, ".{digits:0width$}")?;
        }
        f.write_str("Z")
    }
}

/// Error: the text is not an RFC 3339 time in UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("write a time in UTC such as 2015-06-07T14:03:21.068150Z")]
pub struct InvalidTime;

impl FromStr for Timestamp {
    type Err = InvalidTime;

    fn from_str(text: &str) -> Result<Self, InvalidTime> {
        Self::parse(text).ok_or(InvalidTime)
    }
}

impl Timestamp {
    fn parse(text: &str) -> Option<Self> {
        let (date, time) = text.strip_suffix('Z')?.split_once('T')?;
        let (time, decimals) = time.split_once('.').unwrap_or((time, ""));
        let [year, month, day] = three(date, '-')?;
        let [hour, minute, second] = three(time, ':')?;
        let is_time = (0..24).contains(&hour) && (0..60).contains(&minute) && second <= 60;
        let is_date = (0..10_000).contains(&year) && (1..=12).contains(&month);
        if !is_time || !is_date || !(1..=31).contains(&day) || decimals.len() > 9 {
            return None;
        }
        let nanos = match decimals {
            "" => 0,
            digits => digits.parse::<u32>().ok()? * 10_u32.pow(9 - digits.len() as u32),
        };
        let seconds = days_since_1970(year, month, day) * SECONDS_PER_DAY
            + hour * 3600
            + minute * 60
            + second;
        Some(Self::new(seconds, nanos, decimals.len() as u8))
    }
}

/// Parses three numbers with a separator.
fn three(text: &str, between: char) -> Option<[i64; 3]> {
    let numbers: Vec<i64> = text
        .split(between)
        .map(|part| part.parse::<u16>().map(i64::from).ok())
        .collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// The inverse of [`civil_date`].
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let year = year - i64::from(month <= 2);
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    era * 146_097 + day_of_era - 719_468
}

/// Year, month and day of the proleptic Gregorian calendar, from days since 1970-01-01.
///
/// Counts in eras of 400 years that begin on 1 March, so that the leap day comes last.
fn civil_date(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    (era * 400 + year_of_era + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_written_with_the_decimals_that_are_known() {
        assert_eq!(Timestamp::new(0, 0, 0).to_string(), "1970-01-01T00:00:00Z");
        assert_eq!(
            Timestamp::new(1_433_685_801, 68_150_000, 6).to_string(),
            "2015-06-07T14:03:21.068150Z"
        );
        assert_eq!(
            Timestamp::new(951_782_400, 7, 9).to_string(),
            "2000-02-29T00:00:00.000000007Z"
        );
        assert_eq!(
            Timestamp::new(-1, 500_000_000, 3).to_string(),
            "1969-12-31T23:59:59.500Z"
        );
    }

    #[test]
    fn a_time_that_was_written_is_read() {
        for time in [
            Timestamp::new(0, 0, 0),
            Timestamp::new(1_433_685_801, 68_150_000, 6),
            Timestamp::new(951_782_400, 7, 9),
        ] {
            assert_eq!(time.to_string().parse(), Ok(time));
        }
        for text in [
            "",
            "Z",
            "2015-06-07",
            "2015-13-07T14:03:21Z",
            "2015-06-07T14:03Z",
        ] {
            assert_eq!(text.parse::<Timestamp>(), Err(InvalidTime), "{text}");
        }
    }

    #[test]
    fn every_day_of_four_centuries_follows_the_one_before() {
        let mut before = civil_date(-1);
        for day in 0..146_097 {
            let now = civil_date(day);
            assert!(
                now > before && (1..=31).contains(&now.2),
                "{before:?} {now:?}"
            );
            assert!(now.2 == before.2 + 1 || now.2 == 1);
            assert_eq!(days_since_1970(now.0, now.1, now.2), day);
            before = now;
        }
    }
}
