//! Offset and drift of another component's clock, measured over the Time service: Query Time
//! (2011h) and Report Time (4011h).
//!
//! The peer reads its clock between the transmission of the query and the arrival of the report.
//! Each exchange therefore gives a lower and an upper bound of the offset, whatever the delays of
//! the two directions are. The estimate is the middle of what all bounds since the last step of a
//! clock have in common, and its uncertainty is half of that width. Assuming equal delays, as NTP
//! does, gives the same middle for a single exchange.
//!
//! Bounds that have nothing in common with the earlier ones prove that a clock was slewed or stepped;
//! the estimate then starts again.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::time::{DAY, milliseconds_of_day, nearest_day, reported_day};
use crate::messages::core::ReportTime;
use crate::messages::core::report_time::TimeStamp;

/// The largest slew of a clock, in seconds per second: the default limit of chrony (`maxslewrate`,
/// 83 333 parts per million). ntpd and the kernel's `adjtime` stay at 500 parts per million.
pub const MOST_SLEW: f64 = 0.083_334;

/// Nanoseconds in a millisecond, the resolution of JAUS time stamps.
const MILLISECOND: i128 = 1_000_000;

/// Result of an exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exchange {
    /// It fits the earlier ones.
    Accepted,
    /// It contradicts the earlier ones, and the difference since the last one is no more than
    /// [`MOST_SLEW`] explains.
    Slewed,
    /// It contradicts the earlier ones: the peer's clock or the own one was stepped.
    Stepped,
    /// The report has no valid time.
    Ignored,
}

/// The drift of a clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Seconds that the peer's clock gains on the own one per second; negative if it loses.
    pub ratio: f64,
    /// The true value differs by this at most.
    pub uncertainty: f64,
}

/// The offset of a clock, at the time of the latest exchange.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockOffset {
    /// Seconds that the peer's clock is ahead of the own one; negative if it is behind.
    pub seconds: f64,
    /// The true value differs by this many seconds at most.
    pub uncertainty: f64,
    /// The drift, once it is known to 100 parts per million.
    pub drift: Option<Drift>,
    /// When the latest report arrived.
    pub measured_at: Instant,
    /// Number of steps of one of the clocks since the first exchange.
    pub steps: u64,
}

/// The age of a report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Age {
    /// Seconds since the time stamp of the report; negative only within the uncertainty.
    pub seconds: f64,
    /// The true value differs by this many seconds at most.
    pub uncertainty: f64,
    /// When the offset of the clock was last measured.
    pub measured_at: Instant,
}

impl Age {
    /// What the age is at least.
    #[must_use]
    pub fn at_least(&self) -> Duration {
        Duration::try_from_secs_f64(self.seconds - self.uncertainty).unwrap_or_default()
    }
}

/// Bounds of the offset in seconds.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    at: Instant,
    least: f64,
    most: f64,
}

/// Measures the clock of one peer. Its memory is bounded.
#[derive(Clone, Debug, Default)]
pub struct ClockEstimator {
    /// What all exchanges since the last step have in common.
    common: Option<Bounds>,
    /// Own time of day at the latest exchange, in nanoseconds since the beginning of 1970.
    own: i128,
    /// Bounds of single exchanges, oldest first, for the drift.
    history: VecDeque<Bounds>,
    steps: u64,
}

impl ClockEstimator {
    /// Largest drift between two clocks for long: two crystals, or one that NTP adjusts.
    const LARGEST_DRIFT: f64 = 5e-4;
    /// The drift counts as known at this uncertainty.
    const KNOWN_DRIFT: f64 = 1e-4;
    /// Exchanges that are kept for the drift.
    const KEPT: usize = 16;
    /// Least time between two kept exchanges. The oldest is then at most 16 times as old.
    const SPACING: Duration = Duration::from_secs(30);

    /// Handles a report. `sent` and `received` are when the query was sent and when the report
    /// arrived; `time_of_day` is the own time at `received`, since the beginning of 1970 (UTC).
    ///
    /// If the query was sent several times, `sent` is its first transmission.
    pub fn handle_report(
        &mut self,
        sent: Instant,
        received: Instant,
        time_of_day: Duration,
        report: &ReportTime,
    ) -> Exchange {
        let Some(peer) = reported_milliseconds(report, time_of_day) else {
            return Exchange::Ignored;
        };
        let own = nanoseconds(time_of_day);
        let peer = i128::from(peer) * MILLISECOND;
        let round_trip = nanoseconds(received.saturating_duration_since(sent));
        let bounds = Bounds {
            at: received,
            least: seconds(peer - own),
            most: seconds(peer + MILLISECOND - own + round_trip),
        };
        self.own = own;
        self.handle_bounds(bounds)
    }

    fn handle_bounds(&mut self, bounds: Bounds) -> Exchange {
        let Some(common) = self.common else {
            self.begin(bounds);
            return Exchange::Accepted;
        };
        let elapsed = bounds.at.saturating_duration_since(common.at);
        let drifted = Self::LARGEST_DRIFT * elapsed.as_secs_f64();
        let least = bounds.least.max(common.least - drifted);
        let most = bounds.most.min(common.most + drifted);
        if least > most {
            return self.handle_contradiction(bounds);
        }
        let at = bounds.at;
        self.common = Some(Bounds { at, least, most });
        self.keep(bounds);
        Exchange::Accepted
    }

    /// Starts again after a change that no drift explains.
    fn handle_contradiction(&mut self, bounds: Bounds) -> Exchange {
        let is_slew = self.history.back().is_some_and(|last| {
            let elapsed = bounds.at.saturating_duration_since(last.at);
            let slewed = MOST_SLEW * elapsed.as_secs_f64();
            bounds.least <= last.most + slewed && bounds.most >= last.least - slewed
        });
        self.begin(bounds);
        if is_slew {
            return Exchange::Slewed;
        }
        self.steps += 1;
        Exchange::Stepped
    }

    fn begin(&mut self, bounds: Bounds) {
        self.common = Some(bounds);
        self.history.clear();
        self.history.push_back(bounds);
    }

    /// Keeps an exchange for the drift. The newest one is always kept.
    fn keep(&mut self, bounds: Bounds) {
        let before_last = self.history.iter().rev().nth(1);
        let is_soon =
            |before: &Bounds| bounds.at.saturating_duration_since(before.at) < Self::SPACING;
        if before_last.is_some_and(is_soon) {
            self.history.pop_back();
        }
        self.history.push_back(bounds);
        if self.history.len() > Self::KEPT {
            self.history.pop_front();
        }
    }

    /// The offset; `None` before the first exchange.
    #[must_use]
    pub fn offset(&self) -> Option<ClockOffset> {
        let common = self.common?;
        Some(ClockOffset {
            seconds: f64::midpoint(common.least, common.most),
            uncertainty: (common.most - common.least) / 2.0,
            drift: self.drift(),
            measured_at: common.at,
            steps: self.steps,
        })
    }

    /// The drifts that all pairs of kept exchanges allow. `None` if that is too little to know, or
    /// if the drift itself changes.
    fn drift(&self) -> Option<Drift> {
        let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
        for (index, later) in self.history.iter().enumerate() {
            for earlier in self.history.iter().take(index) {
                let elapsed = later.at.saturating_duration_since(earlier.at).as_secs_f64();
                if elapsed > 0.0 {
                    least = least.max((later.least - earlier.most) / elapsed);
                    most = most.min((later.most - earlier.least) / elapsed);
                }
            }
        }
        let uncertainty = (most - least) / 2.0;
        (0.0..=Self::KNOWN_DRIFT)
            .contains(&uncertainty)
            .then(|| Drift {
                ratio: f64::midpoint(least, most),
                uncertainty,
            })
    }

    /// The age at `now` of a report with this time stamp of the peer. `None` before the first
    /// exchange, or if the stamp is no valid time.
    #[must_use]
    pub fn age(&self, stamp: TimeStamp, now: Instant) -> Option<Age> {
        let offset = self.offset()?;
        // The own time of day may have been set since the exchange; the time that has passed has not.
        let elapsed = nanoseconds(now.saturating_duration_since(offset.measured_at));
        let peer_now = self.own + elapsed + (offset.seconds * 1e9).round() as i128;
        let near = i64::try_from(peer_now / MILLISECOND).ok()?;
        let of_day = milliseconds_of_day(stamp)?;
        let day = nearest_day(near, of_day, stamp.day());
        let sampled = i128::from(day * DAY + of_day) * MILLISECOND;
        // The stamp is cut off at the millisecond.
        Some(Age {
            seconds: seconds(peer_now - sampled - MILLISECOND / 2),
            uncertainty: offset.uncertainty + seconds(MILLISECOND / 2),
            measured_at: offset.measured_at,
        })
    }
}

/// The time in a report in milliseconds since the beginning of 1970. Without a date, the day is the
/// nearest one to the own time.
fn reported_milliseconds(report: &ReportTime, time_of_day: Duration) -> Option<i64> {
    let stamp = report.time_stamp?;
    let of_day = milliseconds_of_day(stamp)?;
    let day = match report.date_stamp {
        Some(date) => reported_day(date, stamp)?,
        None => {
            let own = i64::try_from(time_of_day.as_millis()).ok()?;
            nearest_day(own, of_day, stamp.day())
        }
    };
    Some(day * DAY + of_day)
}

fn nanoseconds(duration: Duration) -> i128 {
    // A duration has at most 95 bits.
    i128::try_from(duration.as_nanos()).unwrap_or(i128::MAX)
}

fn seconds(nanoseconds: i128) -> f64 {
    nanoseconds as f64 / 1e9
}

#[cfg(test)]
mod tests;
