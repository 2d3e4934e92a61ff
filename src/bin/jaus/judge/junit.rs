//! The run as JUnit XML, which build servers show: a suite for each form, a case for each step.

use std::fmt::Write as _;
use std::time::Duration;

use super::report::Report;
use super::step::Form;
use super::subject::Subject;
use super::verdict::{StepResult, Verdict};

/// The whole file.
pub(super) fn document(report: &Report<'_>, subject: &Subject, results: &[StepResult]) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let all: Vec<&StepResult> = results.iter().collect();
    let counts = counts(&all);
    element(
        &mut xml,
        0,
        &format!("<testsuites name=\"jaus judge\" {counts}>"),
    );
    for form in [Form::Multicast, Form::Unicast] {
        let of_form = results.iter().filter(|result| result.form == form);
        let of_form: Vec<_> = of_form.collect();
        if !of_form.is_empty() {
            suite(&mut xml, report, subject, form, &of_form);
        }
    }
    element(&mut xml, 0, "</testsuites>");
    xml
}

fn suite(
    xml: &mut String,
    report: &Report<'_>,
    subject: &Subject,
    form: Form,
    results: &[&StepResult],
) {
    let (name, counts) = (format!("{} {}", subject.id, form.name()), counts(results));
    element(xml, 1, &format!("<testsuite name=\"{name}\" {counts}>"));
    for result in results {
        case(xml, report, subject, result);
    }
    element(xml, 1, "</testsuite>");
}

fn case(xml: &mut String, report: &Report<'_>, subject: &Subject, result: &StepResult) {
    let name = escaped(&format!("{} {}", result.name, result.title));
    let class = format!("jaus.judge.{}.{}", subject.id, result.form.name());
    let took = seconds(result.took);
    let open = format!("<testcase name=\"{name}\" classname=\"{class}\" time=\"{took}\"");
    let reason = escaped(result.verdict.reason().unwrap_or_default());
    match result.verdict {
        Verdict::Passed => element(xml, 2, &format!("{open}/>")),
        Verdict::Skipped(_) => {
            element(xml, 2, &format!("{open}>"));
            element(xml, 3, &format!("<skipped message=\"{reason}\"/>"));
            element(xml, 2, "</testcase>");
        }
        Verdict::Failed(_) => {
            let proceedings = escaped(&report.step(result, true).join("\n"));
            element(xml, 2, &format!("{open}>"));
            let failure = format!("<failure message=\"{reason}\">{proceedings}</failure>");
            element(xml, 3, &failure);
            element(xml, 2, "</testcase>");
        }
    }
}

/// The attributes that a suite counts its cases with.
fn counts(results: &[&StepResult]) -> String {
    let number = |wanted: fn(&Verdict) -> bool| {
        let is_wanted = |result: &&&StepResult| wanted(&result.verdict);
        results.iter().filter(is_wanted).count()
    };
    let failed = number(|verdict| matches!(verdict, Verdict::Failed(_)));
    let skipped = number(|verdict| matches!(verdict, Verdict::Skipped(_)));
    let took = seconds(results.iter().map(|result| result.took).sum());
    format!(
        "tests=\"{}\" failures=\"{failed}\" errors=\"0\" skipped=\"{skipped}\" time=\"{took}\"",
        results.len()
    )
}

fn seconds(time: Duration) -> String {
    format!("{:.3}", time.as_secs_f64())
}

fn element(xml: &mut String, depth: usize, text: &str) {
    // Writing into a string cannot fail.
    let _ = writeln!(xml, "{:indent$}{text}", "", indent = 2 * depth);
}

/// Text as XML may hold it: peers choose their names, and XML forbids most control characters.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '&' => escaped.push_str("&amp;"),
            '"' => escaped.push_str("&quot;"),
            '\n' | '\t' => escaped.push(character),
            _ if character.is_control() || matches!(character, '\u{FFFE}' | '\u{FFFF}') => {
                escaped.push('\u{FFFD}');
            }
            _ => escaped.push(character),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_peer_calls_itself_does_not_break_the_file() {
        assert_eq!(
            escaped("<Rover & \"Co\">\u{1b}[31m\n"),
            "&lt;Rover &amp; &quot;Co&quot;&gt;\u{FFFD}[31m\n"
        );
    }
}
