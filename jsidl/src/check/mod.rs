//! Rules for definitions: what cannot be encoded or is ambiguous is an error, unless published
//! definitions do it: then it is a warning.
//!
//! Each rule checks one construct, reports findings and returns whether the construct is sound.
//! Rules do not follow references.

mod behaviour;
mod composite;
mod field;
mod service;
mod triggers;

use std::collections::HashMap;

use crate::diagnostic::Report;
use crate::source::Span;
use crate::syntax::Node;

pub(crate) use behaviour::behaviour;
pub(crate) use composite::{array, count, count_limit, group, header, required, size, tag};
pub(crate) use field::{
    Placed, bits, enum_index, octet_index, overlap, scale, units, value_range, value_set,
    values_of_bits, values_of_number,
};
pub(crate) use service::{
    ambiguous_codes, ambiguous_names, declared_again, left_out, same_service,
};
pub(crate) use triggers::{Events, InternalEvent};

/// As [`Report::unique`], for fields and composites.
pub(crate) fn unique_names(report: &mut Report, what: &str, nodes: &[Node]) -> bool {
    report.unique(what, nodes.iter().map(|n| (n.name.as_str(), n.span)))
}

/// Indices must differ, because only they are on the wire. `what` is a plural.
pub(crate) fn unique_indices(
    report: &mut Report,
    what: &str,
    indices: impl Iterator<Item = (i128, Span)>,
) -> bool {
    let mut seen = HashMap::new();
    let mut sound = true;
    for (index, span) in indices {
        if let Some(first) = seen.insert(index, span) {
            report
                .error(
                    span,
                    format!("there are two {what} with the index {index}: renumber one"),
                )
                .note(first, "the other one");
            sound = false;
        }
    }
    sound
}
