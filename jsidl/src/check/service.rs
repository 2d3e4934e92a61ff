//! Rules for services: what is lost of them, what is declared twice, what a receiver cannot tell
//! apart.

use std::collections::HashMap;

use super::layout::same_message;
use crate::diagnostic::Report;
use crate::library::Library;
use crate::model::{Id, Service};
use crate::source::Span;
use crate::syntax::{Program, ServiceDef};

/// Says which messages a service has lost to errors.
pub(crate) fn incomplete(report: &mut Report, definition: &ServiceDef, lost: &[String]) {
    let lost: Vec<_> = lost
        .iter()
        .map(String::as_str)
        .filter(|name| !name.is_empty())
        .collect();
    if !lost.is_empty() {
        report.error(
            definition.span,
            format!(
                "`{}` is kept without `{}`, because of errors in what defines that: correct them",
                definition.id,
                lost.join("`, `"),
            ),
        );
    }
}

/// A service that is loaded twice should be the same both times; the first one counts.
pub(crate) fn same_service(
    report: &mut Report,
    definition: &ServiceDef,
    kept: &Service,
    other: &Service,
) {
    let same = kept.messages().count() == other.messages().count()
        && kept
            .messages()
            .zip(other.messages())
            .all(|(a, b)| same_message(a, b));
    if !same {
        report.warning(
            definition.span,
            format!(
                "`{}` is already declared, with other messages, in {}: the one there counts",
                definition.id, kept.location
            ),
        );
    }
}

/// A message code should mean one message to a service and those that it inherits from.
pub(crate) fn ambiguities(report: &mut Report, program: &Program, library: &Library) {
    let mut spans: HashMap<&Id, Span> = HashMap::new();
    for definition in &program.services {
        spans.entry(&definition.id).or_insert(definition.span);
    }
    for service in library.services() {
        let Some(&span) = spans.get(&service.id) else {
            continue;
        };
        ambiguous_codes(report, library, service, span);
        ambiguous_names(report, service, span);
    }
}

fn ambiguous_codes(report: &mut Report, library: &Library, service: &Service, span: Span) {
    for (index, message) in service.messages().enumerate() {
        let earlier = service.messages().take(index);
        let inherited = library.lineage(service).skip(1).flat_map(Service::messages);
        let mut others = earlier.chain(inherited);
        let other =
            others.find(|other| other.code == message.code && !same_message(other, message));
        if let Some(other) = other {
            let (name, other, code) = (&message.name, &other.name, message.code);
            let what = if name == other {
                format!("two different layouts of `{name}`")
            } else {
                format!("`{other}` and `{name}`")
            };
            report.warning(
                span,
                format!("the code {code:04X} stands for {what}: a receiver cannot tell them apart, so give one another `message_id`"),
            );
        }
    }
}

fn ambiguous_names(report: &mut Report, service: &Service, span: Span) {
    let mut codes: HashMap<&str, u16> = HashMap::new();
    for message in service.messages() {
        let code = *codes.entry(&message.name).or_insert(message.code);
        if code != message.code {
            let (name, other) = (&message.name, message.code);
            report.warning(
                span,
                format!("`{name}` names the messages {code:04X} and {other:04X}: rename one"),
            );
        }
    }
}
