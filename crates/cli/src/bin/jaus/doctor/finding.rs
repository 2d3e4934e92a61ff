//! Result of a check, as text and as JSON.

use std::fmt::Display;

use jaus_cli::output::wrapped;
use serde_json::{Value as Json, json};

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Ok,
    Warning,
    /// The warning that no other node was found, which says nothing about this host.
    Alone,
    Problem,
}

impl Mark {
    const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warning | Self::Alone => "warning",
            Self::Problem => "failed",
        }
    }

    const fn colour(self) -> &'static str {
        match self {
            Self::Ok => "\x1b[32m",
            Self::Warning | Self::Alone => "\x1b[33m",
            Self::Problem => "\x1b[31m",
        }
    }
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Finding {
    pub(super) mark: Mark,
    /// Name of the check, in one word.
    check: &'static str,
    /// Observed state.
    what: String,
    /// A figure that differs from round to round.
    figure: Option<String>,
    /// Remedy.
    advice: Option<String>,
}

/// Columns before the text: mark and check.
const INDENT: usize = 21;

impl Finding {
    pub(super) fn ok(check: &'static str, what: impl Display) -> Self {
        Self::new(Mark::Ok, check, what)
    }

    pub(super) fn warning(check: &'static str, what: impl Display) -> Self {
        Self::new(Mark::Warning, check, what)
    }

    pub(super) fn alone(check: &'static str, what: impl Display) -> Self {
        Self::new(Mark::Alone, check, what)
    }

    pub(super) fn problem(check: &'static str, what: impl Display) -> Self {
        Self::new(Mark::Problem, check, what)
    }

    fn new(mark: Mark, check: &'static str, what: impl Display) -> Self {
        Self {
            mark,
            check,
            what: what.to_string(),
            figure: None,
            advice: None,
        }
    }

    #[cfg(feature = "secure")]
    pub(super) fn is_problem(&self) -> bool {
        self.mark == Mark::Problem
    }

    /// Adds a figure that belongs to the observed state, but is another one in every round.
    #[cfg(feature = "secure")]
    pub(super) fn figure(mut self, figure: impl Display) -> Self {
        self.figure = Some(figure.to_string());
        self
    }

    /// Whether it says the same as another finding, whatever their figures are.
    pub(super) fn is_same_as(&self, other: &Self) -> bool {
        self.said() == other.said()
    }

    fn said(&self) -> (Mark, &str, &str, Option<&str>) {
        (self.mark, self.check, &self.what, self.advice.as_deref())
    }

    /// What was observed, with the figure.
    fn observed(&self) -> String {
        match &self.figure {
            Some(figure) => format!("{}; {figure}", self.what),
            None => self.what.clone(),
        }
    }

    /// Adds a remedy.
    pub(super) fn advice(mut self, advice: impl Display) -> Self {
        self.advice = Some(advice.to_string());
        self
    }

    /// The finding as text, wrapped.
    pub(super) fn in_words(&self, colours: bool) -> String {
        let name = self.mark.name();
        let mark = match colours {
            true => format!("{}{name:8}\x1b[0m", self.mark.colour()),
            false => format!("{name:8}"),
        };
        let mut text = format!(
            "{mark} {:12}{}",
            self.check,
            wrapped(&self.observed(), INDENT)
        );
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
            "verdict": self.mark.name(),
            "check": self.check,
            "what": self.observed(),
            "advice": self.advice,
        })
    }
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
            text.lines().all(|line| line.chars().count() <= 80),
            "{text}"
        );
        assert!(
            text.contains("\n                     → more more"),
            "{text}"
        );
    }
}
