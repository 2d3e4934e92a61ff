//! Wall clocks of the simulated hosts: tests can step them while virtual time advances evenly.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering::Relaxed};
use std::time::Duration;

/// The time of every wall clock at the start of a simulation: 2026-01-01 00:00:00 UTC, in seconds
/// since the beginning of 1970.
const START: u64 = 1_767_225_600;

/// Virtual time since the start of a simulation, shared by all clocks of a network.
#[derive(Clone, Debug, Default)]
pub(super) struct VirtualTime(Arc<AtomicU64>);

impl VirtualTime {
    pub(super) fn set(&self, elapsed: Duration) {
        // 584 years of nanoseconds fit.
        self.0.store(elapsed.as_nanos() as u64, Relaxed);
    }

    pub(super) fn clock(&self) -> WallClock {
        WallClock {
            time: self.clone(),
            ahead: Arc::default(),
        }
    }
}

/// The wall clock of one host: virtual time and an offset. Clones are the same clock.
#[derive(Clone, Debug)]
pub struct WallClock {
    time: VirtualTime,
    /// Offset from virtual time in nanoseconds; negative if the clock is behind.
    ahead: Arc<AtomicI64>,
}

impl WallClock {
    /// The time shown, since the beginning of 1970 (UTC).
    pub fn since_1970(&self) -> Duration {
        let elapsed = Duration::from_nanos(self.time.0.load(Relaxed));
        let true_time = Duration::from_secs(START) + elapsed;
        let ahead = self.ahead.load(Relaxed);
        let distance = Duration::from_nanos(ahead.unsigned_abs());
        match ahead < 0 {
            true => true_time.saturating_sub(distance),
            false => true_time + distance,
        }
    }

    /// Steps the clock by `nanoseconds`, backward if negative.
    pub(super) fn step(&self, nanoseconds: i64) {
        self.ahead.fetch_add(nanoseconds, Relaxed);
    }
}
