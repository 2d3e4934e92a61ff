//! The measured rate of reports.

use std::collections::VecDeque;
use std::time::Duration;

/// Arrivals of the last reports.
#[derive(Debug, Default)]
pub(super) struct Rate {
    arrivals: VecDeque<Duration>,
}

impl Rate {
    /// Reports that the rate is averaged over.
    const WINDOW: usize = 20;

    /// Counts a report that arrived at this time since the start.
    pub(super) fn count(&mut self, now: Duration) {
        if self.arrivals.len() == Self::WINDOW {
            self.arrivals.pop_front();
        }
        self.arrivals.push_back(now);
    }

    /// Forgets the arrivals before an outage.
    pub(super) fn reset(&mut self) {
        self.arrivals.clear();
    }

    /// In hertz; `None` before the second report.
    pub(super) fn hz(&self) -> Option<f64> {
        let first = self.arrivals.front()?;
        let last = self.arrivals.back()?;
        let intervals = self.arrivals.len() - 1;
        let time = last.saturating_sub(*first).as_secs_f64();
        (intervals > 0 && time > 0.0).then(|| intervals as f64 / time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_that_of_the_last_reports() {
        let mut rate = Rate::default();
        assert_eq!(rate.hz(), None);
        rate.count(Duration::ZERO);
        assert_eq!(rate.hz(), None, "one report has no rate");
        for step in 1..=50 {
            rate.count(Duration::from_millis(1000 + 100 * step));
        }
        let hz = rate.hz().unwrap();
        assert!((hz - 10.0).abs() < 1e-9, "{hz}");
        rate.reset();
        assert_eq!(rate.hz(), None);
    }
}
