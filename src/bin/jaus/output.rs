//! Standard output, line by line.

use std::fmt::Display;
use std::io::{self, StdoutLock, Write};

use crate::failure::Failure;

/// Standard output. Every line is on its way when [`line`](Self::line) returns.
pub(crate) struct Output {
    out: StdoutLock<'static>,
}

impl Output {
    pub(crate) fn new() -> Self {
        Self {
            out: io::stdout().lock(),
        }
    }

    /// Prints a line.
    pub(crate) fn line(&mut self, text: impl Display) -> Result<(), Failure> {
        writeln!(self.out, "{text}")
            .and_then(|()| self.out.flush())
            .map_err(|error| match error.kind() {
                io::ErrorKind::BrokenPipe => Failure::OutputClosed,
                _ => Failure::new(format!("cannot write to standard output: {error}")),
            })
    }
}
