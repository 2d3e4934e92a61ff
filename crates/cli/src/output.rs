//! Standard output by lines, and messages on standard error.

use std::fmt::{self, Display};
use std::io::{self, IsTerminal, StdoutLock, Write};

use super::failure::Failure;

/// For example `no errors`, `1 error`, `2 errors`.
pub fn counted(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what}s"),
        1 => format!("1 {what}"),
        count => format!("{count} {what}s"),
    }
}

/// Standard output. Every line is flushed when [`line`](Self::line) returns.
pub struct Output {
    out: StdoutLock<'static>,
}

impl Default for Output {
    fn default() -> Self {
        Self::new()
    }
}

impl Output {
    /// Opens standard output.
    pub fn new() -> Self {
        Self {
            out: io::stdout().lock(),
        }
    }

    /// Prints text that is no line: a screen.
    pub fn part(&mut self, text: &str) -> Result<(), Failure> {
        self.write(format_args!("{text}"))
    }

    /// Prints a line.
    pub fn line(&mut self, text: impl Display) -> Result<(), Failure> {
        self.write(format_args!("{text}\n"))
    }

    fn write(&mut self, text: fmt::Arguments<'_>) -> Result<(), Failure> {
        self.out
            .write_fmt(text)
            .and_then(|()| self.out.flush())
            .map_err(|error| match error.kind() {
                io::ErrorKind::BrokenPipe => Failure::OutputClosed,
                _ => Failure::new(format!("cannot write to standard output: {error}")),
            })
    }
}

/// Wraps text into lines of 80 columns; all but the first start with this indentation.
pub fn wrapped(text: &str, indent: usize) -> String {
    let mut lines = String::new();
    let mut column = indent;
    // Non-breaking spaces keep phrases together.
    for word in text.split_ascii_whitespace() {
        let length = word.chars().count();
        if column > indent && column + 1 + length > WIDTH {
            lines.push_str(&format!("\n{:indent$}", ""));
            column = indent;
        } else if column > indent {
            lines.push(' ');
            column += 1;
        }
        lines.push_str(word);
        column += length;
    }
    lines.replace('\u{a0}', " ")
}

/// Default width of a terminal, in columns.
const WIDTH: usize = 80;

/// Prints a message on standard error. Errors are ignored.
pub fn say(words: impl Display) {
    say_as("jaus", words);
}

/// The same, for a program other than `jaus`.
pub fn say_as(program: &str, words: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{program}: {words}");
}

/// Whether to use colours: on a terminal, unless NO_COLOR (<https://no-color.org>) is set.
pub fn colours_wanted(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
