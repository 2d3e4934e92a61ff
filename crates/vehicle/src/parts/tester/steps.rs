//! Test steps: what was checked, with which result, in what time.

use std::fmt::{self, Display};
use std::time::Duration;

use jaus_view::junit::{self, Case, CaseResult, Suite};

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
    let case = |step: &Step| Case {
        name: step.name.clone(),
        class: suite.to_owned(),
        took: step.took,
        result: match &step.verdict {
            Verdict::Pass(detail) => CaseResult::Passed(Some(detail.clone())),
            Verdict::Fail(reason) => CaseResult::Failed {
                reason: reason.clone(),
                details: String::new(),
            },
            Verdict::Skipped => CaseResult::Skipped("an earlier step failed".to_owned()),
        },
    };
    let cases = steps.iter().map(case).collect();
    let name = suite.to_owned();
    junit::document(suite, &[Suite { name, cases }])
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
        let counts = "tests=\"3\" failures=\"1\" errors=\"0\" skipped=\"1\" time=\"4.500\"";
        assert!(text.contains(counts), "{text}");
        assert!(text.contains("name=\"b &amp; c\""));
        assert!(text.contains("<failure message=\"&quot;no&quot;\"/>"));
        assert!(text.contains("<system-out>x &gt; y\\u{0}</system-out>"));
        assert!(!all_pass(&steps) && all_pass(&steps[..1]));
    }
}
