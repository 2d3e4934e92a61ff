//! What a check has found, in words and as JSON.

use std::fmt::Display;

use serde_json::{Value as Json, json};

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Ok,
    Warning,
    Problem,
}

impl Mark {
    const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warning => "warning",
            Self::Problem => "problem",
        }
    }

    const fn colour(self) -> &'static str {
        match self {
            Self::Ok => "\x1b[32m",
            Self::Warning => "\x1b[33m",
            Self::Problem => "\x1b[31m",
        }
    }
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Finding {
    pub(super) mark: Mark,
    /// What was looked at, in a word.
    check: &'static str,
    /// How it is.
    what: String,
    /// What to do about it.
    advice: Option<String>,
}

/// Columns of a terminal that nobody has widened.
const WIDTH: usize = 80;
/// Columns before the words: the mark and what was looked at.
const INDENT: usize = 21;

impl Finding {
    pub(super) fn ok(check: &'static str, what: impl Display) -> Self {
        Self::new(Mark::Ok, check, what)
    }

    pub(super) fn warning(check: &'static str, what: impl Display) -> Self {
        Self::new(Mark::Warning, check, what)
    }

    pub(super) fn problem(check: &'static str, what: impl Display) -> Self {
        Self::new(Mark::Problem, check, what)
    }

    fn new(mark: Mark, check: &'static str, what: impl Display) -> Self {
        Self {
            mark,
            check,
            what: what.to_string(),
            advice: None,
        }
    }

    /// Adds what to do.
    pub(super) fn advice(mut self, advice: impl Display) -> Self {
        self.advice = Some(advice.to_string());
        self
    }

    /// The finding, over as many lines as it needs.
    pub(super) fn in_words(&self, colours: bool) -> String {
        let name = self.mark.name();
        let mark = match colours {
            true => format!("{}{name:8}\x1b[0m", self.mark.colour()),
            false => format!("{name:8}"),
        };
        let mut text = format!("{mark} {:12}{}", self.check, wrapped(&self.what, INDENT));
        if let Some(advice) = &self.advice {
            text.push_str(&format!(
                "\n{:INDENT$}{}",
                "",
                wrapped(&format!("→ {advice}"), INDENT)
            ));
        }
        text
    }

    pub(super) fn to_json(&self) -> Json {
        json!({
            "mark": self.mark.name(),
            "check": self.check,
            "what": self.what,
            "advice": self.advice,
        })
    }
}

/// Breaks words into lines that begin behind so many columns.
pub(super) fn wrapped(text: &str, indent: usize) -> String {
    let mut lines = String::new();
    let mut column = indent;
    // What belongs together has a non-breaking space.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_is_longer_than_a_terminal_is_wide() {
        let finding = Finding::warning("port", "words ".repeat(40)).advice("more ".repeat(40));
        let text = finding.in_words(false);
        assert!(
            text.starts_with("warning  port        words words"),
            "{text}"
        );
        assert!(
            text.lines().all(|line| line.chars().count() <= WIDTH),
            "{text}"
        );
        assert!(
            text.contains("\n                     → more more"),
            "{text}"
        );
    }
}
