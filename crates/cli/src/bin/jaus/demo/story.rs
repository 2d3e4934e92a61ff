//! Narrates the demo: one line per event, with time and actor.

use std::fmt::Display;

use jaus_cli::failure::Failure;
use jaus_cli::output::{Output, colours_wanted};
use jaus_cli::runtime::Clock;

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
    output: Output,
    clock: Clock,
    colours: bool,
}

impl Story {
    pub(super) fn new() -> Self {
        let colours = colours_wanted(&std::io::stdout());
        Self {
            output: Output::new(),
            clock: Clock::start(),
            colours,
        }
    }

    /// Prints a line that is not part of the story.
    pub(super) fn line(&mut self, words: impl Display) -> Result<(), Failure> {
        self.output.line(words)
    }

    pub(super) fn tell(&mut self, who: Who, words: impl Display) -> Result<(), Failure> {
        let (name, colour) = who.name_and_colour();
        let (on, off) = if self.colours {
            (colour, "\x1b[0m")
        } else {
            ("", "")
        };
        self.output
            .line(format_args!("{}  {on}{name:8}{off}  {words}", self.clock))
    }

    /// Seconds since the start.
    pub(super) fn seconds(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }
}
