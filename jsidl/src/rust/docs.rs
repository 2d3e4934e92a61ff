//! Generates documentation from the definition.

use super::types::{Field, Type};
use crate::model::{Count, Item, Meaning, Scalar, Shape, ValueRange, ValueSet};

/// Escapes text of a definition for Markdown.
pub(super) fn prose(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for word in text.split_whitespace() {
        if !escaped.is_empty() {
            escaped.push(' ');
        }
        if word.contains("://") {
            escaped.push_str(&format!("<{word}>"));
            continue;
        }
        for c in word.chars() {
            if matches!(
                c,
                '[' | ']' | '<' | '>' | '*' | '_' | '`' | '\\' | '#' | '|'
            ) {
                escaped.push('\\');
            }
            escaped.push(c);
        }
    }
    escaped
}

/// The first paragraph of a field's documentation: name, unit, range, limits, and its bit in the
/// presence vector.
pub(super) fn field(field: &Field<'_>, bit: Option<usize>) -> String {
    let mut facts = facts(&field.item.shape, &field.ty);
    facts.extend(bit.map(|bit| format!("bit {bit} of the presence vector")));
    if facts.is_empty() {
        format!("`{}`.", field.item.name)
    } else {
        format!("`{}`: {}.", field.item.name, facts.join(", "))
    }
}

/// The definition's statements about values of a shape.
fn facts(shape: &Shape, ty: &Type) -> Vec<String> {
    match shape {
        Shape::Scalar(scalar) => scalar_facts(scalar),
        Shape::List(list) => vec![format!("{} elements", limits(list.count))],
        Shape::VariableString { count } => vec![format!("{} octets of text", limits(*count))],
        Shape::FixedString { length } => vec![format!("at most {length} octets of text")],
        Shape::Blob { count, format } if format.is_empty() => vec![octets(*count)],
        Shape::Blob { count, format } => vec![octets(*count), prose(format)],
        Shape::FormattedBlob { count, .. } => vec![octets(*count)],
        Shape::Array(array) => match ty {
            Type::Array { element, .. } => facts(&array.element.shape, element),
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}

fn octets(count: Count) -> String {
    format!("{} octets", limits(count))
}

fn limits(count: Count) -> String {
    match (count.min, count.max) {
        (0, max) if max == count.unsigned.max() => format!("up to {max}"),
        (0, max) => format!("at most {max}"),
        (min, max) if min == max => format!("{min}"),
        (min, max) => format!("{min} to {max}"),
    }
}

/// Unit, range and step of a number.
pub(super) fn scalar_facts(scalar: &Scalar) -> Vec<String> {
    let mut facts = Vec::new();
    if scalar.units != "one" && !scalar.units.is_empty() {
        facts.push(prose(&scalar.units));
    }
    match &scalar.meaning {
        Meaning::Plain => {}
        Meaning::Scaled(scale) => facts.push(format!("{} to {}", scale.lower, scale.upper)),
        Meaning::Values(set) => facts.extend(ranges(set)),
    }
    facts
}

/// The ranges of a value set.
pub(super) fn ranges(set: &ValueSet) -> Option<String> {
    let range = |range: &ValueRange| {
        let meaning = match prose(&range.interpretation) {
            text if text.is_empty() => text,
            text => format!(" ({})", text.trim_end_matches('.')),
        };
        format!("{range}{meaning}")
    };
    let ranges: Vec<_> = set.ranges.iter().map(range).collect();
    (!ranges.is_empty()).then(|| ranges.join(" or "))
}

/// The facts about a part of a message and the author's text, as one paragraph.
pub(super) fn joined(facts: &str, text: &str) -> String {
    match text.is_empty() {
        true => facts.to_owned(),
        false => format!("{facts} {text}"),
    }
}

/// The author's text about an item.
pub(super) fn interpretation(item: &Item) -> String {
    prose(&item.interpretation)
}
