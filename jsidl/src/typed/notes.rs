//! Documentation of types and members, as plain text.

use super::Plan;
use super::lines::is_misleading;
use super::types::{Field, Kind};
use crate::model::{
    Count, Item, Meaning, NamedValue, Scalar, Shape, SubField, Unsigned, ValueRange, ValueSet,
};

/// The paragraphs about a message.
pub(crate) fn message(plan: &Plan<'_>) -> Vec<String> {
    let message = plan.message;
    let kind = if message.is_command {
        ", a command"
    } else {
        ""
    };
    let services: Vec<_> = plan.services.iter().map(ToString::to_string).collect();
    let mut notes = vec![format!("{} ({:04X}h){kind}.", message.name, message.code)];
    notes.extend(text(&message.description));
    notes.push(format!("Declared by {}.", services.join(", ")));
    notes
}

/// The paragraphs about a nested type.
pub(crate) fn definition(kind: &Kind<'_>) -> Vec<String> {
    let (first, item): (String, Option<&Item>) = match kind {
        Kind::Group { item, .. } => (format!("{}.", item.name), Some(item)),
        Kind::Variant { item, .. } => (
            format!("{}: one of its alternatives.", item.name),
            Some(item),
        ),
        Kind::Measure { item, .. } => (
            format!(
                "{}: a number whose type and unit are chosen by an index.",
                item.name
            ),
            Some(item),
        ),
        Kind::Scaled {
            name,
            number,
            scale,
            units,
        } => (
            format!(
                "{name}{}: {} to {}, carried in {} octets.",
                in_units(units),
                scale.lower,
                scale.upper,
                number.size()
            ),
            None,
        ),
        Kind::Named { name, set, .. } => {
            let ranges = set.and_then(ranges);
            let ranges = ranges.map_or_else(String::new, |it| format!(" Without a name: {it}."));
            let first =
                format!("{name}: a number with named values. Others are preserved.{ranges}");
            (first, None)
        }
        Kind::Bits { item, bits, .. } => (
            format!(
                "{}: several numbers in one integer of {} octets. Other bits are preserved.",
                item.name,
                bits.base.size()
            ),
            Some(item),
        ),
    };
    let mut notes = vec![first];
    notes.extend(item.and_then(|item| text(&item.interpretation)));
    if let Kind::Measure { choices, .. } = kind {
        let choices = choices.iter().map(|it| it.choice);
        notes.extend(choices.map(|it| choice(it.index, &it.scalar)));
    }
    notes
}

/// The paragraphs about each member of a group, with the bits of its presence vector.
pub(crate) fn members(fields: &[Field<'_>]) -> Vec<Vec<String>> {
    let mut bits = 0..;
    let notes = fields.iter().map(|field| {
        let mut facts = facts(&field.item.shape);
        if field.item.optional {
            let bit = bits.next().unwrap_or(0);
            facts.push(format!("bit {bit} of the presence vector"));
        }
        described(field.name, &facts, field.item)
    });
    notes.collect()
}

/// The paragraphs about an item that is no member, such as the element of a list.
pub(crate) fn item(item: &Item) -> Vec<String> {
    described(&item.name, &facts(&item.shape), item)
}

fn described(name: &str, facts: &[String], item: &Item) -> Vec<String> {
    let mut notes = vec![stated(name, facts)];
    notes.extend(text(&item.interpretation));
    notes
}

/// The accessor of a member in its unit.
pub(crate) fn accessor(field: &Field<'_>) -> String {
    let units = match &field.item.shape {
        Shape::Scalar(scalar) => in_units(&scalar.units),
        _ => String::new(),
    };
    format!("{}{units}.", field.name)
}

/// The paragraphs about a sub-field.
pub(crate) fn part(field: &SubField, limits: (u64, u64)) -> Vec<String> {
    let place = if field.from == field.to {
        format!("bit {}", field.from)
    } else {
        format!("bits {} to {}", field.from, field.to)
    };
    let range = format!("{} to {}", limits.0, limits.1);
    let mut notes = vec![stated(&field.name, &[place, range])];
    notes.extend(text(&field.interpretation));
    notes
}

/// The paragraphs about a named value.
pub(crate) fn value(value: &NamedValue) -> Vec<String> {
    let mut notes = vec![stated(&value.name, &[])];
    notes.extend(text(&value.interpretation));
    notes
}

/// Unit and range of a choice.
pub(crate) fn choice(index: u8, scalar: &Scalar) -> String {
    stated(&format!("Index {index}"), &scalar_facts(scalar))
}

fn stated(name: &str, facts: &[String]) -> String {
    let name = one_line(name);
    if facts.is_empty() {
        format!("{name}.")
    } else {
        format!("{name}: {}.", facts.join(", "))
    }
}

fn in_units(units: &str) -> String {
    if units == "one" || units.is_empty() {
        String::new()
    } else {
        format!(" in {}", one_line(units))
    }
}

/// The author's text, if there is one.
fn text(text: &str) -> Option<String> {
    let text = one_line(text);
    (!text.is_empty()).then_some(text)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// What the definition states about values of a shape.
fn facts(shape: &Shape) -> Vec<String> {
    match shape {
        Shape::Scalar(scalar) => scalar_facts(scalar),
        Shape::List(list) => vec![format!("{} elements", limits(list.count))],
        Shape::FixedString { length } => vec![format!("at most {length} octets of text")],
        Shape::VariableString { count } => vec![format!("{} octets of text", limits(*count))],
        Shape::Blob { count, format } => {
            let mut facts = vec![format!("{} octets", limits(*count))];
            facts.extend(text(format));
            facts
        }
        Shape::FormattedBlob { count, .. } => vec![format!("{} octets", limits(*count))],
        Shape::Array(array) => {
            let sizes: Vec<_> = array.dimensions.iter().map(u32::to_string).collect();
            let mut facts = vec![format!("{} elements", sizes.join(" by "))];
            facts.extend(self::facts(&array.element.shape));
            facts
        }
        _ => Vec::new(),
    }
}

fn scalar_facts(scalar: &Scalar) -> Vec<String> {
    let units = one_line(&scalar.units);
    let mut facts = Vec::new();
    if units != "one" && !units.is_empty() {
        facts.push(units);
    }
    match &scalar.meaning {
        Meaning::Plain => {}
        Meaning::Scaled(scale) => facts.push(format!("{} to {}", scale.lower, scale.upper)),
        Meaning::Values(set) => facts.extend(ranges(set)),
    }
    facts
}

fn ranges(set: &ValueSet) -> Option<String> {
    let range = |range: &ValueRange| match text(&range.interpretation) {
        None => range.to_string(),
        Some(meaning) => format!("{range} ({})", meaning.trim_end_matches('.')),
    };
    let ranges: Vec<_> = set.ranges.iter().map(range).collect();
    (!ranges.is_empty()).then(|| ranges.join(" or "))
}

fn limits(count: Count) -> String {
    match (count.min, count.max) {
        (0, max) if max == Unsigned::max(count.unsigned) => format!("up to {max}"),
        (0, max) => format!("at most {max}"),
        (min, max) if min == max => min.to_string(),
        (min, max) => format!("{min} to {max}"),
    }
}

/// Wraps paragraphs into the lines of a block comment, blank lines between them.
pub(crate) fn wrapped(paragraphs: &[String], width: usize) -> Vec<String> {
    let mut lines = Vec::new();
    for paragraph in paragraphs {
        if !lines.is_empty() {
            lines.push(String::new());
        }
        let mut line = String::new();
        for word in paragraph.split_whitespace() {
            let word = word.replace(is_misleading, "");
            if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > width {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(&word);
        }
        lines.push(line);
    }
    lines
}
