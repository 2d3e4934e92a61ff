//! Rules for headers, records, sequences, lists, variants and arrays.

use crate::diagnostic::Report;
use crate::model::{Count, Group, GroupKind, Item, Meaning, Number, Shape, Unsigned};
use crate::source::{Span, Spanned};
use crate::syntax::{CountField, Node};

/// Maximum octets of a fixed length string, or of the smallest content of an array. No transport carries more in
/// one message with reasonable effort, and a decoder must not be tricked into allocating gigabytes.
const LARGEST: u32 = 1 << 20;

/// The usual header is one record with one field, the message code. Returns the fields that follow
/// the code, if any.
///
/// # Errors
/// A sentence, if the message does not begin with its code.
pub(crate) fn header(header: Option<&Item>) -> Result<Option<Item>, String> {
    let advice = "a message starts with its code, so the header must be a `record` whose first \
        field is an `unsigned short integer`";
    let Some(item) = header else {
        return Err(format!("the header is empty: {advice}"));
    };
    let Shape::Group(group) = &item.shape else {
        return Err(format!("the header is not a record: {advice}"));
    };
    if group.presence.is_some() {
        return Err(format!(
            "the header starts with a presence vector: {advice}"
        ));
    }
    match group.members.split_first() {
        Some((first, rest)) if is_code(first) => Ok((!rest.is_empty()).then(|| Item {
            shape: Shape::Group(Group {
                kind: group.kind,
                presence: None,
                members: rest.to_vec(),
            }),
            ..item.clone()
        })),
        _ => Err(format!(
            "the header does not start with the message code: {advice}"
        )),
    }
}

fn is_code(item: &Item) -> bool {
    matches!(&item.shape, Shape::Scalar(scalar)
        if scalar.number == Number::Unsigned(Unsigned::U16)
            && !matches!(scalar.meaning, Meaning::Scaled(_)))
}

/// A presence vector exists exactly if a member is optional, and has a bit for each.
pub(crate) fn group(
    report: &mut Report,
    node: &Node,
    kind: GroupKind,
    presence: Option<Spanned<Unsigned>>,
    nodes: &[Node],
    members: &[Item],
) -> bool {
    let kind = match kind {
        GroupKind::Record => "record",
        GroupKind::Sequence => "sequence",
    };
    let name = &node.name;
    if members.is_empty() {
        report.error(
            node.span,
            format!("the {kind} `{name}` has no members: add one, or remove the {kind}"),
        );
        return false;
    }
    let optional = members.iter().filter(|member| member.optional).count();
    let Some(presence) = presence else {
        let Some(first) = members.iter().position(|member| member.optional) else {
            return true;
        };
        report.error(
            nodes[first].span,
            format!(
                "`{}` is optional, but the {kind} `{name}` has no `presence_vector`: add \
                 one, or set `optional=\"false\"`",
                members[first].name
            ),
        );
        return false;
    };
    let bits = presence.value.size() * 8;
    if optional == 0 {
        report.error(
            presence.span,
            format!(
                "the {kind} `{name}` has a `presence_vector` but no optional member: remove it"
            ),
        );
    } else if optional > bits {
        report.error(
            presence.span,
            format!(
                "the {kind} `{name}` has {optional} optional members, but its \
                 `presence_vector` has only {bits} bits: use a wider `field_type_unsigned`"
            ),
        );
    }
    (1..=bits).contains(&optional)
}

/// Only members of records and sequences may be optional. Items with other errors (`None`) are
/// judged by their syntax.
pub(crate) fn required(report: &mut Report, what: &str, node: &Node, item: Option<&Item>) -> bool {
    let optional = item.map_or(node.optional == Some(true), |item| item.optional);
    if optional {
        report.error(
            node.span,
            format!(
                "`{}` is optional, but {what} has no presence vector: set `optional=\"false\"`",
                node.name
            ),
        );
    }
    !optional
}

/// The limits of a count are representable in its type.
pub(crate) fn count_limit(
    report: &mut Report,
    span: Span,
    attribute: &str,
    value: i128,
    unsigned: Unsigned,
) -> Option<u64> {
    let most = unsigned.max();
    let limit = u64::try_from(value).ok().filter(|&limit| limit <= most);
    if limit.is_none() {
        report.error(
            span,
            format!(
                "`{attribute}` is {value}, but the count can be 0 to {most}: change it, or \
                 use another `field_type_unsigned`"
            ),
        );
    }
    limit
}

/// The minimum count does not exceed the maximum.
pub(crate) fn count(report: &mut Report, span: Span, count: Count) -> Option<Count> {
    if count.min <= count.max {
        return Some(count);
    }
    report.error(
        span,
        format!(
            "`min_count` is {}, which is more than `max_count`, {}: no count is allowed",
            count.min, count.max
        ),
    );
    None
}

/// The tag of a variant can represent every alternative, from 0.
pub(crate) fn tag(
    report: &mut Report,
    tag: &CountField,
    range: Count,
    alternatives: usize,
) -> bool {
    let codes = range.max.saturating_add(1);
    let needed = alternatives as u64;
    if range.min > 0 {
        report.error(
            tag.span,
            format!(
                "`min_count` is {}, but the first alternative of a variant has the tag 0: \
                 set it to 0",
                range.min
            ),
        );
        return false;
    }
    if needed > codes {
        report.error(
            tag.span,
            format!(
                "the variant has {needed} alternatives, but its tag ends at {}: raise \
                 `max_count` or use a wider type",
                range.max
            ),
        );
        return false;
    }
    true
}

/// A fixed size is positive and limited.
pub(crate) fn size(report: &mut Report, span: Span, attribute: &str, value: i128) -> Option<u32> {
    let size = u32::try_from(value)
        .ok()
        .filter(|size| (1..=LARGEST).contains(size));
    if size.is_none() {
        report.error(
            span,
            format!("`{attribute}` is {value}, but must be from 1 to {LARGEST}"),
        );
    }
    size
}

/// The octets of all elements are limited, too.
pub(crate) fn array(report: &mut Report, span: Span, dimensions: &[u32], element: &Item) -> bool {
    let octets = dimensions
        .iter()
        .fold(least(&element.shape), |octets, &size| {
            octets.saturating_mul(size.into())
        });
    let small = octets <= LARGEST.into();
    if !small {
        report.error(
            span,
            format!(
                "the array has at least {octets} octets, but must not have more than {LARGEST}: use \
                 a `list` or a `variable_length_field` for bulk data"
            ),
        );
    }
    small
}

/// The octets of the smallest value.
fn least(shape: &Shape) -> u64 {
    let size = |unsigned: Unsigned| unsigned.size() as u64;
    let number = |number: Number| number.size() as u64;
    let counted = |count: &Count| count.min.saturating_add(size(count.unsigned));
    let smallest = |sizes: &mut dyn Iterator<Item = u64>| sizes.min().unwrap_or(0);
    match shape {
        Shape::Scalar(scalar) => number(scalar.number),
        Shape::Bits(bits) => size(bits.base),
        Shape::FixedString { length } => (*length).into(),
        Shape::VariableString { count } | Shape::Blob { count, .. } => counted(count),
        Shape::FormattedBlob { count, .. } => counted(count).saturating_add(1),
        Shape::Measure { choices } => {
            1 + smallest(&mut choices.iter().map(|it| number(it.scalar.number)))
        }
        Shape::Group(group) => {
            let required = group.members.iter().filter(|member| !member.optional);
            let sizes = required.map(|member| least(&member.shape));
            sizes.fold(group.presence.map_or(0, size), u64::saturating_add)
        }
        Shape::List(list) => {
            let elements = list.count.min.saturating_mul(least(&list.element.shape));
            elements.saturating_add(size(list.count.unsigned))
        }
        Shape::Variant(variant) => {
            let alternatives = variant.alternatives.iter();
            smallest(&mut alternatives.map(|it| least(&it.shape))).saturating_add(size(variant.tag))
        }
        Shape::Array(array) => array
            .dimensions
            .iter()
            .fold(least(&array.element.shape), |octets, &length| {
                octets.saturating_mul(length.into())
            }),
    }
}
