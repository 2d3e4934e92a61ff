//! Writes the run as JUnit XML: a suite per form, a case per step.

use jaus_view::junit::{self, Case, CaseResult, Suite};

use super::report::Report;
use super::step::Form;
use super::subject::Subject;
use super::verdict::{StepResult, Verdict};

/// The whole document.
pub(super) fn document(report: &Report<'_>, subject: &Subject, results: &[StepResult]) -> String {
    let suites = [Form::Multicast, Form::Unicast].map(|form| {
        let of_form = results.iter().filter(|result| result.form == form);
        Suite {
            name: format!("{} {}", subject.id, form.name()),
            cases: of_form
                .map(|result| case(report, subject, result))
                .collect(),
        }
    });
    let suites: Vec<Suite> = suites
        .into_iter()
        .filter(|suite| !suite.cases.is_empty())
        .collect();
    junit::document("jaus judge", &suites)
}

fn case(report: &Report<'_>, subject: &Subject, result: &StepResult) -> Case {
    Case {
        name: format!("{} {}", result.name, result.title),
        class: format!("jaus.judge.{}.{}", subject.id, result.form.name()),
        took: result.took,
        result: match &result.verdict {
            Verdict::Passed => CaseResult::Passed(None),
            Verdict::Skipped(reason) | Verdict::LeftOut(reason) => {
                CaseResult::Skipped(reason.clone())
            }
            Verdict::Failed(reason) => CaseResult::Failed {
                reason: reason.clone(),
                details: report.step(result, true).join("\n"),
            },
        },
    }
}
