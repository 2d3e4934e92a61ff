//! Results of tests as JUnit XML, for build servers.

use std::fmt::Write as _;
use std::time::Duration;

use jaus_text::is_unprintable;

/// A group of test cases.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Suite {
    /// Name of the suite.
    pub name: String,
    /// Cases in execution order.
    pub cases: Vec<Case>,
}

/// A test case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// Name of the case.
    pub name: String,
    /// Class for sorting, in parts separated by dots.
    pub class: String,
    /// Duration.
    pub took: Duration,
    /// Result.
    pub result: CaseResult,
}

/// Result of a test case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CaseResult {
    /// Passed, with what was observed, if that is of interest.
    Passed(Option<String>),
    /// Skipped, for this reason.
    Skipped(String),
    /// Failed.
    Failed {
        /// The reason, in one line.
        reason: String,
        /// The proceedings, in any number of lines; may be empty.
        details: String,
    },
}

/// The whole document.
#[must_use]
pub fn document(name: &str, suites: &[Suite]) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let counts = counts(suites.iter().flat_map(|suite| &suite.cases));
    let name = escaped(name);
    element(
        &mut xml,
        0,
        &format!("<testsuites name=\"{name}\" {counts}>"),
    );
    suites.iter().for_each(|one| suite(&mut xml, one));
    element(&mut xml, 0, "</testsuites>");
    xml
}

fn suite(xml: &mut String, suite: &Suite) {
    let (name, counts) = (escaped(&suite.name), counts(&suite.cases));
    element(xml, 1, &format!("<testsuite name=\"{name}\" {counts}>"));
    suite.cases.iter().for_each(|one| case(xml, one));
    element(xml, 1, "</testsuite>");
}

fn case(xml: &mut String, case: &Case) {
    let (name, class) = (escaped(&case.name), escaped(&case.class));
    let took = seconds(case.took);
    let open = format!("<testcase name=\"{name}\" classname=\"{class}\" time=\"{took}\"");
    let inside = match &case.result {
        CaseResult::Passed(None) => return element(xml, 2, &format!("{open}/>")),
        CaseResult::Passed(Some(observed)) => {
            format!("<system-out>{}</system-out>", escaped(observed))
        }
        CaseResult::Skipped(reason) => format!("<skipped message=\"{}\"/>", escaped(reason)),
        CaseResult::Failed { reason, details } if details.is_empty() => {
            format!("<failure message=\"{}\"/>", escaped(reason))
        }
        CaseResult::Failed { reason, details } => format!(
            "<failure message=\"{}\">{}</failure>",
            escaped(reason),
            escaped(details)
        ),
    };
    element(xml, 2, &format!("{open}>"));
    element(xml, 3, &inside);
    element(xml, 2, "</testcase>");
}

/// The attributes with the case counts of a suite.
fn counts<'c>(cases: impl IntoIterator<Item = &'c Case>) -> String {
    let (mut all, mut failed, mut skipped, mut took) = (0, 0, 0, Duration::ZERO);
    for case in cases {
        all += 1;
        took += case.took;
        match case.result {
            CaseResult::Passed(_) => {}
            CaseResult::Skipped(_) => skipped += 1,
            CaseResult::Failed { .. } => failed += 1,
        }
    }
    let took = seconds(took);
    format!(
        "tests=\"{all}\" failures=\"{failed}\" errors=\"0\" skipped=\"{skipped}\" time=\"{took}\""
    )
}

fn seconds(time: Duration) -> String {
    format!("{:.3}", time.as_secs_f64())
}

fn element(xml: &mut String, depth: usize, text: &str) {
    // Writing into a string cannot fail.
    let _ = writeln!(xml, "{:indent$}{text}", "", indent = 2 * depth);
}

/// Escapes text for XML: peers choose their names, and XML forbids most control characters. What
/// does not show itself is an escape such as `\u{1b}`.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '&' => escaped.push_str("&amp;"),
            '"' => escaped.push_str("&quot;"),
            '\n' | '\t' => escaped.push(character),
            _ if is_unprintable(character) => escaped.extend(character.escape_unicode()),
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
            "&lt;Rover &amp; &quot;Co&quot;&gt;\\u{1b}[31m\n"
        );
    }

    #[test]
    fn a_file_counts_what_passed_what_failed_and_what_was_skipped() {
        let case = |result| Case {
            name: "a step".into(),
            class: "jaus".into(),
            took: Duration::from_millis(250),
            result,
        };
        let suite = Suite {
            name: "one".into(),
            cases: vec![
                case(CaseResult::Passed(Some("5 > 4 Hz".into()))),
                case(CaseResult::Skipped("not offered".into())),
                case(CaseResult::Failed {
                    reason: "silence".into(),
                    details: "asked > heard nothing".into(),
                }),
            ],
        };
        let xml = document("run", &[suite]);
        let counts = "tests=\"3\" failures=\"1\" errors=\"0\" skipped=\"1\" time=\"0.750\"";
        assert!(
            xml.contains(&format!("<testsuites name=\"run\" {counts}>")),
            "{xml}"
        );
        assert!(
            xml.contains(&format!("<testsuite name=\"one\" {counts}>")),
            "{xml}"
        );
        assert!(xml.contains("<failure message=\"silence\">asked &gt; heard nothing</failure>"));
        assert!(xml.contains("<skipped message=\"not offered\"/>"));
        assert!(xml.contains("<system-out>5 &gt; 4 Hz</system-out>"));
    }
}
