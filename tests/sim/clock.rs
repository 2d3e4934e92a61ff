//! Wall clocks of the simulated hosts, which tests can step while virtual time advances evenly.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering::Relaxed};
use std::time::Duration;

/// What every wall clock shows at the beginning of a simulation: 2026-01-01 00:00:00 UTC, in
/// seconds since the beginning of 1970.
const START: u64 = 1_767_225_600;

/// Virtual time since the beginning of a simulation, which all clocks of a network share.
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
    /// Nanoseconds by which it is ahead of virtual time; negative if it is behind.
    ahead: Arc<AtomicI64>,
}

impl WallClock {
    /// The time that it shows, since the beginning of 1970 (UTC).
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

    /// Moves it by `nanoseconds`, backward if negative.
    pub(super) fn step(&self, nanoseconds: i64) {
        self.ahead.fetch_add(nanoseconds, Relaxed);
    }
}
