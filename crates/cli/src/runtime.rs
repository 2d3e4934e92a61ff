//! Single-threaded tokio runtime, and the end of a command: signals and time limits.
#![expect(
    clippy::disallowed_methods,
    reason = "commands run in real time and own their tasks"
)]

use std::fmt;
use std::future::Future;
use std::time::{Duration, Instant};

use clap::Args;
use jaus::node::units;
use tokio::runtime::Builder;

use super::failure::Failure;

/// Runs a command's network part to completion.
pub fn run<T>(work: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
    let runtime = Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|error| Failure::new(format!("cannot start: {error}")))?;
    runtime.block_on(work)
}

/// Waits for Ctrl-C or SIGTERM, or for the time limit if there is one.
pub async fn end(limit: Option<Duration>) {
    let limit = async {
        match limit {
            Some(limit) => tokio::time::sleep(limit).await,
            None => std::future::pending().await,
        }
    };
    tokio::select! {
        () = limit => {}
        () = interrupt() => {}
        () = termination() => {}
    }
}

// The flag `--for`: how long a command runs.
#[derive(Args, Debug, Clone, Copy)]
#[expect(
    missing_docs,
    reason = "it would become the help text of the struct that flattens it"
)]
pub struct RunFor {
    /// End after this time, such as 10s [default: at Ctrl-C]
    #[arg(long = "for", value_name = "DURATION", value_parser = duration)]
    duration: Option<Duration>,
}

impl RunFor {
    /// The time limit, if there is one.
    pub const fn limit(self) -> Option<Duration> {
        self.duration
    }

    /// As [`end`], with this time limit.
    pub async fn end(self) {
        end(self.duration).await;
    }
}

async fn interrupt() {
    // Without a handler, Ctrl-C still ends the process, without cleanup.
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}

#[cfg(unix)]
async fn termination() {
    use tokio::signal::unix::{SignalKind, signal};
    match signal(SignalKind::terminate()) {
        Ok(mut terminate) => {
            terminate.recv().await;
        }
        Err(_) => std::future::pending().await,
    }
}

#[cfg(not(unix))]
async fn termination() {
    std::future::pending::<()>().await;
}

/// Parses a flag's number of seconds: `2`, `0.5`, `2s`.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let number = text.strip_suffix('s').unwrap_or(text);
    let seconds: f64 = number
        .parse()
        .map_err(|_| "write a number of seconds such as 2 or 0.5".to_owned())?;
    match Duration::try_from_secs_f64(seconds) {
        Ok(duration) if !duration.is_zero() && duration < MOST => Ok(duration),
        _ => Err("write more than 0 and less than a year".to_owned()),
    }
}

const MOST: Duration = Duration::from_secs(365 * 86_400);

/// Parses a flag's duration with its unit, such as `10s`, `500ms` or `2 min`; more than 0.
pub fn duration(text: &str) -> Result<Duration, String> {
    match units::duration(text) {
        Ok(Duration::ZERO) => Err("write more than 0".to_owned()),
        result => result.map_err(|error| error.to_string()),
    }
}

/// Formats a duration as [`duration`] reads it.
pub fn in_words(duration: Duration) -> String {
    match duration.as_secs_f64() {
        seconds if seconds < 1.0 => format!("{} ms", duration.as_millis()),
        seconds => format!("{seconds} s"),
    }
}

/// Parses a flag's number within bounds.
pub fn between(text: &str, least: f64, most: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!("write a number from {least} to {most}")),
    }
}

/// The time since the start of a command, printed as `  12.34 s`.
#[derive(Debug, Clone, Copy)]
pub struct Clock(Instant);

impl Clock {
    /// Starts the clock.
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// The elapsed time.
    pub fn elapsed(self) -> Duration {
        self.0.elapsed()
    }
}

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:7.2} s", self.elapsed().as_secs_f64())
    }
}
