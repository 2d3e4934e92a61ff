//! Generates enums for `variant` and `variable_field`.

use super::docs;
use super::types::{Field, Type, total, unsigned_type};
use super::writer::Writer;
use super::{decode, encode, random};
use crate::model::{Choice, Item, Variant};

/// Writes the type of a `variant`.
pub(super) fn variant(
    out: &mut Writer,
    ident: &str,
    item: &Item,
    variant: &Variant,
    alternatives: &[Field<'_>],
) {
    let tag = unsigned_type(variant.tag);
    out.doc([
        format!("`{}`: one of its alternatives.", item.name).as_str(),
        &docs::interpretation(item),
    ]);
    if alternatives.is_empty() {
        return without_alternatives(out, ident, tag, variant.tag.size());
    }
    out.push("#[derive(Debug, Clone, PartialEq)]");
    out.push(format!("pub enum {ident} {{"));
    for field in alternatives {
        let interpretation = docs::interpretation(field.item);
        out.doc([docs::joined(&docs::field(field, None), &interpretation).as_str()]);
        out.push(format!("{}({}),", field.ident, field.ty.rust("")));
    }
    out.push("}");
    default_impl(out, ident, &alternatives[0].ident);
    out.gap();
    out.push(format!("impl codec::Composite for {ident} {{"));
    let least = alternatives
        .iter()
        .map(|field| field.ty.least())
        .min()
        .unwrap_or(0);
    out.push(format!(
        "const MIN_LEN: usize = {};",
        total([least, variant.tag.size()].into_iter())
    ));
    variant_len(out, variant.tag.size(), alternatives);
    variant_write(out, tag, alternatives);
    variant_read(out, tag, alternatives);
    out.push("}");
    variant_members(out, ident, alternatives);
}

fn default_impl(out: &mut Writer, ident: &str, first: &str) {
    out.gap();
    out.push(format!("impl Default for {ident} {{"));
    out.push(format!(
        "fn default() -> Self {{\nSelf::{first}(Default::default())\n}}\n}}"
    ));
}

fn variant_len(out: &mut Writer, tag: usize, alternatives: &[Field<'_>]) {
    out.gap();
    out.push("fn encoded_len(&self) -> usize {");
    out.push("match self {");
    for field in alternatives {
        let length = encode::length(&field.ty, "value");
        let value = if length.contains("value") {
            "value"
        } else {
            "_"
        };
        out.push(format!(
            "Self::{}({value}) => {tag} + {length},",
            field.ident
        ));
    }
    out.push("}\n}");
}

fn variant_write(out: &mut Writer, tag: &str, alternatives: &[Field<'_>]) {
    out.gap();
    out.push("fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {");
    out.push("match self {");
    for (position, field) in alternatives.iter().enumerate() {
        let write = encode::value(&field.ty, "value");
        out.push(format!("Self::{}(value) => {{", field.ident));
        out.push(format!("output.fixed({position}_{tag});"));
        out.push(format!(
            "output.member({:?}, |output| {write})",
            field.item.name
        ));
        out.push("}");
    }
    out.push("}\n}");
}

fn variant_read(out: &mut Writer, tag: &str, alternatives: &[Field<'_>]) {
    out.gap();
    out.push("fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {");
    out.push(format!(
        "match input.tag::<{tag}>({})? {{",
        alternatives.len()
    ));
    for (position, field) in alternatives.iter().enumerate() {
        let last = position + 1 == alternatives.len();
        let pattern = if last {
            "_".to_owned()
        } else {
            position.to_string()
        };
        let (name, read) = (&field.item.name, decode::reader(&field.ty));
        out.push(format!(
            "{pattern} => input.member({name:?}, {read}).map(Self::{}),",
            field.ident
        ));
    }
    out.push("}\n}");
}

/// Writes the view and random values.
fn variant_members(out: &mut Writer, ident: &str, alternatives: &[Field<'_>]) {
    let alternative = |field: &Field<'_>| {
        let made = random::maker(field).map_or_else(String::new, |maker| format!(" = {maker}"));
        format!("{}: {:?}{made}", field.ident, field.item.name)
    };
    let members: Vec<_> = alternatives.iter().map(alternative).collect();
    out.gap();
    out.list(&format!("codec::alternatives!({ident} {{"), &members, "});");
}

/// A variant without alternatives consists of its tag, 0.
fn without_alternatives(out: &mut Writer, ident: &str, tag: &str, size: usize) {
    out.push("#[derive(Debug, Clone, Copy, Default, PartialEq)]");
    out.push(format!("pub struct {ident};"));
    out.gap();
    out.push(format!("impl codec::Composite for {ident} {{"));
    out.push(format!(
        "const MIN_LEN: usize = {size};\n\nfn encoded_len(&self) -> usize {{\n{size}\n}}"
    ));
    out.gap();
    out.push("fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {");
    out.push(format!("output.fixed(0_{tag});\nOk(())\n}}"));
    out.gap();
    out.push("fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {");
    out.push(format!("input.tag::<{tag}>(0)?;\nOk(Self)\n}}\n}}"));
    super::members::group(out, ident, &[]);
}

/// Writes the type of a `variable_field`.
pub(super) fn measure(
    out: &mut Writer,
    ident: &str,
    item: &Item,
    choices: &[(&Choice, String, Type)],
) {
    out.doc([
        format!(
            "`{}`: a number whose type and unit are chosen by an index.",
            item.name
        )
        .as_str(),
        &docs::interpretation(item),
    ]);
    out.push("#[derive(Debug, Clone, Copy, PartialEq)]");
    out.push(format!("pub enum {ident} {{"));
    for (choice, variant, ty) in choices {
        let facts = docs::scalar_facts(&choice.scalar).join(", ");
        out.doc([format!("Index {}: {facts}.", choice.index)
            .replace(": .", ".")
            .as_str()]);
        out.push(format!("{variant}({}),", ty.rust("")));
    }
    out.push("}");
    let first = choices.first().map_or("", |(_, variant, _)| variant);
    default_impl(out, ident, first);
    measure_codec(out, ident, choices);
    measure_view(out, ident, choices);
    random::one_of(
        out,
        ident,
        choices
            .iter()
            .map(|(_, variant, ty)| (variant.as_str(), ty)),
    );
}

fn measure_codec(out: &mut Writer, ident: &str, choices: &[(&Choice, String, Type)]) {
    out.gap();
    out.push(format!("impl codec::Composite for {ident} {{"));
    let least = choices
        .iter()
        .filter_map(|(.., ty)| ty.size())
        .min()
        .unwrap_or(0);
    out.push(format!("const MIN_LEN: usize = {};", 1 + least));
    out.push("\nfn encoded_len(&self) -> usize {\nmatch self {");
    for (_, variant, ty) in choices {
        out.push(format!(
            "Self::{variant}(_) => {},",
            1 + ty.size().unwrap_or(0)
        ));
    }
    out.push("}\n}\n");
    out.push("fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {");
    out.push("match *self {");
    for (choice, variant, _) in choices {
        out.push(format!("Self::{variant}(value) => {{"));
        out.push(format!(
            "output.fixed({}_u8);\noutput.fixed(value);\n}}",
            choice.index
        ));
    }
    out.push("}\nOk(())\n}\n");
    out.push("fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {");
    out.push("match input.fixed::<u8>()? {");
    for (choice, variant, _) in choices {
        out.push(format!(
            "{} => input.fixed().map(Self::{variant}),",
            choice.index
        ));
    }
    out.push("index => Err(input.unknown_choice(index)),\n}\n}\n}");
}

fn measure_view(out: &mut Writer, ident: &str, choices: &[(&Choice, String, Type)]) {
    out.gap();
    out.push("codec::if_serde! {");
    out.push(format!("impl codec::view::View for {ident} {{"));
    out.push("fn view(&self) -> codec::view::Value {");
    out.push("match self {");
    for (choice, variant, _) in choices {
        let Choice { index, scalar, .. } = choice;
        out.push(format!("Self::{variant}(value) => {{"));
        out.push(format!(
            "codec::view::choice_of({index}, {:?}, value)\n}}",
            scalar.units
        ));
    }
    out.push(
        "}\n}\n\nfn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {",
    );
    out.push("codec::view::choice(value, |index, value| Some(match index {");
    for (choice, variant, _) in choices {
        let index = choice.index;
        out.push(format!(
            "{index} => codec::view::View::from_view(value).map(Self::{variant}),"
        ));
    }
    out.push("_ => return None,\n}))\n}\n}");
    out.push(format!("codec::serde_by_view!({ident});\n}}"));
}
