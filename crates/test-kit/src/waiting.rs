//! Waits for conditions, each with the same limit.

use std::panic::Location;
use std::time::{Duration, Instant};

/// Timeout of every wait: far longer than any wait on a busy machine, so that only a failing test
/// reaches it. No test measures time with it.
pub const LIMIT: Duration = Duration::from_secs(60);

/// Interval between two checks of a condition.
const PERIOD: Duration = Duration::from_millis(5);

/// Waits for a future.
///
/// # Panics
/// If it takes longer than [`LIMIT`]; the panic names the caller.
#[track_caller]
pub fn within_limit<T>(future: impl Future<Output = T>) -> impl Future<Output = T> {
    let place = Location::caller();
    async move {
        let waited = tokio::time::timeout(LIMIT, future).await;
        waited.unwrap_or_else(|_| panic!("not within {LIMIT:?}, at {place}"))
    }
}

/// Waits until a condition holds.
///
/// # Panics
/// If it takes longer than [`LIMIT`]; the panic names the caller.
#[track_caller]
pub fn until(mut holds: impl FnMut() -> bool) -> impl Future<Output = ()> {
    within_limit(async move {
        while !holds() {
            tokio::time::sleep(PERIOD).await;
        }
    })
}

/// Waits until a condition holds, without a runtime.
///
/// # Panics
/// If it takes longer than [`LIMIT`].
#[track_caller]
pub fn block_until(mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + LIMIT;
    while !holds() {
        assert!(Instant::now() < deadline, "not within {LIMIT:?}");
        std::thread::sleep(PERIOD);
    }
}
