//! The age of a sensor's last sample, from the time stamps of its reports instead of their arrival.
//!
//! Two sources are combined, because each is blind where the other sees:
//!
//! * **Comparison of the reports with each other.** A report is as late as its arrival is later,
//!   relative to its stamp, than that of the promptest report so far. This needs no peer that
//!   answers and notices a frozen sensor, a queue and a growing delay at once. It sees no delay that
//!   all reports have, and takes a clock that is slewed for a delay.
//! * **The measured offset of the sender's clock** ([`ClockEstimator`](super::ClockEstimator)), for a
//!   sender that offers the Time service. It bounds the age on both sides, whatever the clocks do,
//!   and corrects the comparison.
//!
//! A step of the sender's clock costs one report, which is ignored. Until the offset is measured
//! again, only the comparison counts.

use std::time::{Duration, Instant};

use super::clock_offset::{Age, MOST_SLEW};
use super::time::{DAY, milliseconds_of_day};
use crate::messages::core::report_time::TimeStamp;

/// What is known of the time of a sample when its report arrives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleStamp {
    /// Time of the sample by the sender's clock, from any origin.
    time: Duration,
    measured: Option<Age>,
}

impl SampleStamp {
    /// The time of a sample by the sender's clock. `measured` is its age by the measured offset of
    /// that clock, if there is one; see [`PeerClocks::age`](crate::component::PeerClocks::age).
    #[must_use]
    pub const fn new(time: Duration, measured: Option<Age>) -> Self {
        Self { time, measured }
    }

    /// The time stamp of a report, with the age that the measured offset of the sender's clock gives
    /// it. `None` if it is no valid time, and for stamp 0, which sensors without a clock send.
    #[must_use]
    pub fn of_report(stamp: TimeStamp, measured: Option<Age>) -> Option<Self> {
        let of_day = milliseconds_of_day(stamp)?;
        let in_month = i64::from(stamp.day()) * DAY + of_day;
        let milliseconds = u64::try_from(in_month).ok().filter(|it| *it != 0)?;
        Some(Self::new(Duration::from_millis(milliseconds), measured))
    }
}

impl From<Duration> for SampleStamp {
    /// A stamp of a clock whose offset nobody measures, such as a counter of the same board.
    fn from(time: Duration) -> Self {
        Self::new(time, None)
    }
}

/// Estimates the age of samples that carry a time stamp of the sender's own clock.
#[derive(Debug, Clone, Default)]
pub struct SampleAge {
    last: Option<Arrival>,
    /// The promptest report, moved along with the drift of the clocks.
    promptest: Option<Arrival>,
    /// Origin of the arrival times.
    epoch: Option<Instant>,
    /// When the sender's clock was last seen to be set. Offsets measured before do not hold.
    set_at: Option<Instant>,
    /// Time of the last valid sample, by the local clock.
    sampled_at: Option<Instant>,
}

/// Arrival of a report.
#[derive(Debug, Clone, Copy)]
struct Arrival {
    at: Instant,
    stamp: Duration,
    /// Arrival time minus stamp, in seconds.
    offset: f64,
}

impl SampleAge {
    /// A report that is this many seconds prompter than the promptest follows a step of the
    /// sender's clock, or the reports before it were late and it may be late as well.
    const CATCHING_UP: f64 = 0.02;
    /// Drift of clocks whose offset is not measured, in seconds per second. The promptest offset is
    /// relaxed at this rate. A sender without the Time service whose clock is slewed faster looks
    /// late, which fails safe.
    const DRIFT: f64 = 0.0005;

    /// Handles a report received at `now`. Returns the time of its sample by the local clock; `None`
    /// if the report is ignored, because it repeats a sample or follows a step of the clock. Without
    /// a stamp, the sample is as old as the message.
    pub fn handle(&mut self, now: Instant, stamp: Option<SampleStamp>) -> Option<Instant> {
        let Some(stamp) = stamp else {
            *self = Self {
                sampled_at: Some(now),
                ..Self::default()
            };
            return self.sampled_at;
        };
        let arrival = self.arrival(now, stamp.time);
        let before = self.last.replace(arrival);
        if before.is_some_and(|before| before.stamp == arrival.stamp) {
            return None;
        }
        let Some(lag) = self.lag(before, arrival) else {
            (self.promptest, self.set_at) = (Some(arrival), Some(now));
            return None;
        };
        let lag = match self.bounds(now, stamp.measured) {
            Some((least, most)) => self.correct(arrival, lag, (least, most)),
            None => lag,
        };
        self.sampled_at = now.checked_sub(Duration::try_from_secs_f64(lag).ok()?);
        self.sampled_at
    }

    /// Discards all state, because the sensor has lost its measurement or was replaced.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// The time of the last valid sample, by the local clock.
    #[must_use]
    pub const fn sampled_at(&self) -> Option<Instant> {
        self.sampled_at
    }

    /// The age of the last sample; `None` without a sample.
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        Some(now.saturating_duration_since(self.sampled_at?))
    }

    fn arrival(&mut self, now: Instant, stamp: Duration) -> Arrival {
        let epoch = *self.epoch.get_or_insert(now);
        let received = now.saturating_duration_since(epoch).as_secs_f64();
        Arrival {
            at: now,
            stamp,
            offset: received - stamp.as_secs_f64(),
        }
    }

    /// How many seconds a report is later than the promptest one; `None` if the two cannot be
    /// compared, because the clock was set in between.
    fn lag(&mut self, before: Option<Arrival>, arrival: Arrival) -> Option<f64> {
        let before = before.filter(|before| arrival.stamp > before.stamp)?;
        let promptest = self.promptest?;
        let since = |at| arrival.at.saturating_duration_since(at).as_secs_f64();
        let relaxed = promptest.offset + Self::DRIFT * since(promptest.at);
        // A clock that is slewed forward makes each report prompter than the one before.
        let slewed = MOST_SLEW * since(before.at);
        if arrival.offset <= relaxed - Self::CATCHING_UP - slewed {
            return None;
        }
        if arrival.offset <= relaxed {
            self.promptest = Some(arrival);
        }
        Some((arrival.offset - relaxed).max(0.0))
    }

    /// What the age is at least and at most, in seconds, by an offset that was measured since the
    /// clock was set.
    fn bounds(&self, now: Instant, measured: Option<Age>) -> Option<(f64, f64)> {
        let holds = |age: &Age| self.set_at.is_none_or(|set_at| age.measured_at > set_at);
        let age = measured.filter(holds)?;
        // The clock may be slewed in any direction since then.
        let elapsed = now.saturating_duration_since(age.measured_at);
        let margin = age.uncertainty + MOST_SLEW * elapsed.as_secs_f64();
        Some((
            (age.seconds - margin).max(0.0),
            (age.seconds + margin).max(0.0),
        ))
    }

    /// Corrects a lag by the bounds of the age.
    fn correct(&mut self, arrival: Arrival, lag: f64, (least, most): (f64, f64)) -> f64 {
        if lag > most {
            // The clocks have come apart by the excess; the reports have not become later.
            self.promptest = Some(Arrival {
                offset: arrival.offset - most,
                ..arrival
            });
        }
        lag.clamp(least, most)
    }
}

#[cfg(test)]
mod tests;
