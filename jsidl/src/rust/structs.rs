//! Generates structs: message bodies, records and sequences, with accessors in engineering units.

use super::docs;
use super::ident::{Names, unit_suffix};
use super::types::{Field, Type, total};
use super::writer::Writer;
use crate::model::{Scale, Unsigned};

/// Writes a struct with its accessors, after its documentation.
pub(super) fn declare(
    out: &mut Writer,
    ident: &str,
    fields: &[Field<'_>],
    prefix: &str,
    copy: bool,
) {
    let derives_default = fields
        .iter()
        .all(|field| optional(field) || field.ty.derives_default());
    let default = if derives_default { "Default, " } else { "" };
    let copy = if copy { "Copy, " } else { "" };
    out.push(format!("#[derive(Debug, Clone, {copy}{default}PartialEq)]"));
    if fields.is_empty() {
        out.push(format!("pub struct {ident};"));
        return;
    }
    out.push(format!("pub struct {ident} {{"));
    let mut bits = 0..;
    for field in fields {
        let interpretation = docs::interpretation(field.item);
        let bit = if optional(field) { bits.next() } else { None };
        out.doc([docs::joined(&docs::field(field, bit), &interpretation).as_str()]);
        out.push(format!(
            "pub {}: {},",
            field.ident,
            rust_type(field, prefix)
        ));
    }
    out.push("}");
    if !derives_default {
        default_impl(out, ident, fields);
    }
    accessors(out, ident, fields, prefix);
}

pub(super) fn optional(field: &Field<'_>) -> bool {
    field.item.optional
}

/// Layout of a struct.
pub(super) struct Body<'a> {
    pub(super) fields: &'a [Field<'a>],
    pub(super) presence: Option<Unsigned>,
    /// Whether it is a message, which begins with its code.
    pub(super) message: bool,
}

impl Body<'_> {
    /// Whether the struct has one fixed size if all optional members are present.
    pub(super) fn has_fast_path(&self) -> bool {
        self.presence.is_some() && self.fields.iter().all(|field| field.ty.size().is_some())
    }

    /// Whether the codec is small, or part of a loop.
    pub(super) fn inlined(&self) -> bool {
        !self.message || self.has_fast_path()
    }

    pub(super) fn code_size(&self) -> usize {
        if self.message { 2 } else { 0 }
    }

    /// Minimum number of octets.
    pub(super) fn least(&self) -> usize {
        let required = self.fields.iter().filter(|field| !optional(field));
        let members = required.map(|field| field.ty.least());
        let before = [self.code_size(), self.presence.map_or(0, Unsigned::size)];
        total(before.into_iter().chain(members))
    }
}

fn rust_type(field: &Field<'_>, prefix: &str) -> String {
    let ty = field.ty.rust(prefix);
    if optional(field) {
        format!("Option<{ty}>")
    } else {
        ty
    }
}

/// Implements `Default` for arrays too long for the standard library's.
fn default_impl(out: &mut Writer, ident: &str, fields: &[Field<'_>]) {
    out.gap();
    out.push(format!("impl Default for {ident} {{"));
    out.push("fn default() -> Self {");
    out.push("Self {");
    for field in fields {
        let value = match &field.ty {
            Type::Array { .. } if !optional(field) => field.ty.filled("Default::default()"),
            _ => "Default::default()".to_owned(),
        };
        out.push(format!("{}: {value},", field.ident));
    }
    out.push("}\n}\n}");
}

/// Methods of every struct, whose names accessors must not hide.
const METHODS: &[&str] = &[
    "read_some",
    "write_some",
    "encoded_len",
    "encode",
    "encode_into",
    "decode",
    "read",
    "write",
    "get",
    "put",
    "view",
    "from_view",
    "clone",
    "eq",
    "default",
    "stamp",
    "without_values",
    "drop_unrequested",
];

/// The scale of a scaled number, with its unit.
fn scale<'f>(field: &'f Field<'_>) -> Option<(&'f Scale, &'f str)> {
    match &field.ty {
        Type::Newtype {
            scale: Some((scale, unit)),
            ..
        } => Some((scale, unit)),
        _ => None,
    }
}

/// The names of the getter, the setter and the step of the builder of a field in its unit.
fn accessor_names(names: &mut Names, field: &Field<'_>, unit: &str) -> (String, [String; 2]) {
    let name = format!("{} {}", field.item.name, unit_suffix(unit));
    names.snake_family(&name, ["set_", "with_"])
}

/// The names that the methods of a struct with these fields have.
pub(super) fn method_names(fields: &[Field<'_>]) -> Names {
    let mut names = Names::reserving(METHODS);
    for (field, (_, unit)) in fields.iter().filter_map(|it| Some((it, scale(it)?))) {
        accessor_names(&mut names, field, unit);
    }
    names
}

/// Getters, setters and steps of the builder in the unit of the field.
fn accessors(out: &mut Writer, ident: &str, fields: &[Field<'_>], prefix: &str) {
    if !fields.iter().any(|field| scale(field).is_some()) {
        return;
    }
    out.gap();
    out.push(format!("codec::accessors!({ident} {{"));
    let mut names = Names::reserving(METHODS);
    for field in fields {
        let Some((scale, unit)) = scale(field) else {
            continue;
        };
        let (getter, [setter, step]) = accessor_names(&mut names, field, unit);
        let in_unit = match unit {
            "one" => String::new(),
            unit => format!(" in {}", docs::prose(unit)),
        };
        let what = format!("`{}`{in_unit}", field.item.name);
        let ty = field.ty.rust(prefix);
        let optional = if optional(field) { ", ?" } else { "" };
        let range = format!("{} to {}", scale.lower, scale.upper);
        out.push(format!(
            "{}: {ty}{optional} => {getter}, {setter}, {step}, {what:?}, {range:?};",
            field.ident
        ));
    }
    out.push("});");
}

/// Writes the codec of a fixed size struct.
pub(super) fn fixed(out: &mut Writer, ident: &str, fields: &[Field<'_>]) {
    let size: usize = fields.iter().filter_map(|field| field.ty.size()).sum();
    let mut at = 0;
    let places: Vec<_> = fields
        .iter()
        .map(|field| {
            let place = if at == 0 {
                "at".to_owned()
            } else {
                format!("at + {at}")
            };
            at += field.ty.size().unwrap_or(0);
            (&field.ident, place)
        })
        .collect();
    out.gap();
    out.push(format!("impl codec::Fixed for {ident} {{"));
    out.push(format!("const SIZE: usize = {size};"));
    out.push("\n#[inline]\nfn get(run: &[u8], at: usize) -> Self {\nSelf {");
    for (ident, place) in &places {
        out.push(format!("{ident}: codec::Fixed::get(run, {place}),"));
    }
    out.push("}\n}\n\n#[inline]\nfn put(self, run: &mut [u8], at: usize) {");
    for (ident, place) in &places {
        out.push(format!("codec::Fixed::put(self.{ident}, run, {place});"));
    }
    out.push("}\n}");
}
