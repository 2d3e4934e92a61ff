//! How a run ends: the exit status, and the one sentence that a failure prints.

use std::error::Error;
use std::fmt;
use std::io;
use std::path::Path;
use std::process::ExitCode;

/// A run that came to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Exit status 0.
    Done,
    /// Something could not be read, or did not answer: exit status 1.
    Incomplete,
    /// Something that was looked at does not work: exit status 2.
    Broken,
}

impl Outcome {
    /// [`Incomplete`](Self::Incomplete) if anything was missing.
    pub fn complete_if(complete: bool) -> Self {
        if complete {
            Self::Done
        } else {
            Self::Incomplete
        }
    }
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Done => Self::SUCCESS,
            Outcome::Incomplete => Self::from(1),
            Outcome::Broken => Self::from(2),
        }
    }
}

/// Why a run could not be: exit status 2.
#[derive(Debug)]
pub enum Failure {
    /// Nobody reads our output any more; not worth a word.
    OutputClosed,
    /// What is wrong and what to do.
    Message(String),
}

impl Failure {
    /// A sentence for people.
    pub fn new(message: impl Into<String>) -> Self {
        Self::Message(message.into())
    }

    /// An error of the library, with its causes: its sentences are made for people.
    pub fn of(error: impl Error) -> Self {
        let mut message = error.to_string();
        let mut source = error.source();
        while let Some(cause) = source {
            message = format!("{message}: {cause}");
            source = cause.source();
        }
        Self::Message(message)
    }

    /// A file that cannot be opened or read.
    pub fn file(path: &Path, error: &io::Error) -> Self {
        Self::Message(format!("{}: {error}", path.display()))
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutputClosed => f.write_str("standard output was closed"),
            Self::Message(message) => f.write_str(message),
        }
    }
}

impl Error for Failure {}
