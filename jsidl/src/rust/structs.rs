//! Generates structs: message bodies, records and sequences, with accessors in engineering units.

use super::docs;
use super::ident::{Names, unit_suffix};
use super::types::{Field, Type};
use super::writer::Writer;
use crate::model::Unsigned;

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
        out.doc([docs::field(field, bit).as_str(), &interpretation]);
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
        let members = required.map(|field| field.ty.least()).sum::<usize>();
        self.code_size() + self.presence.map_or(0, Unsigned::size) + members
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
            Type::Array { dimensions, .. } if !optional(field) => {
                let inner = "Default::default()".to_owned();
                let nested = |inner, _: &u32| format!("::std::array::from_fn(|_| {inner})");
                dimensions.iter().fold(inner, nested)
            }
            _ => "Default::default()".to_owned(),
        };
        out.push(format!("{}: {value},", field.ident));
    }
    out.push("}\n}\n}");
}

/// Getters and setters in the unit of the field.
fn accessors(out: &mut Writer, ident: &str, fields: &[Field<'_>], prefix: &str) {
    let scaled = |field: &&Field<'_>| matches!(field.ty, Type::Newtype { scale: Some(_), .. });
    if !fields.iter().any(|field| scaled(&field)) {
        return;
    }
    out.gap();
    out.push(format!("impl {ident} {{"));
    let mut names = Names::default();
    for field in fields {
        let Type::Newtype {
            scale: Some((scale, unit)),
            ..
        } = &field.ty
        else {
            continue;
        };
        let name = names.snake(&format!("{} {}", field.item.name, unit_suffix(unit)));
        let ty = field.ty.rust(prefix);
        let what = &field.item.name;
        let unit = if unit == "one" {
            String::new()
        } else {
            format!(" in {}", docs::prose(unit))
        };
        let member = &field.ident;
        let (returns, get, set) = if optional(field) {
            let get = format!("self.{member}.map({ty}::value)");
            ("Option<f64>", get, format!("Some({ty}::new(value)?)"))
        } else {
            (
                "f64",
                format!("self.{member}.value()"),
                format!("{ty}::new(value)?"),
            )
        };
        out.gap();
        out.doc([format!("`{what}`{unit}.").as_str()]);
        out.push(format!("pub fn {name}(&self) -> {returns} {{\n{get}\n}}"));
        out.gap();
        out.doc([
            format!("Sets `{what}`{unit} to the nearest value that the field can hold.").as_str(),
            "# Errors",
        ]);
        out.push(format!(
            "/// If the value is not in {} to {}.",
            scale.lower, scale.upper
        ));
        out.push(format!(
            "pub fn set_{}(&mut self, value: f64) -> Result<(), codec::OutOfRange> {{",
            name.trim_start_matches("r#")
        ));
        out.push(format!("self.{member} = {set};\nOk(())\n}}"));
    }
    out.push("}");
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
