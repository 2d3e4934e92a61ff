//! Sends the library's tracing to standard error or the journal, at a level that can change while
//! the program runs.

mod visible;

use std::io;
use std::path::Path;
#[cfg(unix)]
use std::path::PathBuf;
use std::sync::OnceLock;

use clap::builder::Resettable;
use clap::{Args, ValueEnum};
#[cfg(unix)]
use tokio::signal::unix::{Signal, SignalKind, signal};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::{Layer, SubscriberExt as _};
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{Registry, reload};

use super::failure::Failure;
use super::log_level::LogLevel;
use super::output::colours_wanted;
#[cfg(unix)]
use super::settings;
use visible::Visible;

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

    /// How events are logged
    #[arg(
        long,
        value_enum,
        default_value_t,
        global = true,
        help_heading = Resettable::Reset
    )]
    log_format: LogFormat,
}

/// Forms of the log.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum LogFormat {
    /// Lines for people, on standard error
    #[default]
    Text,
    /// An object a line, on standard error
    Json,
    /// Fields in systemd's journal
    Journald,
}

/// The level of this process, which has one log.
static LEVEL: OnceLock<Level> = OnceLock::new();

struct Level {
    handle: reload::Handle<Targets, Registry>,
    /// The level at the start.
    first: Targets,
    /// Whether a flag or the environment chose it.
    is_chosen: bool,
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
        let output = self.layer()?;
        let (level, handle) = reload::Layer::new(filter.clone());
        let is_chosen = self.verbose > 0 || std::env::var_os(LOG).is_some();
        // A process has one log, so nothing else has set it.
        let _ = LEVEL.set(Level {
            handle,
            first: filter,
            is_chosen,
        });
        tracing_subscriber::registry()
            .with(level)
            .with(output)
            .init();
        Ok(())
    }

    /// What writes the events.
    fn layer<S>(&self) -> Result<Box<dyn Layer<S> + Send + Sync>, Failure>
    where
        S: tracing::Subscriber + for<'s> LookupSpan<'s>,
    {
        // With internal errors, a layer reports on standard error that standard error is closed,
        // and panics.
        let layer = tracing_subscriber::fmt::layer().log_internal_errors(false);
        Ok(match self.log_format {
            LogFormat::Text => Visible(
                layer
                    .with_writer(io::stderr)
                    .with_ansi(colours_wanted(&io::stderr()))
                    .with_target(self.verbose > 1),
            )
            .boxed(),
            LogFormat::Json => {
                Visible(layer.with_writer(io::stderr).json().flatten_event(true)).boxed()
            }
            LogFormat::Journald => Visible(
                tracing_journald::layer()
                    .map_err(|error| {
                        Failure::new(format!(
                            "--log-format journald: no journal of systemd on this host ({error}); \
                             choose text or json"
                        ))
                    })?
                    .with_field_prefix(Some("JAUS".to_owned())),
            )
            .boxed(),
        })
    }
}

/// Logs at the level of the settings file from now on, unless a flag or the environment chose one.
pub fn use_level(level: Option<LogLevel>) {
    if let (Some(current), Some(LogLevel(level))) = (LEVEL.get(), level)
        && !current.is_chosen
    {
        set(current, level);
    }
}

/// Requests to read the log level again: SIGUSR1.
pub struct LevelRequests {
    #[cfg(unix)]
    file: Option<PathBuf>,
    #[cfg(unix)]
    signals: Option<Signal>,
}

impl LevelRequests {
    /// Accepts requests from now on. `file` is the settings file with the level.
    pub fn accept(file: Option<&Path>) -> Self {
        #[cfg(not(unix))]
        let _ = file;
        Self {
            #[cfg(unix)]
            file: file.map(Path::to_owned),
            #[cfg(unix)]
            signals: signal(SignalKind::user_defined1()).ok(),
        }
    }

    /// Reads the level again at each request. Never returns.
    pub async fn follow(self) {
        #[cfg(unix)]
        if let Some(mut signals) = self.signals {
            while signals.recv().await.is_some() {
                read_level(self.file.clone()).await;
            }
        }
        std::future::pending::<()>().await;
    }
}

#[cfg(unix)]
async fn read_level(file: Option<PathBuf>) {
    let Some(file) = file else {
        tracing::warn!("there is no settings file to read the log level from: start with --config");
        return;
    };
    // A slow disk must not delay the component.
    let read = tokio::task::spawn_blocking(move || settings::read(&file));
    match (LEVEL.get(), read.await) {
        (Some(current), Ok(Ok((identity, _)))) => {
            let level = identity.log_level.map(|LogLevel(level)| level);
            let level = level.unwrap_or_else(|| current.first.clone());
            tracing::warn!("the log level is now {level}");
            set(current, level);
        }
        (_, Ok(Err(error))) => tracing::error!("the log level is unchanged: {error}"),
        (_, Err(error)) => tracing::error!("the log level is unchanged: {error}"),
        (None, _) => {}
    }
}

fn set(current: &Level, level: Targets) {
    if let Err(error) = current.handle.reload(level) {
        tracing::error!("the log level is unchanged: {error}");
    }
}
