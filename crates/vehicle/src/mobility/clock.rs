//! Time stamps of reports: sample times in the component's time of day.

use std::time::{Duration, Instant};

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
