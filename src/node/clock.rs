//! The clock of nodes and components.
#![expect(clippy::disallowed_methods, reason = "the node owns the clock")]

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The clock of nodes and components. It is tokio's: where a test pauses that clock, timers,
/// endpoints, components and the control loops that read it share one virtual time.
pub fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

/// Waits until a deadline, as `poll_timeout` of a state machine returns it; without one, for ever.
pub async fn sleep_until(deadline: Option<Instant>) {
    match deadline {
        Some(deadline) => tokio::time::sleep_until(deadline.into()).await,
        None => std::future::pending().await,
    }
}

/// The host's time of day, as time since the beginning of 1970 (UTC); 0 if its clock is earlier.
pub fn time_of_day() -> Duration {
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
    since_1970.unwrap_or_default()
}
