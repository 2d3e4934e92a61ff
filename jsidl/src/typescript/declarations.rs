//! Writes the declaration file of a set.

use super::{introduction, newest, path, quoted};
use crate::model::{Number, Signed, Unsigned};
use crate::typed::lines::Lines;
use crate::typed::names::version;
use crate::typed::types::{Definition, Field, Kind, Type};
use crate::typed::{Plan, Set, notes};

/// The declarations of a set's module.
pub(super) fn module(set: &Set<'_>) -> String {
    let mut out = Lines::new("  ");
    out.line(introduction(set));
    out.line("");
    out.line("import * as codec from \"./codec.js\";");
    for number in set.versions() {
        out.line("");
        out.open(format!("export namespace {} {{", version(number)));
        for (plan, ident) in set.shared_in(number) {
            out.line(format!("export import {ident} = {};", path(plan)));
        }
        for plan in set.defined_in(number) {
            message(&mut out, plan);
        }
        out.close("}");
    }
    out.line("");
    for (plan, ident) in newest(set) {
        out.line(format!("export import {ident} = {};", path(plan)));
    }
    out.line("");
    out.line("/** The types of all messages, older versions first. */");
    out.line("export const messages: readonly codec.MessageType[];");
    out.finish()
}

fn message(out: &mut Lines, plan: &Plan<'_>) {
    let (_, ident) = plan.definition();
    comment(out, &notes::message(plan));
    class(out, ident, "Message", plan.content.fields(), ident);
    if plan.types.is_empty() {
        return;
    }
    out.open(format!("namespace {ident} {{"));
    for definition in &plan.types {
        define(out, definition, ident);
    }
    out.close("}");
}

/// A class with members. Nested types are in the namespace `outer`.
fn class(out: &mut Lines, ident: &str, base: &str, fields: &[Field<'_>], outer: &str) {
    out.open(format!("class {ident} extends codec.{base} {{"));
    out.line(format!(
        "constructor(init?: codec.Init<{}>);",
        qualified(ident, outer)
    ));
    for (field, notes) in fields.iter().zip(notes::members(fields)) {
        let (mark, alternative) = if field.item.optional {
            ("?", " | undefined")
        } else {
            ("", "")
        };
        comment(out, &notes);
        let ty = type_of(&field.ty, outer);
        out.line(format!("{}{mark}: {ty}{alternative};", field.ident));
        if let Some(accessor) = &field.in_units {
            comment(out, &[notes::accessor(field)]);
            out.line(format!("{accessor}{mark}: number{alternative};"));
        }
    }
    out.close("}");
}

fn qualified(ident: &str, outer: &str) -> String {
    if ident == outer {
        ident.to_owned()
    } else {
        format!("{outer}.{ident}")
    }
}

fn define(out: &mut Lines, Definition { ident, kind }: &Definition<'_>, outer: &str) {
    comment(out, &notes::definition(kind));
    match kind {
        Kind::Group { fields, .. } => class(out, ident, "Record", fields, outer),
        Kind::Variant { alternatives, .. } if alternatives.is_empty() => {
            out.line(format!("type {ident} = {{}};"));
        }
        Kind::Variant { alternatives, .. } => {
            let kinds = alternatives.iter().map(|it| (it.ident.as_str(), &it.ty));
            union(out, ident, kinds, outer);
        }
        Kind::Measure { choices, .. } => {
            let kinds = choices.iter().map(|it| (it.ident.as_str(), &it.ty));
            union(out, ident, kinds, outer);
        }
        Kind::Scaled { .. } => {
            out.line(format!(
                "class {ident} extends codec.Scaled {{ private constructor(); }}"
            ));
        }
        Kind::Named { number, values, .. } => {
            out.line(format!("type {ident} = {};", number_type(*number)));
            out.open(format!("const {ident}: {{"));
            for (ident, value) in values {
                comment(out, &notes::value(value));
                let suffix = if number_type(*number) == "bigint" {
                    "n"
                } else {
                    ""
                };
                out.line(format!("readonly {ident}: {}{suffix};", value.index));
            }
            out.close("};");
        }
        Kind::Bits { bits, parts, .. } => {
            let raw = number_type(Number::Unsigned(bits.base));
            out.open(format!("class {ident} extends codec.Bits<{raw}> {{"));
            out.line(format!(
                "constructor(init?: codec.Init<{}>);",
                qualified(ident, outer)
            ));
            for part in parts {
                comment(out, &notes::part(part.field, part.limits));
                let ty = match &part.values {
                    Some(values) => qualified(values, outer),
                    None => number_type(Number::Unsigned(part.width)).to_owned(),
                };
                out.line(format!("{}: {ty};", part.ident));
            }
            out.close("}");
        }
    }
}

fn union<'t>(
    out: &mut Lines,
    ident: &str,
    kinds: impl Iterator<Item = (&'t str, &'t Type)>,
    outer: &str,
) {
    let kinds = kinds.map(|(kind, ty)| {
        format!(
            "{{ kind: {}; value: {} }}",
            quoted(kind),
            type_of(ty, outer)
        )
    });
    let kinds: Vec<_> = kinds.collect();
    out.open(format!("type {ident} ="));
    for (place, kind) in kinds.iter().enumerate() {
        let end = if place + 1 == kinds.len() { ";" } else { "" };
        out.line(format!("| {kind}{end}"));
    }
    out.end();
}

fn type_of(ty: &Type, outer: &str) -> String {
    match ty {
        Type::Number(number) => number_type(*number).to_owned(),
        Type::Named { ident, .. } | Type::Scaled { ident } | Type::Defined { ident } => {
            qualified(ident, outer)
        }
        Type::FixedText(_) | Type::Text(_) => "codec.Text".to_owned(),
        Type::Blob(_) => "codec.Octets".to_owned(),
        Type::Formatted { .. } => "codec.Formatted".to_owned(),
        Type::List { element, .. } => format!("{}[]", type_of(element, outer)),
        Type::Array {
            dimensions,
            element,
        } => format!(
            "{}{}",
            type_of(element, outer),
            "[]".repeat(dimensions.len())
        ),
    }
}

const fn number_type(number: Number) -> &'static str {
    match number {
        Number::Unsigned(Unsigned::U64) | Number::Signed(Signed::I64) => "bigint",
        _ => "number",
    }
}

fn comment(out: &mut Lines, paragraphs: &[String]) {
    let lines = notes::wrapped(paragraphs, out.width().saturating_sub(3));
    // The end of a comment in a text would end this one.
    let mut lines = lines.iter().map(|line| line.replace("*/", "* /"));
    match (lines.next(), lines.len()) {
        (None, _) => {}
        (Some(only), 0) => out.line(format!("/** {only} */")),
        (Some(first), _) => {
            out.line("/**");
            out.line(format!(" * {first}"));
            for line in lines {
                out.line(format!(" * {line}").trim_end());
            }
            out.line(" */");
        }
    }
}
