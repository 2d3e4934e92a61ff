//! Steps that a known implementation does not survive: the warning before the first step.

use jaus::peer::Certainty;

use super::step::Step;
use super::subject::Subject;

/// Names the steps to run that would end the subject's process, and how to leave them out; `None`
/// if there are none.
pub(super) fn warning<'s>(
    subject: &Subject,
    steps: impl IntoIterator<Item = &'s Step>,
) -> Option<String> {
    let implementation = &subject.implementation;
    let peer = implementation.peer;
    let is_fatal = |step: &&Step| {
        subject.lacks(&step.needs).is_none() && step.codes().any(|code| peer.crashes_on(code))
    };
    let fatal = steps.into_iter().filter(is_fatal);
    let names: Vec<_> = fatal.map(|step| step.name.to_string()).collect();
    if names.is_empty() {
        return None;
    }
    let is = match implementation.certainty {
        Certainty::Certain => "is",
        Certainty::Likely => "is probably",
        Certainty::Guess | Certainty::Unknown => "may be",
    };
    let reasons = implementation.reasons.iter();
    let reasons = reasons.filter(|sign| sign.peer() == peer);
    let reasons: Vec<_> = reasons.map(ToString::to_string).collect();
    Some(format!(
        "{} {is} {} ({}), whose process ends at a message of {}: to leave that out, run the judge \
         with --skip {}",
        subject.id,
        peer.title(),
        reasons.join("; "),
        names.join(" and "),
        names.join(","),
    ))
}
