//! The readable report of a run, printed step by step, and its conclusion.

use std::time::Duration;

use bytes::Bytes;
use jaus_text::quoted;
use jaus_view::{Content, Dictionary, to_hex};

use super::step::Form;
use super::subject::Subject;
use super::verdict::{ObservedMessage, Proceeding, StepResult, Tally, Verdict};

/// Maximum characters of a message's text; lists of services can be long.
const LONGEST: usize = 400;

/// Formats the report, with colours on a terminal.
pub(super) struct Report<'d> {
    dictionary: &'d Dictionary,
    colours: bool,
}

/// Colours as terminal codes.
const GREEN: &str = "32";
const RED: &str = "31";
const GREY: &str = "90";

impl<'d> Report<'d> {
    pub(super) const fn new(dictionary: &'d Dictionary, colours: bool) -> Self {
        Self {
            dictionary,
            colours,
        }
    }

    /// The component under test.
    pub(super) fn subject(&self, subject: &Subject) -> Vec<String> {
        let name = subject.name.as_ref();
        // Quoted, so that control characters are escaped.
        let name = name.map_or(String::new(), |name| format!(" {name:?}"));
        let Some(services) = &subject.services else {
            let id = subject.id;
            return vec![format!(
                "{id}{name} does not list its services, so no step is skipped"
            )];
        };
        let mut lines = vec![format!("{}{name} offers", subject.id)];
        let service = |(urn, (major, minor)): (&String, &(u8, u8))| {
            format!("    {} {major}.{minor}", quoted(urn))
        };
        lines.extend(services.iter().map(service));
        lines
    }

    /// The heading of a form.
    pub(super) fn form(&self, form: Form) -> String {
        match form {
            Form::Multicast => "by multicast, to all components of the node".to_owned(),
            Form::Unicast => "by unicast, to the component".to_owned(),
        }
    }

    /// One step: a line, and its messages if it failed or if all are wanted.
    pub(super) fn step(&self, result: &StepResult, everything: bool) -> Vec<String> {
        let verdict = match result.verdict {
            Verdict::Passed => self.coloured(GREEN, "ok     "),
            Verdict::Failed(_) => self.coloured(RED, "failed "),
            Verdict::Skipped(_) | Verdict::LeftOut(_) => self.coloured(GREY, "skipped"),
        };
        let latencies = result.proceedings.iter().filter_map(|one| one.latency);
        let slowest = latencies
            .max()
            .map(|latency| format!("  {}", millis(latency)));
        let because = match &result.verdict {
            Verdict::Skipped(reason) | Verdict::LeftOut(reason) => format!("  ({reason})"),
            _ => String::new(),
        };
        let (name, title) = (result.name, &result.title);
        let slowest = slowest.unwrap_or_default();
        let mut lines = vec![format!("  {verdict}  {name:<3}  {title}{because}{slowest}")];
        let failed = matches!(result.verdict, Verdict::Failed(_));
        if failed || everything {
            let said = result.proceedings.iter();
            lines.extend(said.flat_map(|proceeding| self.proceeding(proceeding)));
        }
        if let Verdict::Failed(reason) = &result.verdict {
            let reason = quoted(reason);
            lines.push(format!(
                "{INDENT}{}    {reason}",
                self.coloured(RED, "reason")
            ));
        }
        lines
    }

    fn proceeding(&self, proceeding: &Proceeding) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some(said) = &proceeding.sent {
            lines.push(format!("{INDENT}sent      {}", self.said(said)));
        }
        for expected in &proceeding.expected {
            lines.push(format!("{INDENT}expected  {expected}"));
        }
        for said in &proceeding.received {
            lines.push(format!("{INDENT}received  {}", self.said(said)));
        }
        if let Some(latency) = proceeding.latency {
            lines.push(format!("{INDENT}in        {}", millis(latency)));
        }
        if let Some(measured) = &proceeding.measured {
            lines.push(format!("{INDENT}measured  {measured}"));
        }
        if proceeding.received.is_empty()
            && proceeding.measured.is_none()
            && proceeding.sent.is_some()
            && !proceeding.expected.is_empty()
        {
            lines.push(format!("{INDENT}received  nothing"));
        }
        lines
    }

    fn said(&self, said: &ObservedMessage) -> String {
        let ObservedMessage { from, to, octets } = said;
        format!("{from} -> {to}  {}", in_words(self.dictionary, octets))
    }

    /// The results and their meaning.
    pub(super) fn end(
        &self,
        subject: &Subject,
        tally: &Tally,
        against: &str,
        took: Duration,
    ) -> Vec<String> {
        let Tally {
            passed,
            failed,
            skipped,
            ..
        } = tally;
        let steps = tally.steps();
        let took = took.as_secs_f64();
        let mut lines = vec![String::new()];
        lines.push(format!(
            "{steps} steps in {took:.0} s: {passed} ok, {failed} failed, {skipped} skipped"
        ));
        if let Some((median, most)) = tally.latency() {
            let (median, most) = (millis(median), millis(most));
            lines.push(format!("answers took {median} (median), {most} (maximum)"));
        }
        lines.push(conclusion(subject, tally, against));
        lines
    }

    fn coloured(&self, colour: &str, text: &str) -> String {
        if self.colours {
            format!("\x1b[{colour}m{text}\x1b[0m")
        } else {
            text.to_owned()
        }
    }
}

const INDENT: &str = "           ";

/// The meaning of a run, in one sentence that promises no more than was tested.
pub(super) fn conclusion(subject: &Subject, tally: &Tally, against: &str) -> String {
    let id = subject.id;
    let steps = |number| {
        if number == 1 {
            "1 step".to_owned()
        } else {
            format!("{number} steps")
        }
    };
    if tally.failed > 0 {
        let failed = steps(tally.failed);
        return format!("{id} does not conform to {against} as tested: {failed} failed");
    }
    if tally.passed == 0 {
        return format!("no result for {id}: no step applies to its services");
    }
    let besides = |number, what: &str| match number {
        0 => String::new(),
        number => format!("; {} {what}", steps(number)),
    };
    let skipped = besides(
        tally.skipped - tally.left_out,
        "did not apply to its services",
    );
    let left_out = besides(tally.left_out, "left out");
    let passed = steps(tally.passed);
    format!("{id} conforms to {against} as tested: {passed} passed{skipped}{left_out}")
}

/// The name and fields of a message.
pub(super) fn in_words(dictionary: &Dictionary, octets: &Bytes) -> String {
    let line = dictionary.line(octets);
    let name = line.message.unwrap_or("unknown message");
    let content = match &line.content {
        Content::Body(body) => serde_json::to_string(body).unwrap_or_default(),
        Content::Unreadable { error, .. } => format!("{}, unreadable: {error}", to_hex(octets)),
        _ => to_hex(octets),
    };
    let mut shown = String::from(name);
    if content != "{}" && content != "null" {
        shown.push(' ');
        shown.push_str(&shortened(content));
    }
    shown
}

/// The beginning of a long text.
pub(super) fn shortened(text: String) -> String {
    let Some((end, _)) = text.char_indices().nth(LONGEST) else {
        return text;
    };
    format!("{}…", &text[..end])
}

/// Milliseconds, to a hundredth.
fn millis(time: Duration) -> String {
    format!("{:.2} ms", time.as_secs_f64() * 1e3)
}
