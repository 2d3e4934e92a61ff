//! Generates newtypes over integers: scaled, enumerated and bit fields.

use super::docs;
use super::types::{SubType, number_type, unsigned_type, width};
use super::writer::Writer;
use crate::dynamic::Steps;
use crate::model::{BitField, Item, NamedValue, Number, Rounding, Scale, Unsigned, ValueSet};

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
        out.doc([
            format!("`{}` = {}.", docs::prose(&value.name), value.index).as_str(),
            &docs::prose(&value.interpretation),
        ]);
        out.push(format!(
            "pub const {constant}: Self = Self({});",
            value.index
        ));
    }
    out.push("}");
    out.gap();
    out.push(format!("codec::enumeration!({ident}({ty}), ["));
    for (_, value) in values {
        // A negative index is in two's complement, as the codec compares it.
        out.push(format!("({}, {:?}),", value.index as u64, value.name));
    }
    out.push("]);");
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
    out.push(format!("impl {ident} {{"));
    for field in fields {
        sub_field(out, bits.base, field);
    }
    if is_time_stamp(bits) {
        out.gap();
        out.push("/// The stamp of a time since the beginning of 1970 (UTC).\n#[must_use]");
        out.push("pub const fn at(since_1970: ::std::time::Duration) -> Self {");
        out.push("Self(codec::time_stamp(since_1970))\n}");
    }
    out.push("}");
    out.gap();
    out.push(format!("codec::bit_field!({ident}({ty}), ["));
    for SubType {
        field, enumeration, ..
    } in fields
    {
        let values = enumeration
            .as_ref()
            .map_or_else(String::new, |values| format!(", {values}"));
        out.push(format!(
            "({:?}, {}, {}{values}),",
            field.name, field.from, field.to
        ));
    }
    out.push("]);");
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

fn sub_field(out: &mut Writer, base: Unsigned, sub: &SubType<'_>) {
    let SubType {
        field,
        ident,
        enumeration,
    } = sub;
    let (name, from, to) = (&field.name, field.from, field.to);
    let base = unsigned_type(base);
    let int = unsigned_type(width(field));
    let (least, greatest) = limits(sub);
    let place = if from == to {
        format!("bit {from}")
    } else {
        format!("bits {from} to {to}")
    };
    let range =
        docs::ranges(&field.values).map_or_else(String::new, |ranges| format!(", {ranges}"));
    out.gap();
    out.doc([
        format!("`{name}`: {place}{range}.").as_str(),
        &docs::prose(&field.interpretation),
    ]);
    let raw = if base == "u64" {
        "self.0"
    } else {
        "self.0 as u64"
    };
    let get = format!("codec::bits::get({raw}, {from}, {to}) as {int}");
    let ty = enumeration.as_deref().unwrap_or(int);
    let wrapped = if enumeration.is_some() {
        format!("{ty}({get})")
    } else {
        get
    };
    out.push(format!(
        "pub const fn {ident}(self) -> {ty} {{\n{wrapped}\n}}"
    ));
    out.gap();
    let value = if enumeration.is_some() {
        "value.0"
    } else {
        "value"
    };
    out.doc([
        format!("The same with another `{name}`.").as_str(),
        "# Errors",
    ]);
    out.push(format!("/// If the value is not in {least} to {greatest}."));
    let function = format!("with_{}", ident.trim_start_matches("r#"));
    out.push(format!(
        "pub const fn {function}(self, value: {ty}) -> Result<Self, codec::OutOfRange> {{"
    ));
    let field = format!("({name:?}, {from}, {to})");
    let value = format!("{value} as u64");
    out.push(format!(
        "match codec::bits::set_checked({raw}, {field}, {value}, ({least}, {greatest})) {{"
    ));
    out.push(format!(
        "Ok(raw) => Ok(Self(raw as {base})),\nErr(error) => Err(error),\n}}\n}}"
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
