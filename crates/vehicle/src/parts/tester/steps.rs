//! Test steps: what was checked, with which result, in what time.

use std::fmt::{self, Display, Write};
use std::time::Duration;

/// Result of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// The check passed, with what was observed.
    Pass(String),
    /// The check failed, with the reason.
    Fail(String),
    /// The step was skipped because an earlier one failed.
    Skipped,
}

/// One step of a test.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// The check.
    pub name: String,
    /// The result.
    pub verdict: Verdict,
    /// Duration of the step.
    pub took: Duration,
}

impl Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (word, detail) = match &self.verdict {
            Verdict::Pass(detail) => ("ok", detail.as_str()),
            Verdict::Fail(detail) => ("failed", detail.as_str()),
            Verdict::Skipped => ("skipped", ""),
        };
        let milliseconds = self.took.as_secs_f64() * 1e3;
        let name = &self.name;
        write!(f, "{word:7}  {milliseconds:>9.1} ms  {name:<44} {detail}")
    }
}

/// Whether all steps passed.
#[must_use]
pub fn all_pass(steps: &[Step]) -> bool {
    steps
        .iter()
        .all(|step| matches!(step.verdict, Verdict::Pass(_)))
}

/// Formats the steps as a JUnit report for build servers.
#[must_use]
pub fn junit(suite: &str, steps: &[Step]) -> String {
    let count =
        |wanted: fn(&Verdict) -> bool| steps.iter().filter(|step| wanted(&step.verdict)).count();
    let time: Duration = steps.iter().map(|step| step.took).sum();
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"{}\" tests=\"{}\" \
         failures=\"{}\" skipped=\"{}\" time=\"{:.3}\">\n",
        Plain(suite),
        steps.len(),
        count(|verdict| matches!(verdict, Verdict::Fail(_))),
        count(|verdict| matches!(verdict, Verdict::Skipped)),
        time.as_secs_f64()
    );
    for step in steps {
        let inside = match &step.verdict {
            Verdict::Pass(detail) => format!("<system-out>{}</system-out>", Plain(detail)),
            Verdict::Fail(detail) => format!("<failure message=\"{}\"/>", Plain(detail)),
            Verdict::Skipped => "<skipped/>".to_owned(),
        };
        text.push_str(&format!(
            "  <testcase classname=\"{}\" name=\"{}\" time=\"{:.3}\">{inside}</testcase>\n",
            Plain(suite),
            Plain(&step.name),
            step.took.as_secs_f64()
        ));
    }
    text.push_str("</testsuite>\n");
    text
}

/// Text escaped for XML, with control characters replaced by spaces.
pub(super) struct Plain<'a>(pub(super) &'a str);

impl Display for Plain<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for letter in self.0.chars() {
            match letter {
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '&' => f.write_str("&amp;")?,
                '"' => f.write_str("&quot;")?,
                other if other.is_control() => f.write_char(' ')?,
                other => f.write_char(other)?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_counts_what_failed_and_what_was_skipped() {
        let step = |name: &str, verdict| Step {
            name: name.to_owned(),
            verdict,
            took: Duration::from_millis(1500),
        };
        let steps = [
            step("a", Verdict::Pass("x > y\u{0}".to_owned())),
            step("b & c", Verdict::Fail("\"no\"".to_owned())),
            step("d", Verdict::Skipped),
        ];
        let text = junit("mission", &steps);
        assert!(text.contains("tests=\"3\" failures=\"1\" skipped=\"1\" time=\"4.500\""));
        assert!(text.contains("name=\"b &amp; c\""));
        assert!(text.contains("<failure message=\"&quot;no&quot;\"/>"));
        assert!(text.contains("<system-out>x &gt; y </system-out>"));
        assert!(!all_pass(&steps) && all_pass(&steps[..1]));
    }
}
