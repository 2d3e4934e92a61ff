//! Writes the type stub of a set's module.

use super::{everything, path, quoted, vectors};
use crate::model::{Count, Number};
use crate::presence::PresenceVector;
use crate::typed::lines::Lines;
use crate::typed::names::version;
use crate::typed::types::{Definition, Field, Kind, Type};
use crate::typed::{Plan, Set, notes};

/// The stub of a set's module.
pub(super) fn module(set: &Set<'_>) -> String {
    let mut out = Lines::new("    ");
    docstring(&mut out, &format!("The messages of {}.", set.urn));
    out.line("");
    out.line("from enum import IntEnum");
    out.line("from typing import Literal, overload");
    out.line("");
    out.line("from jaus.messages import typed");
    for number in set.versions() {
        out.line("");
        out.open(format!("class {}:", version(number)));
        for (plan, ident) in set.shared_in(number) {
            out.line(format!("{ident} = {}", path(plan)));
        }
        for plan in set.defined_in(number) {
            out.line("");
            message(&mut out, plan, &vectors(plan, set));
        }
        out.end();
    }
    out.line("");
    let newest = set.messages.iter();
    let newest = newest.filter_map(|plan| Some((plan, plan.newest.as_deref()?)));
    for (plan, ident) in newest {
        out.line(format!("{ident} = {}", path(plan)));
    }
    out.finish()
}

fn docstring(out: &mut Lines, text: &str) {
    out.line(quoted(text));
}

fn message(out: &mut Lines, plan: &Plan<'_>, vectors: &[PresenceVector]) {
    let (_, ident) = plan.definition();
    let class = Class {
        outer: path(plan),
        vectors,
    };
    out.open(format!("class {ident}(typed.Message):"));
    let notes = notes::message(plan);
    docstring(out, notes.get(..2).unwrap_or(&notes).join(" ").as_str());
    for definition in &plan.types {
        class.define(out, definition);
    }
    class.members(out, plan.content.fields());
    out.end();
}

/// A message's class.
struct Class<'v> {
    /// Its place in the module, before the names of its nested types.
    outer: String,
    vectors: &'v [PresenceVector],
}

impl Class<'_> {
    fn define(&self, out: &mut Lines, Definition { ident, kind }: &Definition<'_>) {
        let base = match kind {
            Kind::Group { .. } => "typed.Record",
            Kind::Variant { .. } => "typed.Variant",
            Kind::Measure { .. } => "typed.Measure",
            Kind::Scaled { .. } => "typed.Scaled",
            Kind::Named { .. } => "IntEnum",
            Kind::Bits { .. } => "typed.Bits",
        };
        if matches!(kind, Kind::Scaled { .. }) {
            return out.line(format!("class {ident}({base}): ..."));
        }
        out.open(format!("class {ident}({base}):"));
        match kind {
            Kind::Group { fields, .. } => self.members(out, fields),
            Kind::Variant { alternatives, .. } => {
                let choices = alternatives.iter();
                let choices = choices.map(|it| (it.ident.as_str(), self.element(&it.ty)));
                one_of(out, &choices.collect::<Vec<_>>());
            }
            Kind::Measure { choices, .. } => {
                let choices = choices.iter();
                let choices = choices.map(|it| (it.ident.as_str(), self.element(&it.ty)));
                one_of(out, &choices.collect::<Vec<_>>());
            }
            Kind::Named { values, .. } if values.is_empty() => out.line("..."),
            Kind::Named { values, .. } => {
                for (ident, value) in values {
                    out.line(format!("{ident} = {}", value.index));
                }
            }
            Kind::Bits { parts, .. } => {
                let parts = parts.iter().map(|part| {
                    let ty = match &part.values {
                        Some(values) => format!("{}.{values} | int", self.outer),
                        None => "int".to_owned(),
                    };
                    (part.ident.as_str(), ty)
                });
                let parts: Vec<_> = parts.collect();
                let keywords = parts.iter().map(|(ident, _)| format!("{ident}: int = ..."));
                initializer(out, "", &keywords.collect::<Vec<_>>());
                for (ident, ty) in &parts {
                    out.line(format!("{ident}: {ty}"));
                }
            }
            Kind::Scaled { .. } => {}
        }
        out.end();
    }

    /// The constructor and the members of a record.
    fn members(&self, out: &mut Lines, fields: &[Field<'_>]) {
        let keywords = fields.iter().map(|field| self.keyword(field));
        let (mut required, optional): (Vec<_>, Vec<_>) =
            keywords.partition(|keyword| !keyword.ends_with("= ..."));
        required.extend(optional);
        initializer(out, "", &required);
        for field in fields {
            let none = if field.item.optional { " | None" } else { "" };
            let ty = self.type_of(&field.ty);
            out.line(format!("{}: {ty}{none}", field.ident));
            if let Some(accessor) = &field.in_units {
                out.line(format!("{accessor}: float{none}"));
            }
        }
    }

    /// A member as a keyword of the constructor. A scaled integer has its name in units.
    fn keyword(&self, field: &Field<'_>) -> String {
        let (ident, ty) = match &field.in_units {
            Some(accessor) => (accessor, format!("float | {}", self.type_of(&field.ty))),
            None => (&field.ident, self.type_of(&field.ty)),
        };
        let is_whole_vector = everything(self.vectors, field.name).is_some();
        match (field.item.optional, &field.ty) {
            (true, _) => format!("{ident}: {ty} | None = ..."),
            _ if is_whole_vector => format!("{ident}: {ty} = ..."),
            (false, ty_of) if may_be_empty(ty_of) => format!("{ident}: {ty} = ..."),
            _ => format!("{ident}: {ty}"),
        }
    }

    fn type_of(&self, ty: &Type) -> String {
        match ty {
            Type::Number(Number::F32 | Number::F64) => "float".to_owned(),
            Type::Number(_) => "int".to_owned(),
            Type::Named { ident, .. } => format!("{}.{ident} | int", self.outer),
            Type::Scaled { ident } | Type::Defined { ident } => format!("{}.{ident}", self.outer),
            Type::FixedText(_) | Type::Text(_) => "str | bytes".to_owned(),
            Type::Blob(_) => "bytes".to_owned(),
            Type::Formatted { .. } => "typed.Formatted".to_owned(),
            Type::List { element, .. } => format!("list[{}]", self.element(element)),
            Type::Array {
                dimensions,
                element,
            } => dimensions
                .iter()
                .fold(self.element(element), |inner, _| format!("list[{inner}]")),
        }
    }

    /// An element of a list, or the value of a choice: a scaled integer is a number in its unit.
    fn element(&self, ty: &Type) -> String {
        match ty {
            Type::Scaled { .. } => "float".to_owned(),
            other => self.type_of(other),
        }
    }
}

/// Whether a member that is not given is empty: its least count is 0.
fn may_be_empty(ty: &Type) -> bool {
    match ty {
        Type::FixedText(_) => true,
        Type::Text(Count { min, .. })
        | Type::Blob(Count { min, .. })
        | Type::List {
            count: Count { min, .. },
            ..
        } => *min == 0,
        _ => false,
    }
}

/// A constructor with keywords.
fn initializer(out: &mut Lines, decorator: &str, keywords: &[String]) {
    if !decorator.is_empty() {
        out.line(decorator);
    }
    let star = if keywords.is_empty() { "" } else { ", *, " };
    let keywords = keywords.join(", ");
    out.line(format!("def __init__(self{star}{keywords}) -> None: ..."));
}

/// The members of a class that holds one of several types.
fn one_of(out: &mut Lines, choices: &[(&str, String)]) {
    let decorator = if choices.len() > 1 { "@overload" } else { "" };
    for (ident, ty) in choices {
        initializer(out, decorator, &[format!("{ident}: {ty}")]);
    }
    if choices.is_empty() {
        return initializer(out, "", &[]);
    }
    let kinds: Vec<_> = choices.iter().map(|(ident, _)| quoted(ident)).collect();
    let mut types: Vec<_> = choices.iter().map(|(_, ty)| ty.as_str()).collect();
    types.sort_unstable();
    types.dedup();
    out.line("@property");
    out.line(format!(
        "def kind(self) -> Literal[{}]: ...",
        kinds.join(", ")
    ));
    out.line("@property");
    out.line(format!("def value(self) -> {}: ...", types.join(" | ")));
    for (ident, ty) in choices {
        if !["kind", "value", "units", "raw"].contains(ident) {
            out.line("@property");
            out.line(format!("def {ident}(self) -> {ty} | None: ..."));
        }
    }
}
