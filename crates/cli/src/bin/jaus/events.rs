//! Events of a running command: lines for people, or with `--json` an object for each.

use std::fmt::Display;
use std::time::Duration;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::Output;
use jaus_cli::runtime::Clock;
use serde_json::{Map, Value as Json, json};

/// `--json`
#[derive(Args, Debug, Clone, Copy)]
pub(crate) struct EventFormat {
    /// Print JSON, one object for each event: "event" names it, "seconds" is the time since the
    /// start
    #[arg(long)]
    json: bool,
}

impl EventFormat {
    /// Whether objects are printed.
    pub(crate) const fn is_json(self) -> bool {
        self.json
    }

    /// Starts the clock of the events.
    pub(crate) fn printer(self) -> EventPrinter {
        EventPrinter {
            output: Output::new(),
            clock: Clock::start(),
            is_json: self.json,
            is_silent: false,
        }
    }
}

/// Prints events on standard output as they happen.
pub(crate) struct EventPrinter {
    output: Output,
    clock: Clock,
    is_json: bool,
    is_silent: bool,
}

impl EventPrinter {
    /// Prints no words from now on; objects are printed.
    pub(crate) const fn silence(&mut self) {
        self.is_silent = true;
    }

    /// Prints an event: its words with the time, or an object with its details.
    pub(crate) fn timed(
        &mut self,
        event: &str,
        details: Json,
        words: impl Display,
    ) -> Result<(), Failure> {
        match self.is_json {
            true => self.object(event, details),
            false if self.is_silent => Ok(()),
            false => self.output.line(format_args!("{}  {words}", self.clock)),
        }
    }

    /// Prints an event: its words without a time, or an object with its details.
    pub(crate) fn plain(
        &mut self,
        event: &str,
        details: Json,
        words: impl Display,
    ) -> Result<(), Failure> {
        match self.is_json {
            true => self.object(event, details),
            false => self.output.line(words),
        }
    }

    /// Prints a line that is for people only.
    pub(crate) fn words(&mut self, words: impl Display) -> Result<(), Failure> {
        match self.is_json {
            true => Ok(()),
            false => self.output.line(words),
        }
    }

    /// Standard output, for lines of another form; `None` if objects are printed.
    pub(crate) fn output(&mut self) -> Option<&mut Output> {
        (!self.is_json).then_some(&mut self.output)
    }

    /// The time since the start.
    pub(crate) fn elapsed(&self) -> Duration {
        self.clock.elapsed()
    }

    fn object(&mut self, event: &str, details: Json) -> Result<(), Failure> {
        let seconds = (self.clock.elapsed().as_secs_f64() * 1e3).round() / 1e3;
        let mut object = Map::new();
        object.insert("seconds".to_owned(), json!(seconds));
        object.insert("event".to_owned(), json!(event));
        if let Json::Object(details) = details {
            object.extend(details);
        }
        self.output.line(Json::Object(object))
    }
}
