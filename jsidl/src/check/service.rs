//! Rules for services: lost messages, duplicate declarations, ambiguous codes and names.

use std::collections::HashMap;

use crate::diagnostic::Report;
use crate::fingerprint::same_on_wire;
use crate::library::Library;
use crate::model::{Message, Service};
use crate::source::Span;
use crate::syntax::{Declaration, ServiceDef};

/// Reports that a service has lost a message because of an error elsewhere.
pub(crate) fn left_out(report: &mut Report, service: &ServiceDef, message: &Declaration) {
    report.error(
        message.span,
        format!(
            "`{}` is omitted from `{}`, because a definition it refers to is missing or has errors",
            message.name, service.id
        ),
    );
}

/// Two copies of a service should be identical; the first one counts.
pub(crate) fn same_service(
    report: &mut Report,
    definition: &ServiceDef,
    first: &Service,
    other: &Service,
) {
    let same = first.inputs.len() == other.inputs.len()
        && first.outputs.len() == other.outputs.len()
        && first
            .messages()
            .zip(other.messages())
            .all(|(a, b)| same_on_wire(a, b));
    if !same {
        report.warning(
            definition.span,
            format!(
                "`{}` is declared with other messages at {}, which takes precedence because it \
                 was loaded first",
                definition.id, first.location
            ),
        );
    }
}

/// A code should identify one message in a service and its bases.
pub(crate) fn ambiguous_codes(
    report: &mut Report,
    library: &Library,
    service: &Service,
    places: &[Span],
) {
    let mut known: HashMap<u16, &Message> = HashMap::new();
    for inherited in library.lineage(service).skip(1).flat_map(Service::messages) {
        known.entry(inherited.code).or_insert(inherited);
    }
    for (message, &place) in service.messages().zip(places) {
        let other = *known.entry(message.code).or_insert(message);
        if same_on_wire(other, message) {
            continue;
        }
        let (name, code) = (&message.name, message.code);
        let other = if other.name == *name {
            format!("another `{name}` with a different layout")
        } else {
            format!("`{}`", other.name)
        };
        report.warning(
            place,
            format!(
                "`{name}` has the code {code:04X}, which is also that of {other}: a \
                 receiver cannot tell them apart, so change one `message_id`"
            ),
        );
    }
}

/// A service inherits the messages of its bases, so it should not declare them again.
pub(crate) fn declared_again(
    report: &mut Report,
    library: &Library,
    service: &Service,
    places: &[Span],
) {
    let mut inherited: HashMap<&str, &Service> = HashMap::new();
    for base in library.lineage(service).skip(1) {
        for message in base.messages() {
            inherited.entry(&message.name).or_insert(base);
        }
    }
    for (message, &place) in service.messages().zip(places) {
        if let Some(base) = inherited.get(message.name.as_str()) {
            let name = &message.name;
            let message = format!(
                "`{name}` is declared again: the service inherits it from `{}`, so remove it here",
                base.id
            );
            report.warning(place, message);
        }
    }
}

/// A name should identify one message in a service.
pub(crate) fn ambiguous_names(report: &mut Report, service: &Service, places: &[Span]) {
    let mut codes: HashMap<&str, u16> = HashMap::new();
    for (message, &place) in service.messages().zip(places) {
        let (name, code) = (&message.name, message.code);
        let other = *codes.entry(name).or_insert(code);
        if other != code {
            report.warning(
                place,
                format!(
                    "`{name}` is also the name of the message {other:04X} in this service: \
                     rename one"
                ),
            );
        }
    }
}
