//! One thread with tokio on it.

use std::future::Future;
use std::time::Duration;

use tokio::runtime::Builder;

use crate::failure::Failure;

/// Runs a command's network part to its end.
pub(crate) fn run<T>(work: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
    let runtime = Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|error| Failure::new(format!("cannot start: {error}")))?;
    runtime.block_on(work)
}

/// A flag's number of seconds: `2`, `0.5`.
pub(crate) fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text
        .parse()
        .map_err(|_| "write a number of seconds such as 2 or 0.5".to_owned())?;
    match Duration::try_from_secs_f64(seconds) {
        Ok(duration) if !duration.is_zero() && duration < MOST => Ok(duration),
        _ => Err("more than 0 and less than a year, please".to_owned()),
    }
}

const MOST: Duration = Duration::from_secs(365 * 86_400);
