//! How long a destination takes to answer, and hence how long to wait before sending again
//! (after RFC 6298).

use std::time::Duration;

/// Before the first measurement: what Junior waits.
const UNMEASURED: Duration = Duration::from_millis(100);
/// Timers have a granularity of a millisecond, and a busy board answers some milliseconds late.
const LEAST: Duration = Duration::from_millis(10);
/// By so much do answers differ where nothing queues up.
const GRANULARITY: Duration = Duration::from_micros(500);
/// What is added to the smoothed time at the least.
const LEAST_VARIATION: Duration = Duration::from_millis(5);
/// Also with back-off no longer than this.
const MOST: Duration = Duration::from_secs(2);

/// The measured round trip to one destination.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RoundTrip {
    measured: Option<Measured>,
    /// How often the time to wait was doubled since the last measurement.
    doublings: u32,
}

#[derive(Clone, Copy, Debug)]
struct Measured {
    smoothed: Duration,
    variation: Duration,
    shortest: Duration,
}

impl RoundTrip {
    /// Takes a measurement of something that was sent once: after a repetition nobody knows which
    /// of the two was answered (Karn).
    pub(super) fn measure(&mut self, time: Duration) {
        self.doublings = 0;
        let Some(known) = &mut self.measured else {
            self.measured = Some(Measured {
                smoothed: time,
                variation: time / 2,
                shortest: time,
            });
            return;
        };
        known.variation = (known.variation * 3 + known.smoothed.abs_diff(time)) / 4;
        known.smoothed = (known.smoothed * 7 + time) / 8;
        known.shortest = known.shortest.min(time);
    }

    /// Nothing was answered in time.
    pub(super) fn back_off(&mut self) {
        self.doublings = (self.doublings + 1).min(8);
    }

    /// Something new is sent after a pause: what was not answered long ago says nothing.
    pub(super) fn restart(&mut self) {
        self.doublings = 0;
    }

    /// Whether answers take so much longer than the fastest one that packets must queue up somewhere.
    pub(super) fn has_grown(&self) -> bool {
        self.measured
            .is_none_or(|known| known.smoothed > known.shortest * 3 / 2 + GRANULARITY)
    }

    /// How long to wait for an answer before sending again.
    pub(super) fn timeout(&self) -> Duration {
        let once = self.measured.map_or(UNMEASURED, |known| {
            let variation = (known.variation * 4).max(LEAST_VARIATION);
            (known.smoothed + variation).max(LEAST)
        });
        (once * (1 << self.doublings)).min(MOST)
    }

    /// The smoothed round trip, if it was measured.
    pub(super) fn smoothed(&self) -> Option<Duration> {
        self.measured.map(|known| known.smoothed)
    }

    /// The shortest round trip ever measured.
    pub(super) fn shortest(&self) -> Option<Duration> {
        self.measured.map(|known| known.shortest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    #[test]
    fn the_wait_follows_the_measured_round_trip_within_bounds() {
        let mut round_trip = RoundTrip::default();
        assert_eq!(round_trip.timeout(), ms(100));
        round_trip.measure(ms(40));
        assert_eq!(
            round_trip.timeout(),
            ms(120),
            "40 and four times half of that"
        );
        for _answer in 0..100 {
            round_trip.measure(Duration::from_micros(100));
        }
        assert_eq!(round_trip.timeout(), ms(10), "timers are not finer");
        for _answer in 0..100 {
            round_trip.measure(ms(5000));
        }
        assert_eq!(round_trip.timeout(), ms(2000));
        assert_eq!(round_trip.shortest(), Some(Duration::from_micros(100)));
    }

    #[test]
    fn the_wait_doubles_until_something_is_measured() {
        let mut round_trip = RoundTrip::default();
        let waits: Vec<_> = (0..6)
            .map(|_| {
                round_trip.back_off();
                round_trip.timeout().as_millis()
            })
            .collect();
        assert_eq!(waits, [200, 400, 800, 1600, 2000, 2000]);
        round_trip.measure(ms(40));
        assert_eq!(round_trip.timeout(), ms(120));
    }
}
