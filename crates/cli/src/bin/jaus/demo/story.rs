//! Narrates the demo: one line per event, with time and actor.

use std::fmt::Display;

use jaus_cli::failure::Failure;
use jaus_cli::output::colours_wanted;
use serde_json::json;

use crate::events::{EventFormat, EventPrinter};

/// The actor of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Who {
    System,
    Operator,
    Planner,
    Vehicle,
}

impl Who {
    const fn name_and_colour(self) -> (&'static str, &'static str) {
        match self {
            Self::System => ("system", "\x1b[2m"),
            Self::Operator => ("operator", "\x1b[36m"),
            Self::Planner => ("planner", "\x1b[33m"),
            Self::Vehicle => ("vehicle", "\x1b[32m"),
        }
    }
}

pub(super) struct Story {
    printer: EventPrinter,
    colours: bool,
}

impl Story {
    pub(super) fn new(format: EventFormat) -> Self {
        Self {
            printer: format.printer(),
            colours: colours_wanted(&std::io::stdout()),
        }
    }

    /// Prints a line for people that is not part of the story.
    pub(super) fn line(&mut self, words: impl Display) -> Result<(), Failure> {
        self.printer.words(words)
    }

    /// Prints the end: whether the vehicle has arrived, unless that does not matter.
    pub(super) fn end(
        &mut self,
        arrived: Option<bool>,
        words: impl Display,
    ) -> Result<(), Failure> {
        let seconds = self.printer.elapsed().as_secs_f64();
        let words = format!("\nThe demo ended after {seconds:.1} s{words}.");
        self.printer
            .plain("end", json!({ "arrived": arrived }), words)
    }

    pub(super) fn tell(&mut self, who: Who, words: impl Display) -> Result<(), Failure> {
        let (name, colour) = who.name_and_colour();
        let (on, off) = if self.colours {
            (colour, "\x1b[0m")
        } else {
            ("", "")
        };
        let text = words.to_string();
        self.printer.timed(
            "story",
            json!({ "actor": name, "text": text }),
            format_args!("{on}{name:8}{off}  {text}"),
        )
    }
}
