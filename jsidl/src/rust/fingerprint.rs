//! Fingerprints of types: two definitions with the same fingerprint are one type. They cover
//! everything visible to users or on the wire, but not position and prose.

use std::fmt::Write;

use crate::model::{
    Count, Group, Item, Meaning, Message, NamedValue, Number, Scalar, Shape, ValueSet,
};

/// Fingerprint of a message's layout, names and scales: declarations with the same one share a
/// type. Units and named values may differ; those of the newest declaration are used.
pub(super) fn layout(message: &Message) -> String {
    let mut text = String::new();
    let sections = [&message.header, &message.body, &message.footer];
    for section in sections {
        match section {
            Some(item) => item_into(&mut text, item, Detail::Layout),
            None => text.push('-'),
        }
    }
    text
}

/// Fingerprint of a type.
pub(super) fn content(shape: &Shape) -> String {
    let mut text = String::new();
    shape_into(&mut text, shape, Detail::All);
    text
}

/// As [`content`], for a number.
pub(super) fn scalar(scalar: &Scalar) -> String {
    let mut text = String::new();
    scalar_into(&mut text, scalar, Detail::All);
    text
}

/// As [`content`], for named values.
pub(super) fn values(number: Number, values: &[NamedValue], set: Option<&ValueSet>) -> String {
    let mut text = format!("{number:?}");
    values_into(&mut text, values);
    if let Some(set) = set {
        ranges_into(&mut text, set);
    }
    text
}

#[derive(Clone, Copy, PartialEq)]
enum Detail {
    Layout,
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
            count_into(text, list.count);
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
            count_into(text, *count);
        }
        Shape::Blob { count, .. } => {
            text.push_str("blob ");
            count_into(text, *count);
        }
        Shape::FormattedBlob { formats, count } => {
            text.push_str("formatted ");
            count_into(text, *count);
            if detail == Detail::All {
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
                push(
                    text,
                    format_args!("{:?} {};", choice.name, choice.scalar.units),
                );
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
    if detail == Detail::Layout {
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
        .for_each(|range| push(text, format_args!("{}..{},", range.lower, range.upper)));
}

fn count_into(text: &mut String, count: Count) {
    push(
        text,
        format_args!("[{:?} {}..{}] ", count.unsigned, count.min, count.max),
    );
}

fn push(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    // Writing to a string does not fail.
    let _ = text.write_fmt(arguments);
}
