//! The link between the station and a vehicle: round trips of small queries, and how many of them
//! were lost.

use std::collections::VecDeque;
use std::time::Duration;

/// The results of the last queries.
#[derive(Debug, Default)]
pub(super) struct VehicleLink {
    /// `None` for a query without an answer.
    answers: VecDeque<Option<Duration>>,
}

/// What the station has measured of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct VehicleLinkQuality {
    /// Median of the round trips in milliseconds.
    pub(super) round_trip_ms: Option<u64>,
    /// Share of the queries or answers that were lost.
    pub(super) loss_percent: Option<u8>,
}

impl VehicleLink {
    /// Number of queries that count.
    const MEMORY: usize = 20;

    /// Handles the round trip of a query, or that it has none.
    pub(super) fn handle_answer(&mut self, round_trip: Option<Duration>) {
        self.answers.push_back(round_trip);
        if self.answers.len() > Self::MEMORY {
            self.answers.pop_front();
        }
    }

    pub(super) fn quality(&self) -> VehicleLinkQuality {
        let mut round_trips: Vec<Duration> = self.answers.iter().copied().flatten().collect();
        round_trips.sort_unstable();
        let median = round_trips.get(round_trips.len() / 2);
        let lost = self.answers.len() - round_trips.len();
        let share = (lost * 100).checked_div(self.answers.len());
        VehicleLinkQuality {
            round_trip_ms: median.map(|it| u64::try_from(it.as_millis()).unwrap_or(u64::MAX)),
            loss_percent: share.map(|it| u8::try_from(it).unwrap_or(100)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quality_is_that_of_the_last_20_queries() {
        let mut link = VehicleLink::default();
        assert_eq!(link.quality(), VehicleLinkQuality::default());
        for _ in 0..100 {
            link.handle_answer(None);
        }
        assert_eq!(link.quality().loss_percent, Some(100));
        for n in 0..20 {
            link.handle_answer((n % 4 != 0).then(|| Duration::from_millis(30 + n)));
        }
        let quality = link.quality();
        assert_eq!(quality.loss_percent, Some(25));
        assert_eq!(quality.round_trip_ms, Some(40));
    }
}
