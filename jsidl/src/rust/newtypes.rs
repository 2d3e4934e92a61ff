//! Generates newtypes over integers: scaled, enumerated and bit fields.

use super::docs;
use super::types::{SubType, number_type, unsigned_type, width};
use super::writer::Writer;
use crate::dynamic::Steps;
use crate::model::{
    BitField, Item, NamedValue, Number, Rounding, Scale, SubField, Unsigned, ValueSet,
};

const DERIVES: &str = "#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]";

/// Writes the type of a scaled integer.
pub(super) fn scaled(
    out: &mut Writer,
    ident: &str,
    name: &str,
    number: Number,
    scale: Scale,
    unit: &str,
) {
    let ty = number_type(number);
    let in_unit = if unit == "one" {
        String::new()
    } else {
        format!(" in {}", docs::prose(unit))
    };
    let step = Steps::of(&scale, number).map_or(f64::NAN, |steps| steps.step());
    out.doc([format!(
        "`{name}`{in_unit}: {} to {} in steps of {step:.3e}, carried as `{ty}`.",
        scale.lower, scale.upper
    )
    .as_str()]);
    out.push(DERIVES);
    out.push(format!("pub struct {ident}({ty});"));
    let rounding = match scale.rounding {
        Rounding::Round => "Round",
        Rounding::Floor => "Floor",
        Rounding::Ceiling => "Ceiling",
    };
    out.gap();
    out.push(format!(
        "codec::scaled!({ident}({ty}), {name:?}, {} to {} {unit:?}, {rounding});",
        float(scale.lower),
        float(scale.upper)
    ));
}

fn float(value: f64) -> String {
    format!("{value:?}_f64")
}

/// Writes the type of a number with named values.
pub(super) fn enumeration(
    out: &mut Writer,
    ident: &str,
    name: &str,
    number: Number,
    values: &[(String, NamedValue)],
    set: Option<&ValueSet>,
) {
    let ty = number_type(number);
    let ranges = set.and_then(docs::ranges);
    out.doc([
        format!("`{name}`: a number with named values. Others are kept as they come.").as_str(),
        &ranges.map_or_else(String::new, |ranges| format!("Without a name: {ranges}.")),
    ]);
    out.push(DERIVES);
    out.push(format!("pub struct {ident}(pub {ty});"));
    out.gap();
    out.push(format!("impl {ident} {{"));
    for (constant, value) in values {
        let value_is = format!("`{}` = {}.", docs::prose(&value.name), value.index);
        let interpretation = docs::prose(&value.interpretation);
        out.doc([docs::joined(&value_is, &interpretation).as_str()]);
        out.push(format!(
            "pub const {constant}: Self = Self({});",
            value.index
        ));
    }
    out.push("}");
    out.gap();
    // A negative index is in two's complement, as the codec compares it.
    let entry =
        |(_, value): &(String, NamedValue)| format!("({}, {:?})", value.index as u64, value.name);
    let entries: Vec<_> = values.iter().map(entry).collect();
    out.list(
        &format!("codec::enumeration!({ident}({ty}), ["),
        &entries,
        "]);",
    );
}

/// Writes the type of a bit field.
pub(super) fn bits(
    out: &mut Writer,
    ident: &str,
    item: &Item,
    bits: &BitField,
    fields: &[SubType<'_>],
) {
    let ty = unsigned_type(bits.base);
    out.doc([format!(
        "`{}`: several numbers in one `{ty}`. Bits outside all of them are kept.",
        item.name
    )
    .as_str()]);
    out.push(DERIVES);
    out.push(format!("pub struct {ident}(pub {ty});"));
    out.gap();
    out.push(format!("codec::sub_fields!({ident}({ty}) {{"));
    for field in fields {
        sub_field(out, field);
    }
    out.push("});");
    if is_time_stamp(bits) {
        out.gap();
        out.push(format!("impl {ident} {{"));
        out.push("/// The stamp of a time since the beginning of 1970 (UTC).\n#[must_use]");
        out.push("pub const fn at(since_1970: ::core::time::Duration) -> Self {");
        out.push("Self(codec::time_stamp(since_1970))\n}\n}");
    }
    out.gap();
    let entry = |sub: &SubType<'_>| {
        let values = sub.enumeration.as_ref();
        let values = values.map_or_else(String::new, |values| format!(", {values}"));
        let SubField { name, from, to, .. } = sub.field;
        format!("({name:?}, {from}, {to}{values})")
    };
    let entries: Vec<_> = fields.iter().map(entry).collect();
    out.list(
        &format!("codec::bit_field!({ident}({ty}), ["),
        &entries,
        "]);",
    );
}

/// Whether it is the standard's time stamp, in the layout of `jaus_codec::time_stamp`.
pub(super) fn is_time_stamp(bits: &BitField) -> bool {
    let fields = bits.fields.iter();
    let layout = fields.map(|field| (&*field.name, field.from, field.to));
    bits.base == Unsigned::U32 && layout.eq(TIME_STAMP)
}

const TIME_STAMP: [(&str, u8, u8); 5] = [
    ("Milliseconds", 0, 9),
    ("Seconds", 10, 15),
    ("Minutes", 16, 21),
    ("Hour", 22, 26),
    ("Day", 27, 31),
];

fn sub_field(out: &mut Writer, sub: &SubType<'_>) {
    let SubType {
        field,
        ident,
        replace,
        enumeration,
    } = sub;
    let (name, from, to) = (&field.name, field.from, field.to);
    let int = unsigned_type(width(field));
    let (least, greatest) = limits(sub);
    let place = if from == to {
        format!("bit {from}")
    } else {
        format!("bits {from} to {to}")
    };
    let range =
        docs::ranges(&field.values).map_or_else(String::new, |ranges| format!(", {ranges}"));
    let facts = format!("`{name}`: {place}{range}.");
    let interpretation = docs::prose(&field.interpretation);
    out.doc([docs::joined(&facts, &interpretation).as_str()]);
    let values = enumeration
        .as_ref()
        .map_or_else(String::new, |values| format!(" as {values}"));
    out.push(format!(
        "{ident}: {int}{values}, {from} to {to}, {least} to {greatest}, {name:?} => {replace};"
    ));
}

/// The range that the definition permits, limited to the available bits.
fn limits(sub: &SubType<'_>) -> (u64, u64) {
    let field = sub.field;
    let most = u64::MAX >> (63 - (field.to - field.from));
    let set = &field.values;
    let named = set.values.iter().map(|value| {
        let index = u64::try_from(value.index).unwrap_or(0);
        (index, index)
    });
    let ranges = set.ranges.iter().map(|range| {
        (
            range.lower.max(0.0).ceil() as u64,
            range.upper.max(0.0).floor() as u64,
        )
    });
    let stated = named
        .chain(ranges)
        .reduce(|(a, b), (c, d)| (a.min(c), b.max(d)));
    let (least, greatest) = stated.unwrap_or((0, most));
    (least.min(most), greatest.min(most))
}
