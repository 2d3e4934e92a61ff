//! Round trip measurement and the retransmission timeout that follows from it (after RFC 6298).

use std::time::Duration;

/// The timeout before the first measurement, which is Junior's.
const UNMEASURED: Duration = Duration::from_millis(100);
/// The shortest timeout: timers have a granularity of a millisecond, and a busy board answers some
/// milliseconds late.
const LEAST: Duration = Duration::from_millis(10);
/// Round trips vary by this much even without queueing.
const GRANULARITY: Duration = Duration::from_micros(500);
/// The least margin over the smoothed round trip.
const LEAST_VARIATION: Duration = Duration::from_millis(5);
/// The longest timeout, back-off included.
const MOST: Duration = Duration::from_secs(2);

/// The measured round trip to one destination.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RoundTrip {
    measured: Option<Measured>,
    /// How often the timeout was doubled since the last measurement.
    doublings: u32,
}

#[derive(Clone, Copy, Debug)]
struct Measured {
    smoothed: Duration,
    variation: Duration,
    shortest: Duration,
}

impl RoundTrip {
    /// Records the round trip of a packet that was sent once. After a retransmission, an
    /// acknowledgement could belong to either copy (Karn).
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

    /// Doubles the timeout after it has passed without an acknowledgement.
    pub(super) fn back_off(&mut self) {
        self.doublings = (self.doublings + 1).min(8);
    }

    /// Resets the back-off when traffic resumes after a pause: old timeouts say nothing about now.
    pub(super) fn restart(&mut self) {
        self.doublings = 0;
    }

    /// Whether round trips exceed the shortest one by so much that packets must be queueing
    /// somewhere.
    pub(super) fn has_grown(&self) -> bool {
        self.measured
            .is_none_or(|known| known.smoothed > known.shortest * 3 / 2 + GRANULARITY)
    }

    /// The retransmission timeout.
    pub(super) fn timeout(&self) -> Duration {
        let once = self.measured.map_or(UNMEASURED, |known| {
            let variation = (known.variation * 4).max(LEAST_VARIATION);
            (known.smoothed + variation).max(LEAST)
        });
        (once * (1 << self.doublings)).min(MOST)
    }

    /// The smoothed round trip, if measured.
    pub(super) fn smoothed(&self) -> Option<Duration> {
        self.measured.map(|known| known.smoothed)
    }

    /// The shortest round trip measured so far.
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

    #[test]
    fn a_restart_ends_the_doubling_and_keeps_the_measurement() {
        let mut round_trip = RoundTrip::default();
        round_trip.measure(ms(40));
        round_trip.back_off();
        round_trip.restart();
        assert_eq!(round_trip.timeout(), ms(120));
        assert_eq!(round_trip.smoothed(), Some(ms(40)));
    }

    #[test]
    fn the_round_trip_has_grown_from_one_and_a_half_times_the_shortest() {
        let mut round_trip = RoundTrip::default();
        assert!(round_trip.has_grown(), "until it is measured");
        round_trip.measure(ms(8));
        assert!(!round_trip.has_grown());
        // An eighth of each new measurement counts: 8 + 36 / 8 = 12.5 ms, the limit.
        round_trip.measure(ms(44));
        assert_eq!(round_trip.smoothed(), Some(Duration::from_micros(12_500)));
        assert!(!round_trip.has_grown());
        round_trip.measure(ms(44));
        assert!(round_trip.has_grown());
    }

    #[test]
    fn the_margin_follows_how_much_the_measurements_vary() {
        let mut round_trip = RoundTrip::default();
        round_trip.measure(ms(40));
        round_trip.measure(ms(80));
        // Variation (3 · 20 + 40) / 4 = 25 ms, smoothed (7 · 40 + 80) / 8 = 45 ms.
        assert_eq!(round_trip.timeout(), ms(45 + 4 * 25));
    }
}
