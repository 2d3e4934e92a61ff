//! Sends the library's tracing to standard error, at the chosen level.

use clap::Args;
use clap::builder::Resettable;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

use super::failure::Failure;
use super::output::colours_wanted;

/// The verbosity flag of every program.
#[derive(Args, Debug, Clone, Copy)]
pub struct Logging {
    /// Log more to standard error; -vv and -vvv for details
    ///
    /// The environment variable JAUS_LOG sets levels by module, for example
    /// JAUS_LOG=jaus::endpoint=trace.
    #[arg(
        short,
        long,
        action = clap::ArgAction::Count,
        global = true,
        help_heading = Resettable::Reset
    )]
    verbose: u8,
}

/// Environment variable with the log filter.
const LOG: &str = "JAUS_LOG";

impl Logging {
    /// Sends the library's tracing to standard error. `usual` is the level without a flag, such as
    /// `warn`.
    ///
    /// # Errors
    /// If the environment variable cannot be read.
    pub fn start(&self, usual: &str) -> Result<(), Failure> {
        let level = match self.verbose {
            0 => usual,
            1 => "info",
            2 => "debug",
            _ => "trace",
        };
        // Modules and levels are enough: field filters would add a regular expression engine to
        // every small program.
        let wanted = std::env::var(LOG).unwrap_or_else(|_| level.to_owned());
        let filter: Targets = wanted
            .parse()
            .map_err(|error| Failure::new(format!("{LOG}={wanted}: {error}")))?;
        let told = tracing_subscriber::fmt::layer()
            .with_writer(std::io::stderr)
            .with_ansi(colours_wanted(&std::io::stderr()))
            .with_target(self.verbose > 1)
            // Otherwise it reports on standard error that standard error is closed, and panics.
            .log_internal_errors(false);
        tracing_subscriber::registry()
            .with(filter)
            .with(told)
            .init();
        Ok(())
    }
}
