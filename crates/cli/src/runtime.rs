//! Single-threaded tokio runtime, and the end of a command: signals and time limits.
#![expect(
    clippy::disallowed_methods,
    reason = "commands run in real time and own their tasks"
)]

use std::fmt;
use std::future::Future;
use std::time::{Duration, Instant};

use clap::Args;
use clap::builder::Resettable;
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
    #[arg(
        long = "for",
        value_name = "DURATION",
        value_parser = duration,
        help_heading = Resettable::Reset
    )]
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

/// Parses a flag's duration with its unit, such as `10s`, `500ms` or `2 min`; more than 0.
pub fn duration(text: &str) -> Result<Duration, String> {
    match units::duration(text) {
        Ok(Duration::ZERO) => Err("write more than 0".to_owned()),
        result => result.map_err(|error| error.to_string()),
    }
}

/// Parses a flag's duration within bounds, which are written as the user would.
pub fn duration_within(text: &str, least: &str, most: &str) -> Result<Duration, String> {
    let bound = |text| units::duration(text).map_err(|error| error.to_string());
    let duration = bound(text)?;
    match (bound(least)?..=bound(most)?).contains(&duration) {
        true => Ok(duration),
        false => Err(format!("write a duration from {least} to {most}")),
    }
}

/// Parses a flag's size, such as `1500`, `64 KiB` or `1.5MB`, within bounds in octets.
pub fn size_within(text: &str, least: usize, most: usize) -> Result<usize, String> {
    let size = units::size(text).map_err(|error| error.to_string())?;
    match (least..=most).contains(&size) {
        true => Ok(size),
        false => Err(format!("write a size from {least} to {most} octets")),
    }
}

/// Parses a flag's control timeout as Access Control reports it: whole seconds, 0 for `never`.
pub fn control_timeout(text: &str) -> Result<u8, String> {
    if text == "never" {
        return Ok(0);
    }
    let duration = duration(text)?;
    match u8::try_from(duration.as_secs()) {
        Ok(seconds) if duration.subsec_nanos() == 0 => Ok(seconds),
        _ => Err("write whole seconds up to 255s, or never".to_owned()),
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
