//! Writes the layout of a message as calls of the codec's functions.

use super::{path, quoted};
use crate::model::{Count, Number, Rounding, Signed, Unsigned};
use crate::typed::lines::Lines;
use crate::typed::types::{Definition, Field, Kind, Part, Type};
use crate::typed::{Content, Plan};

/// Writes a message and its nested types.
pub(super) fn message(out: &mut Lines, plan: &Plan<'_>) {
    out.open("{");
    for definition in &plan.types {
        define(out, definition);
    }
    let message = plan.message;
    let services = plan.services.iter().map(|id| quoted(&id.to_string()));
    let services: Vec<_> = services.collect();
    let types: Vec<_> = plan.types.iter().map(|it| it.ident.as_str()).collect();
    out.open(format!("{} = codec.message(", path(plan)));
    out.open("{");
    out.line(format!("messageName: {},", quoted(&message.name)));
    out.line(format!("code: 0x{:04x},", message.code));
    out.line(format!("isCommand: {},", message.is_command));
    out.line(format!("services: [{}],", services.join(", ")));
    out.close("},");
    out.line(if types.is_empty() {
        "{},".to_owned()
    } else {
        format!("{{ {} }},", types.join(", "))
    });
    match &plan.content {
        Content::Members(fields, presence) => {
            block(
                out,
                &format!("codec.body({}, [", unsigned_or_null(*presence)),
                fields,
            );
        }
        Content::Whole(field) => out.line(format!("codec.whole({}),", member(field))),
        Content::Sections(fields) => block(out, "codec.sections([", fields),
    }
    out.close(");");
    out.close("}");
}

fn block(out: &mut Lines, opening: &str, fields: &[Field<'_>]) {
    if fields.is_empty() {
        return out.line(format!("{opening}]),"));
    }
    out.open(opening);
    for field in fields {
        out.line(format!("{},", member(field)));
    }
    out.close("]),");
}

fn define(out: &mut Lines, Definition { ident, kind }: &Definition<'_>) {
    match kind {
        Kind::Group {
            presence, fields, ..
        } => {
            let presence = unsigned_or_null(*presence);
            out.open(format!(
                "const {ident} = codec.record({}, {presence}, [",
                quoted(ident)
            ));
            for field in fields {
                out.line(format!("{},", member(field)));
            }
            out.close("]);");
        }
        Kind::Variant {
            tag, alternatives, ..
        } => {
            out.open(format!(
                "const {ident} = codec.variant({}, [",
                unsigned(*tag)
            ));
            for field in alternatives {
                let (kind, name) = (quoted(&field.ident), quoted(field.name));
                out.line(format!(
                    "codec.alternative({kind}, {name}, {}),",
                    layout(&field.ty)
                ));
            }
            out.close("]);");
        }
        Kind::Measure { choices, .. } => {
            out.open(format!("const {ident} = codec.measure(["));
            for it in choices {
                let (kind, units) = (quoted(&it.ident), quoted(&it.choice.scalar.units));
                let (index, layout) = (it.choice.index, layout(&it.ty));
                out.line(format!("codec.choice({kind}, {index}, {units}, {layout}),"));
            }
            out.close("]);");
        }
        Kind::Scaled {
            name,
            number,
            scale,
            units,
        } => {
            let rounding = match scale.rounding {
                Rounding::Round => "round",
                Rounding::Floor => "floor",
                Rounding::Ceiling => "ceiling",
            };
            let (number, lower, upper) = (self::number(*number), scale.lower, scale.upper);
            let (class, name, units) = (quoted(ident), quoted(name), quoted(units));
            out.line(format!(
                "const {ident} = codec.scaled({class}, {number}, {name}, {lower:?}, {upper:?}, \
                 {units}, \"{rounding}\");"
            ));
        }
        Kind::Named { number, values, .. } => {
            out.open(format!("const {ident} = codec.values({{"));
            for (ident, value) in values {
                out.line(format!("{ident}: {}{},", value.index, suffix(*number)));
            }
            out.close("});");
        }
        Kind::Bits { bits, parts, .. } => {
            let base = unsigned(bits.base);
            out.open(format!(
                "const {ident} = codec.bits({}, {base}, [",
                quoted(ident)
            ));
            for part in parts {
                out.line(sub_field(part));
            }
            out.close("]);");
        }
    }
}

fn sub_field(part: &Part<'_>) -> String {
    let (key, name) = (quoted(&part.ident), quoted(&part.field.name));
    let (from, to) = (part.field.from, part.field.to);
    let (lower, upper) = part.limits;
    format!(
        "codec.part({key}, {name}, {from}, {to}, {}, {}),",
        integer(lower),
        integer(upper)
    )
}

fn member(field: &Field<'_>) -> String {
    let call = if field.item.optional {
        "optional"
    } else {
        "required"
    };
    let (key, name) = (quoted(&field.ident), quoted(field.name));
    let accessor = match &field.in_units {
        Some(accessor) => format!(", {}", quoted(accessor)),
        None => String::new(),
    };
    format!(
        "codec.{call}({key}, {name}, {}{accessor})",
        layout(&field.ty)
    )
}

/// An expression for the layout of a type.
fn layout(ty: &Type) -> String {
    match ty {
        Type::Number(number) | Type::Named { number, .. } => self::number(*number).to_owned(),
        Type::Scaled { ident } | Type::Defined { ident } => ident.clone(),
        Type::FixedText(length) => format!("codec.fixedText({length})"),
        Type::Text(count) => format!("codec.text({})", limits(count)),
        Type::Blob(count) => format!("codec.blob({})", limits(count)),
        Type::Formatted { count, .. } => format!("codec.formatted({})", limits(count)),
        Type::List { count, element } => {
            format!("codec.list({}, {})", limits(count), layout(element))
        }
        Type::Array {
            dimensions,
            element,
        } => {
            let sizes: Vec<_> = dimensions.iter().map(u32::to_string).collect();
            format!("codec.array([{}], {})", sizes.join(", "), layout(element))
        }
    }
}

fn limits(count: &Count) -> String {
    let (min, max) = (integer(count.min), integer(count.max));
    format!("{}, {min}, {max}", unsigned(count.unsigned))
}

/// A literal of an integer of any size.
fn integer(number: u64) -> String {
    let suffix = if number < 1 << 53 { "" } else { "n" };
    format!("{number}{suffix}")
}

fn unsigned_or_null(number: Option<Unsigned>) -> &'static str {
    number.map_or("null", unsigned)
}

const fn unsigned(number: Unsigned) -> &'static str {
    self::number(Number::Unsigned(number))
}

const fn number(number: Number) -> &'static str {
    match number {
        Number::Unsigned(Unsigned::U8) => "codec.u8",
        Number::Unsigned(Unsigned::U16) => "codec.u16",
        Number::Unsigned(Unsigned::U32) => "codec.u32",
        Number::Unsigned(Unsigned::U64) => "codec.u64",
        Number::Signed(Signed::I8) => "codec.i8",
        Number::Signed(Signed::I16) => "codec.i16",
        Number::Signed(Signed::I32) => "codec.i32",
        Number::Signed(Signed::I64) => "codec.i64",
        Number::F32 => "codec.f32",
        Number::F64 => "codec.f64",
    }
}

/// The suffix of literals: integers of eight octets are `bigint`s.
const fn suffix(number: Number) -> &'static str {
    match number {
        Number::Unsigned(Unsigned::U64) | Number::Signed(Signed::I64) => "n",
        _ => "",
    }
}
