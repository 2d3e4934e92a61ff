//! Sends the library's tracing to standard error, at the chosen level.

use std::io::{self, Write};

use clap::Args;
use clap::builder::Resettable;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

use super::failure::Failure;
use super::output::{colours_wanted, harmless};

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
            .with_writer(|| OneLine(io::stderr()))
            .with_ansi(colours_wanted(&io::stderr()))
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

/// Writes each event as one line, whatever text of a peer it holds.
struct OneLine<W>(W);

impl<W: Write> Write for OneLine<W> {
    /// Takes an event: the subscriber hands each over in one call.
    fn write(&mut self, event: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(event);
        let text = text.strip_suffix('\n').unwrap_or(&text);
        let line = harmless(text).replace('\n', r"\n");
        writeln!(self.0, "{line}")?;
        Ok(event.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    #[derive(Clone, Default)]
    struct Written(Arc<Mutex<Vec<u8>>>);

    impl Write for Written {
        fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().extend_from_slice(octets);
            Ok(octets.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn an_event_is_one_line_whatever_name_it_holds() {
        let written = Written::default();
        let to = written.clone();
        let layer = tracing_subscriber::fmt::layer()
            .with_ansi(false)
            .with_writer(move || OneLine(to.clone()));
        let log = tracing_subscriber::registry().with(layer);
        let name = "\x1b]0;title\x07\r\nfake line \u{202e}";
        tracing::subscriber::with_default(log, || tracing::info!("the name is {name}"));
        let written = written.0.lock().unwrap().clone();
        let text = String::from_utf8(written).unwrap();
        assert_eq!(text.matches('\n').count(), 1, "{text}");
        assert!(text.contains(r"title"), "{text}");
        assert!(
            !text.trim_end().contains(jaus_view::disturbs_terminal),
            "{text}"
        );
    }
}
