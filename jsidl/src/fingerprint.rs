//! Fingerprints of messages and types: two definitions with the same fingerprint are the same, for
//! the wire, as a layout, or as a type. None covers position and prose.

use std::fmt::Write;

use crate::model::{
    Count, Group, Item, Meaning, Message, NamedValue, Number, Scalar, Shape, ValueSet,
};

/// Whether two messages have the same code, names and octets. Limits of counts, units and value sets
/// may differ.
pub(crate) fn same_on_wire(a: &Message, b: &Message) -> bool {
    let of = |message| sections(message, Detail::Wire);
    a.code == b.code && a.name == b.name && of(a) == of(b)
}

/// The same for the types of two fields.
pub(crate) fn same_shape_on_wire(a: &Shape, b: &Shape) -> bool {
    let of = |shape| {
        let mut text = String::new();
        shape_into(&mut text, shape, Detail::Wire);
        text
    };
    of(a) == of(b)
}

/// Fingerprint of a message's layout, names and scales: declarations with the same one share a
/// type. Units and named values may differ; those of the newest declaration are used.
pub(crate) fn layout(message: &Message) -> String {
    sections(message, Detail::Layout)
}

fn sections(message: &Message, detail: Detail) -> String {
    let mut text = String::new();
    let sections = [&message.header, &message.body, &message.footer];
    for section in sections {
        match section {
            Some(item) => item_into(&mut text, item, detail),
            None => text.push('-'),
        }
    }
    text
}

/// Fingerprint of a type: everything that is visible to users or on the wire.
pub(crate) fn content(shape: &Shape) -> String {
    let mut text = String::new();
    shape_into(&mut text, shape, Detail::All);
    text
}

/// As [`content`], for a number.
pub(crate) fn scalar(scalar: &Scalar) -> String {
    let mut text = String::new();
    scalar_into(&mut text, scalar, Detail::All);
    text
}

/// As [`content`], for named values.
pub(crate) fn values(number: Number, values: &[NamedValue], set: Option<&ValueSet>) -> String {
    let mut text = format!("{number:?}");
    values_into(&mut text, values);
    if let Some(set) = set {
        ranges_into(&mut text, set);
    }
    text
}

/// How much a fingerprint covers.
#[derive(Clone, Copy, PartialEq)]
enum Detail {
    /// Names, and what decides about the octets.
    Wire,
    /// Also the limits of counts, and the names and units of a measure's choices.
    Layout,
    /// Also units, named values and ranges.
    All,
}

fn item_into(text: &mut String, item: &Item, detail: Detail) {
    let optional = if item.optional { "?" } else { "" };
    push(text, format_args!("{}{optional}:", item.name));
    shape_into(text, &item.shape, detail);
    text.push(';');
}

fn shape_into(text: &mut String, shape: &Shape, detail: Detail) {
    match shape {
        Shape::Group(Group {
            presence, members, ..
        }) => {
            push(text, format_args!("group {presence:?} {{"));
            members
                .iter()
                .for_each(|member| item_into(text, member, detail));
            text.push('}');
        }
        Shape::List(list) => {
            count_into(text, list.count, detail);
            item_into(text, &list.element, detail);
        }
        Shape::Variant(variant) => {
            push(text, format_args!("variant {:?} {{", variant.tag));
            variant
                .alternatives
                .iter()
                .for_each(|item| item_into(text, item, detail));
            text.push('}');
        }
        Shape::Scalar(scalar) => scalar_into(text, scalar, detail),
        Shape::Bits(bits) => {
            push(text, format_args!("bits {:?} {{", bits.base));
            for field in &bits.fields {
                push(
                    text,
                    format_args!("{} {}..{}", field.name, field.from, field.to),
                );
                if detail == Detail::All {
                    values_into(text, &field.values.values);
                    ranges_into(text, &field.values);
                }
            }
            text.push('}');
        }
        Shape::FixedString { length } => push(text, format_args!("string {length}")),
        Shape::VariableString { count } => {
            text.push_str("string ");
            count_into(text, *count, detail);
        }
        Shape::Blob { count, .. } => {
            text.push_str("blob ");
            count_into(text, *count, detail);
        }
        Shape::FormattedBlob { formats, count } => {
            text.push_str("formatted ");
            count_into(text, *count, detail);
            if detail != Detail::Layout {
                formats
                    .iter()
                    .for_each(|f| push(text, format_args!("{}={},", f.index, f.name)));
            }
        }
        Shape::Measure { choices } => {
            text.push_str("measure {");
            for choice in choices {
                push(text, format_args!("{}:", choice.index));
                scalar_into(text, &choice.scalar, detail);
                if detail != Detail::Wire {
                    push(
                        text,
                        format_args!("{:?} {};", choice.name, choice.scalar.units),
                    );
                }
            }
            text.push('}');
        }
        Shape::Array(array) => {
            push(text, format_args!("array {:?} ", array.dimensions));
            item_into(text, &array.element, detail);
        }
    }
}

fn scalar_into(text: &mut String, scalar: &Scalar, detail: Detail) {
    push(text, format_args!("{:?} ", scalar.number));
    if let Meaning::Scaled(scale) = &scalar.meaning {
        push(text, format_args!("{scale:?} "));
    }
    if detail != Detail::All {
        return;
    }
    text.push_str(&scalar.units);
    if let Meaning::Values(set) = &scalar.meaning {
        values_into(text, &set.values);
        ranges_into(text, set);
    }
}

fn values_into(text: &mut String, values: &[NamedValue]) {
    values
        .iter()
        .for_each(|value| push(text, format_args!("{}={},", value.index, value.name)));
}

fn ranges_into(text: &mut String, set: &ValueSet) {
    set.ranges
        .iter()
        .for_each(|range| push(text, format_args!("{range},")));
}

fn count_into(text: &mut String, count: Count, detail: Detail) {
    push(text, format_args!("[{:?}", count.unsigned));
    if detail != Detail::Wire {
        push(text, format_args!(" {}..{}", count.min, count.max));
    }
    text.push_str("] ");
}

fn push(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    // Writing to a string does not fail.
    let _ = text.write_fmt(arguments);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Choice, Unsigned, ValueRange};

    /// A number with one range.
    fn ranged(lower_exclusive: bool) -> Shape {
        let range = ValueRange {
            lower: 0.0,
            upper: 9.0,
            lower_exclusive,
            upper_exclusive: false,
            interpretation: String::new(),
        };
        Shape::Scalar(Scalar {
            number: Number::Unsigned(Unsigned::U8),
            units: "one".to_owned(),
            meaning: Meaning::Values(ValueSet {
                ranges: vec![range],
                values: Vec::new(),
            }),
        })
    }

    #[test]
    fn an_excluded_limit_makes_another_type_with_the_same_octets() {
        let (with, without) = (ranged(false), ranged(true));
        assert!(same_shape_on_wire(&with, &without));
        assert_ne!(content(&with), content(&without));
    }

    #[test]
    fn limits_of_counts_and_names_of_choices_are_not_on_the_wire() {
        let string = |max| Shape::VariableString {
            count: Count {
                unsigned: Unsigned::U8,
                min: 0,
                max,
            },
        };
        assert!(same_shape_on_wire(&string(20), &string(30)));
        assert_ne!(content(&string(20)), content(&string(30)));
        let measure = |name: &str| Shape::Measure {
            choices: vec![Choice {
                index: 0,
                name: Some(name.to_owned()),
                scalar: Scalar {
                    number: Number::Unsigned(Unsigned::U8),
                    units: "meter".to_owned(),
                    meaning: Meaning::Plain,
                },
            }],
        };
        assert!(same_shape_on_wire(&measure("Near"), &measure("Far")));
        assert_ne!(content(&measure("Near")), content(&measure("Far")));
        assert!(!same_shape_on_wire(&string(20), &measure("Near")));
    }
}
